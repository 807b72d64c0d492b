//! Start sets that some surface explains.

use crate::fit::constant::constants;
use crate::fit::starts::Patch;
use crate::fit::{Family, may_hold};
use crate::geometry::Vec3;
use crate::segment::family::{Families, Scored};
use crate::segment::objective::unassigned;
use crate::segment::prepare::scene::Scene;

constants! {
    /// Points a fit during growth looks at.
    pub FIT_SAMPLE: usize = 400, Effort("points of one fit");
    /// Reduced chi2 up to which a surface may be the points'.
    pub FITS: f64 = 2.0, Trial(2.0, 2.0);
    /// Start sets up to so many points are first looked at for any quadric: larger ones may have too many outliers.
    FEW: usize = 40, Effort("start sets that are looked at twice");
    /// Mean square from a quadric, over that of a surface that may be the points', beyond which none is near them.
    CLEARLY: f64 = 5.0, Effort("start sets that every family is fitted to");
    /// Points visited in the time that it takes to try every family on a sample.
    pub TRIED: usize = 6000, Effort("work that is allowed");
}

/// Points of a set and the normals there.
#[derive(Default)]
pub struct Sample {
    pub points: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl Sample {
    /// Takes at most about `limit` points of `support`, evenly.
    pub fn take(&mut self, scene: &Scene, support: &[u32], limit: usize) {
        self.points.clear();
        self.normals.clear();
        let m = support.len().min(limit);
        for k in 0..m {
            let i = support[k * support.len() / m] as usize;
            self.points.push(scene.points[i]);
            self.normals.push(scene.normals[i]);
        }
    }

    /// For the fits.
    pub fn patch(&self) -> Patch<'_> {
        Patch { points: &self.points, normals: &self.normals }
    }
}

/// A start set and the surface that explains it.
pub struct Seeded {
    pub support: Vec<u32>,
    pub sample: Sample,
    pub best: Scored,
    /// Families that do not explain it.
    pub hopeless: Vec<Family>,
}

impl Seeded {
    /// The surface of any family that explains a start set.
    pub fn of(scene: &Scene, families: &Families, support: Vec<u32>) -> Option<Self> {
        let mut sample = Sample::default();
        sample.take(scene, &support, FIT_SAMPLE.get());
        let mut hopeless = Vec::new();
        let n = support.len();
        scene.work.spend(TRIED.get() as u64 / 2);
        if n <= FEW.get() {
            let outliers = (FITS.get() * n as f64 / unassigned()) as usize;
            let reach = CLEARLY.get() * FITS.get() * families.sigma * families.sigma;
            if !may_hold(&sample.points, outliers, reach) {
                hopeless.extend(Family::ALL.into_iter().filter(|f| *f != Family::Torus));
            }
        }
        let best = families.best(&sample.patch(), &[], &mut hopeless, FITS.get())?;
        (best.reduced <= FITS.get()).then_some(Self { support, sample, best, hopeless })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::fixtures;
    use crate::segment::random::SplitMix64;

    /// The families that are hopeless, or none where none explains the points.
    fn hopeless(points: Vec<Vec3>) -> Option<usize> {
        let scene = Scene::new(points);
        let sigma = 1e-3;
        let families = Families { sigma, floor: sigma, ..fixtures::families() };
        let all = (0..scene.len() as u32).collect();
        Seeded::of(&scene, &families, all).map(|s| s.hopeless.len())
    }

    #[test]
    fn a_torus_is_found_where_no_quadric_is_near_and_nothing_at_a_corner() {
        let random = &mut SplitMix64::new(2);
        let mut unit = || random.below(1 << 30) as f64 / f64::from(1 << 30);
        // on a grid that gives good normals: of a start as small as this a torus is seldom found
        let torus = (0..36).map(|k| {
            let (t, u) = (0.15 * f64::from(k % 6), 0.4 * f64::from(k / 6));
            let r = 3.0 + u.cos();
            Vec3::new(r * t.cos(), r * t.sin(), u.sin())
        });
        let all_but_it = Family::ALL.len() - 1;
        assert_eq!(hopeless(torus.collect()), Some(all_but_it));
        let plane = (0..30).map(|_| Vec3::new(unit(), unit(), 0.0));
        assert_eq!(hopeless(plane.collect()), Some(0));
        let corner = (0..30).map(|k| {
            let mut p = Vec3::new(unit(), unit(), 0.0);
            p.swap_rows(2, k % 3);
            p
        });
        assert_eq!(hopeless(corner.collect()), None);
    }
}
