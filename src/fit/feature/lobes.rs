//! Lobes: form error that repeats round an axis, as clamping and turning leave it.
//!
//! Of m lobes r = a cos(m t) + b sin(m t) a fit to part of a turn takes some for its own parameters, and what it leaves tells how much that
//! was: for each m the amplitudes are estimated from the residuals with what the parameters could have taken counted in, and
//! weighed by their likelihood, over all m and all sizes of amplitudes. Only where some m stands out of noise by far is
//! anything done: the parameters then get the uncertainty of what the lobes may have moved them by. Noise that neighbours share has
//! some of every m: lobes stand out where what is left without them shakes them less by far.

use nalgebra::DMatrix;

use super::count::{Count, Row, rows};
use super::descend::{Freedoms, normal};
use super::fixed::Fixed;
use super::kind::FeatureType;
use super::pose::Pose;
use super::small::{Square, inverse};
use super::together::Together;
use crate::fit::Shape;
use crate::geometry::Vec3;

/// Lobes that are looked for: one is a centre that is off, and more than these average out on most arcs.
const COUNTS: std::ops::RangeInclusive<usize> = 2..=7;
/// Twice the logarithm of the likelihood by which lobes must stand out: independent noise does so for one of six m with
/// probability 6 exp(-20 / 2), one in 3,700.
const STANDS_OUT: f64 = 20.0;
/// Amplitudes that are weighed: so many, by factors of two, from the noise's standard deviation times this power of two on, which hardly
/// shows, to what hides all else.
const AMPLITUDES: i32 = 12;
const LEAST: i32 = -2;
/// Most points of a region that they are looked for in.
const MOST: usize = 4000;

/// What lobes do to a feature.
pub struct Lobes {
    /// Second moment of what they may have moved the open places by.
    pub moved: DMatrix<f64>,
    /// Standard deviation of what is left of the residuals, degrees of freedom taken off.
    pub deviation: f64,
    pose: Pose,
    free: Freedoms,
    likeliest: Count,
}

impl Lobes {
    /// Those about a surface with nothing fixed; of many points some are looked at.
    pub fn about(shape: &Shape, points: &[Vec3]) -> Option<Self> {
        let pose = Pose::of(shape);
        if !has_axis(&pose) {
            return None;
        }
        let stride = points.len().div_ceil(MOST);
        let some: Vec<Vec3> = points.iter().step_by(stride.max(1)).copied().collect();
        let free = Fixed::default().freedoms(pose.kind);
        let jj = normal(&pose, &some, &free).jj;
        let information = DMatrix::from_fn(free.count(), free.count(), |a, b| jj[a][b]);
        lobes(&pose, &some, &free, &jj, &inverse(&information)?)
    }

    /// Points with what the parameters leave of the lobes of the likeliest count taken out.
    pub fn without(&self, points: &[Vec3]) -> Vec<Vec3> {
        self.likeliest.taken_out(&rows(&self.pose, points, &self.free), points)
    }
}

fn has_axis(pose: &Pose) -> bool {
    use FeatureType::{Circle, Cone, Cylinder, EllipticCylinder, Torus};
    matches!(pose.kind, Circle | Cone | Cylinder | EllipticCylinder | Torus)
}

/// The lobes about a least-squares pose with J'J `jj` of its open places, whose inverse is `inverse`; `None` where the type has no axis that
/// they could repeat about, or none stand out.
pub fn lobes(
    pose: &Pose,
    points: &[Vec3],
    free: &Freedoms,
    jj: &Square,
    inverse: &DMatrix<f64>,
) -> Option<Lobes> {
    if !has_axis(pose) {
        return None;
    }
    let mut rows = rows(pose, points, free);
    fit_out(&mut rows, inverse);
    let spare = rows.len().checked_sub(free.count() + 2).filter(|n| *n > 0)? as f64;
    let squares: f64 = rows.iter().map(|r| r.residual * r.residual).sum();
    let mut all: Vec<Count> = COUNTS.map(|m| Count::of(m, &rows, inverse)).collect();
    let place =
        (0..all.len()).max_by(|&a, &b| all[a].explained().total_cmp(&all[b].explained()))?;
    let best = &all[place];
    let sq = (squares - best.explained()) / spare;
    if sq.is_nan() || sq <= 0.0 || best.explained() < STANDS_OUT * sq {
        return None;
    }
    let rest = best.taken_out(&rows, points);
    let deviation = sq.sqrt();
    let together = Together::of(pose, &rest, free, jj, deviation);
    let noise = sq * together.along(deviation, |x| best.height(pose, free, x));
    if best.explained() < STANDS_OUT * noise {
        return None;
    }
    let moved = moved(&all, best, noise);
    let (pose, free, likeliest) = (*pose, *free, all.swap_remove(place));
    Some(Lobes { moved, deviation, pose, free, likeliest })
}

