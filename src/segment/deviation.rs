//! Distance of each point from its own surface.

use rayon::prelude::*;

use crate::fit::Shape;
use crate::geometry::{PointCloud, Quadric, Vec3};
use crate::segment::Region;

/// Points worked on at once.
const CHUNK: usize = 4096;

/// What a region's points are measured from.
enum Measure {
    Shape(Shape),
    /// A quadric without engineering parameters, about an origin.
    Quadric(Quadric, Vec3),
    /// A region without either.
    None,
}

impl Measure {
    fn of(region: &Region) -> Self {
        match (&region.surface, region.local_coefficients) {
            (Some(surface), _) => Self::Shape(Shape::from(surface)),
            (None, Some(all)) => Self::Quadric(Quadric(all), region.local_origin.into()),
            (None, None) => Self::None,
        }
    }

    fn distance(&self, p: &Vec3) -> f64 {
        match self {
            Self::Shape(shape) => shape.distance(p),
            Self::Quadric(quadric, origin) => {
                let x = p - origin;
                quadric.distance(&x).abs().copysign(quadric.value(&x))
            }
            Self::None => f64::NAN,
        }
    }

    fn normal(&self, p: &Vec3) -> Vec3 {
        match self {
            Self::Shape(shape) => shape.offset(p).normal,
            Self::Quadric(quadric, origin) => {
                quadric.gradient(&(p - origin)).try_normalize(0.0).unwrap_or_default()
            }
            Self::None => Vec3::zeros(),
        }
    }
}

/// What the points of each region are measured from.
pub struct Measures(Vec<Measure>);

impl Measures {
    /// Those of a result's regions.
    pub fn of(regions: &[Region]) -> Self {
        Self(regions.iter().map(Measure::of).collect())
    }

    /// Signed distance of a point from the surface of the region `label`, as [`deviations`] has it; NaN where that has none.
    pub fn deviation(&self, label: i32, p: &Vec3) -> f64 {
        let measure = usize::try_from(label).ok().and_then(|label| self.0.get(label));
        measure.map_or(f64::NAN, |measure| measure.distance(p))
    }
}

impl std::fmt::Debug for Measures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Measures").field(&self.0.len()).finish()
    }
}

/// Signed distance of each input point from the surface of its region, in input order; NaN where it has none.
///
/// It is positive outside: away from an axis, a centre or a tube's middle line, on the side of a plane's `normal`, and
/// where the local equation of another quadric is positive. `labels` are in input order. Elliptic surfaces to second
/// order, as everywhere.
pub fn deviations(cloud: &PointCloud, labels: &[i32], regions: &[Region]) -> Vec<f64> {
    let measures = Measures::of(regions);
    let one = |(k, p): (usize, &Vec3)| {
        let at = cloud.input_index.as_ref().map_or(k, |index| index[k] as usize);
        measures.deviation(labels.get(at).copied().unwrap_or(-1), p)
    };
    let stored: Vec<f64> =
        cloud.points.par_iter().with_min_len(CHUNK).enumerate().map(one).collect();
    let Some(index) = &cloud.input_index else { return stored };
    let mut all = vec![f64::NAN; cloud.input_len];
    index.iter().zip(stored).for_each(|(&i, d)| all[i as usize] = d);
    all
}

/// Unit normal of its region's surface at each stored point, for drawing; zeros where it has none. `labels` are in
/// input order.
pub fn surface_normals(cloud: &PointCloud, labels: &[i32], regions: &[Region]) -> Vec<[f32; 3]> {
    let measures: Vec<Measure> = regions.iter().map(Measure::of).collect();
    let one = |(k, p): (usize, &Vec3)| {
        let at = cloud.input_index.as_ref().map_or(k, |index| index[k] as usize);
        let label = labels.get(at).and_then(|l| usize::try_from(*l).ok());
        let normal = label.and_then(|l| measures.get(l)).map(|m| m.normal(p));
        normal.map_or([0.0; 3], |n| [n.x as f32, n.y as f32, n.z as f32])
    };
    cloud.points.par_iter().with_min_len(CHUNK).enumerate().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::segment::{Parameters, Silent, segment};

    #[test]
    fn points_outside_are_above_and_those_without_a_region_have_none() {
        let mut random = Random::new(2);
        let far = Vec3::new(1e5, -2e5, 3e4);
        let mut points = vec![Vec3::repeat(f64::NAN)];
        let mut truth = vec![f64::NAN];
        for _ in 0..4000 {
            let (turn, off) = (random.uniform(0.0, 6.3), 0.02 * random.normal());
            let r = 10.0 + off;
            points.push(far + Vec3::new(r * turn.cos(), r * turn.sin(), random.uniform(0.0, 30.0)));
            truth.push(off);
        }
        points.push(far);
        let cloud = PointCloud::from_points(points);
        let found = segment(&cloud, &Parameters::default(), &Silent).unwrap();
        let labels = cloud.labels_in_input_order(found.labels.clone());
        let told = deviations(&cloud, &labels, &found.regions);
        assert_eq!(told.len(), cloud.input_len);
        assert!(told[0].is_nan() && told[4001].is_nan());
        let squares: f64 = told.iter().filter(|d| !d.is_nan()).map(|d| d * d).sum();
        let region = &found.regions[0];
        let rms = (squares / region.point_count as f64).sqrt();
        assert!((rms / region.fit.rms - 1.0).abs() < 1e-3, "{rms} {}", region.fit.rms);
        let known = told.iter().zip(&truth).filter(|(d, _)| !d.is_nan());
        assert!(known.clone().all(|(d, t)| (d - t).abs() < 0.01) && known.count() > 3900);
    }
}
