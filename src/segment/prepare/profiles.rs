//! Clouds taken profile by profile, the profiles further apart than surfaces bend along them.

use nalgebra::SymmetricEigen;

use crate::fit::constant::constants;
use crate::geometry::{Mat3, Vec3};
use crate::segment::median::median;
use crate::segment::prepare::nearest::Runs;
use crate::segment::prepare::patch::{INNER, spread};
use crate::segment::prepare::place::place;

constants! {
    /// Sites whose neighbourhoods are looked at.
    SITES: usize = 500, Effort("sites looked at");
    /// Points within two spacings from which on a place lies on a sheet and not on a curve: points at least one spacing
    /// apart are 4 at most on a curve, and 8 to 12 on a sheet.
    ON_CURVE: usize = 5, Derived("4 within two spacings on a curve");
    /// Share of the normals' squares along the one direction from which on the planes of profiles are parallel.
    PARALLEL: f64 = 0.9, Trial(0.9, 0.9);
    /// Profiles that a surface can be told from.
    LEAST: usize = 4, Derived("a patch of 24 points that is as long as wide spans 5");
}

/// Parallel planes that points lie in, on curves.
///
/// Drawn together along their normal the profiles lie as far apart as the points along them; quadrics stay quadrics.
/// So neighbours are looked for, and how rough neighbourhoods are; surfaces are fitted to the points as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profiles {
    normal: Vec3,
    /// Which way a profile lies from the one before, so long that its share of the normal is 1.
    along: Vec3,
    /// How far apart they are.
    step: f64,
    /// What a distance between profiles counts.
    share: f64,
}

impl Profiles {
    /// Those of points in Morton order, none nearer to another than `spacing`; None where they are on no such profiles.
    pub fn of(points: &[Vec3], spacing: f64) -> Option<Self> {
        let runs = Runs::of(points);
        let sites = points.len().min(SITES.get());
        let mut planes = Mat3::zeros();
        let mut beside = Vec::with_capacity(sites);
        for k in 0..sites {
            let site = place(k, sites, points.len());
            let near = runs.closest(&points[site], site);
            let near: Vec<Vec3> = near.places().iter().map(|&j| points[j as usize]).collect();
            let within = |p: &&Vec3| (*p - points[site]).norm() < 2.0 * spacing;
            beside.push(near.iter().filter(within).count() as f64 - 1.0);
            let normal = spread(&near[..near.len().min(INNER.get())]).2;
            planes += normal * normal.transpose();
        }
        if median(&mut beside)? >= ON_CURVE.get() as f64 {
            return None;
        }
        let planes = SymmetricEigen::new(planes);
        let (largest, most) = planes.eigenvalues.argmax();
        if most < PARALLEL.get() * sites as f64 {
            return None;
        }
        let normal = planes.eigenvectors.column(largest).into_owned();
        let mut heights: Vec<f64> = points.iter().map(|p| p.dot(&normal)).collect();
        heights.sort_unstable_by(f64::total_cmp);
        let mut steps: Vec<f64> =
            heights.windows(2).map(|h| h[1] - h[0]).filter(|step| *step > spacing).collect();
        if steps.len() + 1 < LEAST.get() {
            return None;
        }
        let step = median(&mut steps)?;
        Some(Self { normal, along: along(points, &normal), step, share: 1.0 })
    }

    /// The same, `apart` from each other when they are drawn together.
    pub fn drawn_to(self, apart: f64) -> Self {
        Self { share: apart / self.step, ..self }
    }

    /// A point of the profiles drawn together.
    pub fn drawn(&self, p: &Vec3) -> Vec3 {
        p - self.along * ((1.0 - self.share) * p.dot(&self.normal))
    }

    /// The normal that a surface has whose normal is `normal` where the profiles are drawn together: normals of an image
    /// are mapped back by the transpose.
    pub fn undrawn(&self, normal: &Vec3) -> Vec3 {
        (normal - self.normal * ((1.0 - self.share) * normal.dot(&self.along))).normalize()
    }
}

/// How the middle of the points moves along a normal, for each step of 1 along it: profiles may lie at a slant to what
/// they are of.
fn along(points: &[Vec3], normal: &Vec3) -> Vec3 {
    let mean = points.iter().sum::<Vec3>() / points.len() as f64;
    let height = |p: &Vec3| (p - mean).dot(normal);
    let moved: Vec3 = points.iter().map(|p| (p - mean) * height(p)).sum();
    moved / points.iter().map(|p| height(p).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::fixtures::ordered;

    /// Points one apart on rings of radius 8, `apart` from each other and each moved by `shift` against the last.
    fn rings(apart: f64, shift: f64) -> Vec<Vec3> {
        let at = |k: usize| {
            let (ring, angle) =
                ((k / 50) as f64, 0.02 * std::f64::consts::PI * 2.0 * (k % 50) as f64);
            Vec3::new(8.0 * angle.cos() + shift * ring, apart * ring, 8.0 * angle.sin())
        };
        ordered(&(0..500).map(at).collect::<Vec<_>>())
    }

    #[test]
    fn rings_that_lie_far_apart_are_drawn_onto_each_other() {
        for shift in [0.0, 6.0] {
            let points = rings(20.0, shift);
            let found = Profiles::of(&points, 1.0).unwrap().drawn_to(2.0);
            let drawn: Vec<Vec3> = points.iter().map(|p| found.drawn(p)).collect();
            let mean = drawn.iter().sum::<Vec3>() / 500.0;
            for p in drawn.iter().map(|p| p - mean) {
                // what they move against each other shrinks alike
                let x = p.x - shift / 20.0 * p.y;
                assert!((x.hypot(p.z) - 8.0).abs() < 1e-9, "{shift}: {p}");
                assert!((p.y.rem_euclid(2.0) - 1.0).abs() < 1e-9, "{shift}: {p}");
            }
        }
    }

    #[test]
    fn normals_found_on_profiles_drawn_together_are_those_of_the_surface() {
        let found = Profiles::of(&rings(20.0, 6.0), 1.0).unwrap().drawn_to(2.0);
        let (s, t) = (Vec3::new(1.0, 2.0, 0.5), Vec3::new(-0.3, 1.0, 2.0));
        let normal = found.undrawn(&found.drawn(&s).cross(&found.drawn(&t)));
        assert!((normal.dot(&s.cross(&t).normalize()).abs() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn rings_that_are_as_near_as_their_points_and_sheets_are_no_profiles() {
        assert_eq!(Profiles::of(&rings(1.0, 0.0), 0.9), None);
        let sheet = |k: usize| Vec3::new((k % 20) as f64, (k / 20) as f64, 0.0);
        assert_eq!(Profiles::of(&ordered(&(0..400).map(sheet).collect::<Vec<_>>()), 0.9), None);
    }
}