/// Takes out of the residuals what the parameters could: a surface that others than its points decided upon is not the nearest to these.
fn fit_out(rows: &mut [Row], inverse: &DMatrix<f64>) {
    let p = inverse.nrows();
    let mut jr = DMatrix::zeros(p, 1);
    for row in rows.iter() {
        (0..p).for_each(|a| jr[(a, 0)] += row.slope[a] * row.residual);
    }
    let by = inverse * jr;
    for row in rows {
        row.residual -= (0..p).map(|a| row.slope[a] * by[(a, 0)]).sum::<f64>();
    }
}

/// Mean over all counts and amplitudes, by their likelihood beside that of `best` at its own, of the second moment of the places' moves.
fn moved(all: &[Count], best: &Count, sq: f64) -> DMatrix<f64> {
    let p = best.moved.nrows();
    let (mut sum, mut weights) = (DMatrix::zeros(p, p), 0.0);
    for count in all {
        for k in 0..AMPLITUDES {
            let tau = sq * 4.0_f64.powi(k + LEAST);
            let mut log = -0.5 * best.explained() / sq;
            let mut mean = [0.0; 2];
            let mut second = DMatrix::zeros(2, 2);
            for j in 0..2 {
                let (l, z) = (count.values[j], count.along[j]);
                log -= 0.5 * (tau * l / sq).ln_1p();
                log += 0.5 * z * z * tau / (sq * (sq + tau * l));
                mean[j] = tau * z / (sq + tau * l);
                second[(j, j)] = tau * sq / (sq + tau * l);
            }
            for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                second[(a, b)] += mean[a] * mean[b];
            }
            let weight = log.exp();
            weights += weight;
            sum += &count.moved * second * count.moved.transpose() * weight;
        }
    }
    sum / weights
}

#[cfg(test)]
mod tests {
    use super::super::assess::assess;
    use super::super::{Asked, Association, Fixed};
    use super::*;
    use crate::fit::fits::Random;

    /// Part of a cylinder of radius 10 with three lobes at any phase.
    fn part(n: usize, degrees: f64, lobes: f64, random: &mut Random) -> Vec<Vec3> {
        let phase = random.uniform(0.0, std::f64::consts::TAU);
        let point = |_| {
            let t = random.uniform(-0.5, 0.5) * degrees.to_radians();
            let r = 10.0 + lobes * (3.0 * t + phase).cos() + 0.02 * random.normal();
            Vec3::new(r * t.cos(), r * t.sin(), random.uniform(0.0, 20.0))
        };
        (0..n).map(point).collect()
    }

    /// Share of radii within their expanded uncertainty of 95.45 %, and the ratio of root mean square error and uncertainty.
    fn covered(degrees: f64, lobes: f64) -> (f64, f64) {
        let (rounds, mut covered, mut error, mut told) = (60, 0, 0.0, 0.0);
        for seed in 0..rounds {
            let points = part(1000, degrees, lobes, &mut Random::new(seed + 300));
            let asked = Asked {
                kind: Some(FeatureType::Cylinder),
                association: Association::Gaussian,
                fixed: Fixed::default(),
                outliers: None,
                type_b: 0.0,
                coverage: 0.9545,
            };
            let exactness = assess(&points, &asked).unwrap().exactness.unwrap();
            let radius = exactness.parameters.iter().find(|p| p.name == "radius").unwrap();
            let off: f64 = radius.values[0] - 10.0;
            covered += usize::from(off.abs() <= radius.expanded[0]);
            error += off * off;
            told += radius.standard[0].powi(2);
        }
        (covered as f64 / rounds as f64, (error / told).sqrt())
    }

    #[test]
    fn the_uncertainty_holds_what_lobes_do_to_a_radius_on_any_arc() {
        for degrees in [360.0, 180.0, 90.0] {
            let (share, ratio) = covered(degrees, 0.1);
            assert!(share > 0.9, "{degrees}: {share}");
            assert!((0.4..1.3).contains(&ratio), "{degrees}: {ratio}");
        }
    }

    #[test]
    fn a_surface_beside_the_nearest_has_no_lobes_for_that() {
        let points = part(2000, 90.0, 0.0, &mut Random::new(11));
        let tube = [10.01, 0.0, 0.0];
        let beside =
            Pose::with_axis(FeatureType::Cylinder, Vec3::new(0.02, -0.01, 0.0), Vec3::z(), tube);
        assert!(Lobes::about(&beside.shape().unwrap(), &points).is_none());
    }

    #[test]
    fn independent_noise_is_no_lobes() {
        for degrees in [360.0, 60.0] {
            let (share, ratio) = covered(degrees, 0.0);
            assert!(share > 0.87, "{degrees}: {share}");
            assert!((0.75..1.25).contains(&ratio), "{degrees}: {ratio}");
        }
    }
}
