//! A second set of surfaces, for which all accepted relations hold exactly.

use nalgebra::DVector;

use super::chi2::survival;
use super::cluster::COMPATIBLE;
use super::constraint::Constraint;
use super::face::{Face, Frame};
use super::joint::{Innovation, Joint, farthest, moved};
use super::search::Accepted;
use crate::fit::Shape;
use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::{Region, Snapped};

constants! {
    /// Steps of Newton's method that lead to surfaces for which all equations hold.
    STEPS: usize = 12, Effort("steps; each squares what is left");
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

/// The surfaces nearest to those fitted, in units of their uncertainty, for which all that was accepted holds.
///
/// Relations without which the rest holds are left out, the least probable first: those that contradict others, those
/// that would move a surface by more than its uncertainty allows, and those that would move all together by so much.
pub fn snap(faces: &[Face], found: &[Accepted]) -> Snap {
    let mut left_out = Vec::new();
    loop {
        let trial = solve(faces, found, &left_out);
        let Some(worst) = trial.worst(faces, found) else {
            left_out.sort_unstable();
            return Snap { left_out, ..trial.snap };
        };
        left_out.push(worst);
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
    /// The faces it binds.
    faces: Vec<usize>,
    /// What it added to those before it.
    innovation: Innovation,
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
    let (mut told, mut chi2, mut total, mut rank) = (Vec::new(), Vec::new(), 0.0, 0);
    for _ in 0..STEPS.get() {
        let mut joint = Joint::beside(faces, at, off);
        told = asked
            .iter()
            .map(|(relation, c)| Told {
                relation: *relation,
                faces: c.faces(),
                innovation: joint.add(c),
                off: f64::INFINITY,
            })
            .collect::<Vec<_>>();
        (at, chi2) = joint.solved();
        (total, rank) = (joint.chi2(), joint.rank());
        let next = farthest(faces, &at, asked.iter().map(|a| a.1));
        // a further step makes the movement the least there is, and is exact if the first is nearly
        if off.replace(next).is_some_and(|off| off < EXACT) {
            break;
        }
    }
    for (told, (_, constraint)) in told.iter_mut().zip(&asked) {
        told.off = farthest(faces, &at, std::iter::once(*constraint));
    }
    Trial { snap: Snap { steps: at, chi2, total, rank, left_out: Vec::new() }, told }
}

impl Trial {
    /// The relation that has to be left out, if any.
    fn worst(&self, faces: &[Face], found: &[Accepted]) -> Option<usize> {
        let odds = |k: &usize| found[*k].odds();
        let least = |which: &dyn Fn(&Told) -> bool| {
            let those = self.told.iter().filter(|t| which(t)).map(|t| t.relation);
            those.min_by(|a, b| odds(a).total_cmp(&odds(b)))
        };
        let p = |face: usize| survival(self.snap.chi2[face], faces[face].shape.family.dof());
        let farthest = (0..faces.len()).min_by(|&a, &b| p(a).total_cmp(&p(b)));
        if let Some(face) = farthest.filter(|&f| p(f) < COMPATIBLE.get()) {
            return least(&|t| t.faces.contains(&face));
        }
        let inexact = least(&|t| !t.holds());
        if inexact.is_some() || survival(self.snap.total, self.snap.rank) >= COMPATIBLE.get() {
            return inexact;
        }
        let new = self.told.iter().filter(|t| t.innovation.rank > 0);
        let p = |t: &Told| t.innovation.probability();
        new.min_by(|a, b| p(a).total_cmp(&p(b))).map(|t| t.relation)
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
