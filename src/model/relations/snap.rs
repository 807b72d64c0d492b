//! A second set of surfaces, for which all accepted relations hold exactly.

use nalgebra::DVector;

use super::chi2::survival;
use super::cluster::COMPATIBLE;
use super::constraint::Constraint;
use super::face::Face;
use super::frame::Frame;
use super::joint::{Joint, farthest, moved};
use super::search::Accepted;
use crate::fit::Shape;
use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::{Region, Snapped};

constants! {
    /// Steps of Newton's method that lead to surfaces for which all equations hold.
    STEPS: usize = 12, Effort("steps; each squares what is left");
    /// Probability of a face's movement below which it is one of those that are left out where all together move too far.
    DOUBTFUL: f64 = 1e-3, Derived("one face of a thousand moves so far by chance");
}

/// What counts as holding, in the scene's size and in radians: a hundredth of what is promised, and far above rounding.
const EXACT: f64 = 1e-11;

/// What was made of the accepted relations.
pub struct Snap {
    /// The step of each face's degrees of freedom.
    steps: Vec<DVector<f64>>,
    /// Chi-squared of each.
    chi2: Vec<f64>,
    /// Chi-squared of all.
    pub total: f64,
    /// How many equations that says.
    pub rank: usize,
    /// The places of what had to be left out.
    pub left_out: Vec<usize>,
}

/// What the accepted relations do not go with.
enum Worst {
    /// Faces that they would move by more than their uncertainty allows.
    Faces(Vec<usize>),
    /// The relation that contradicts others, by its place.
    Relation(usize),
}

/// The surfaces nearest to those fitted, in units of their uncertainty, for which all that was accepted holds.
///
/// Relations that contradict others are left out, the least probable first.
///
/// # Errors
/// The faces that the relations would move by more than their uncertainty allows, each by itself or all together: what was
/// accepted of them is not right.
pub fn snap(faces: &[Face], found: &[Accepted]) -> Result<Snap, Vec<usize>> {
    let mut left_out = Vec::new();
    loop {
        let trial = solve(faces, found, &left_out);
        match trial.worst(faces, found) {
            Some(Worst::Faces(faces)) => return Err(faces),
            Some(Worst::Relation(worst)) => left_out.push(worst),
            None => {
                left_out.sort_unstable();
                return Ok(Snap { left_out, ..trial.snap });
            }
        }
        // what stands on it goes with it; what is needed was found before
        for (k, accepted) in found.iter().enumerate() {
            let stands = |n: &usize| left_out.contains(n);
            if !left_out.contains(&k) && accepted.needs.iter().any(stands) {
                left_out.push(k);
            }
        }
    }
}

/// How a constraint does in a solution.
struct Told {
    /// The place of its relation.
    relation: usize,
    /// How far it is from holding.
    off: f64,
}

impl Told {
    fn holds(&self) -> bool {
        self.off < EXACT
    }
}

/// A solution, and how each constraint does.
struct Trial {
    snap: Snap,
    told: Vec<Told>,
}

fn solve(faces: &[Face], found: &[Accepted], left_out: &[usize]) -> Trial {
    let kept = |k: &usize| !left_out.contains(k);
    let asked: Vec<(usize, &Constraint)> = (0..found.len())
        .filter(kept)
        .flat_map(|k| found[k].constraints.iter().map(move |c| (k, c)))
        .collect();
    let mut at = Joint::still(faces);
    let mut off = None;
    let (mut chi2, mut total, mut rank) = (Vec::new(), 0.0, 0);
    for _ in 0..STEPS.get() {
        let mut joint = Joint::beside(faces, at, off);
        asked.iter().for_each(|(_, constraint)| {
            joint.add(constraint);
        });
        (at, chi2) = joint.solved();
        (total, rank) = (joint.chi2(), joint.rank());
        let next = farthest(faces, &at, asked.iter().map(|a| a.1));
        // a further step makes the movement the least there is, and is exact if the first is nearly
        if off.replace(next).is_some_and(|off| off < EXACT) {
            break;
        }
    }
    let told = |(relation, constraint): &(usize, &Constraint)| Told {
        relation: *relation,
        off: farthest(faces, &at, std::iter::once(*constraint)),
    };
    let told = asked.iter().map(told).collect();
    Trial { snap: Snap { steps: at, chi2, total, rank, left_out: Vec::new() }, told }
}

impl Trial {
    /// What has to be left out, if anything.
    fn worst(&self, faces: &[Face], found: &[Accepted]) -> Option<Worst> {
        let p = |face: usize| survival(self.snap.chi2[face], faces[face].shape.family.dof());
        let below = |limit: f64| (0..faces.len()).filter(|&f| p(f) < limit).collect::<Vec<_>>();
        let least = (0..faces.len()).map(p).fold(1.0, f64::min);
        if least < COMPATIBLE.get() {
            // what one pulls at may be right: those that moved about as far as the farthest go first
            let far = |f: usize| self.snap.chi2[f] / faces[f].shape.family.dof() as f64;
            let most = (0..faces.len()).map(far).fold(0.0, f64::max);
            let mut all = below(COMPATIBLE.get());
            all.retain(|&f| far(f) >= most / 2.0);
            return Some(Worst::Faces(all));
        }
        let odds = |k: &usize| found[*k].odds();
        let broken = self.told.iter().filter(|t| !t.holds()).map(|t| t.relation);
        if let Some(worst) = broken.min_by(|a, b| odds(a).total_cmp(&odds(b))) {
            return Some(Worst::Relation(worst));
        }
        let fits = survival(self.snap.total, self.snap.rank) >= COMPATIBLE.get();
        (!fits).then(|| Worst::Faces(below(least.max(DOUBTFUL.get()) * (1.0 + f64::EPSILON))))
    }
}

impl Snap {
    /// The region of a face as it is after the snap.
    pub fn region(&self, place: usize, face: &Face, frame: &Frame, region: &Region) -> Snapped {
        let step = &self.steps[place];
        let shape = frame.world(&moved(face, step));
        let deviations = face.covariance.diagonal().map(|v| v.max(0.0).sqrt());
        let in_deviations = |(s, d): (&f64, &f64)| if *d > 0.0 { (s / d).abs() } else { 0.0 };
        let freedom = face.shape.family.dof();
        let moved = step.iter().zip(deviations.iter()).map(in_deviations).fold(0.0, f64::max);
        let far = shape.quadric().map(|q| q.scaled());
        Snapped {
            surface: shape.surface(),
            coefficients: far.map(|(q, _)| q.0),
            coefficients_scale: far.map(|(_, scale)| scale),
            local_coefficients: local(&shape, region),
            moved,
            p_value: survival(self.chi2[place], freedom),
        }
    }
}

/// The surface of a region that stays as it is; `None` where it has none in engineering terms.
pub fn unmoved(region: &Region) -> Option<Snapped> {
    Some(Snapped {
        surface: region.surface?,
        coefficients: region.coefficients,
        coefficients_scale: region.coefficients_scale,
        local_coefficients: region.local_coefficients,
        moved: 0.0,
        p_value: 1.0,
    })
}

/// The coefficients about the region's local origin, on the scale of those of the surface as fitted.
fn local(shape: &Shape, region: &Region) -> Option<[f64; 10]> {
    let fitted = region.local_coefficients?;
    let quadric = shape.translated(&-Vec3::from(region.local_origin)).quadric()?;
    let (mut both, mut square) = (0.0, 0.0);
    for (a, b) in quadric.0.iter().zip(&fitted) {
        both += a * b;
        square += a * a;
    }
    Some(quadric.0.map(|a| a * both / square))
}
