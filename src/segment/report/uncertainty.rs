//! How exactly a surface's engineering parameters are known.

use crate::segment::report::motion::falling;
use nalgebra::DMatrix;
use serde_json::{Map, Value, json};

use crate::fit::{Family, Shape, Spread};
use crate::geometry::Vec3;
use crate::segment::report::motion::motions;

/// Points of a region whose derivatives are worth summing; of more, every n-th may stand for the rest.
pub const SAMPLE: usize = 6_000;

/// A size whose standard deviation is over this share of its value cannot be told from zero or from
/// infinity; so cannot an angle of this many radians.
const IDENTIFIABLE: f64 = 1.0 / 3.0;

/// Standard deviations of the engineering parameters of a surface.
///
/// A point of an axis or plane is the one beside the points' centroid, so its deviation along the axis or
/// in the plane is zero. They are propagated from the covariance of an orthogonal-distance fit to
/// the region's points: see [`Spread::covariance`].
pub struct Uncertainty {
    /// The engineering parameters, by name, with the width of each in `covariance`.
    names: Vec<(&'static str, usize)>,
    /// Covariance of all components of the parameters, in the order of `names`.
    covariance: DMatrix<f64>,
    /// Covariance of the degrees of freedom, in the order of [`Shape::distance_jacobian`].
    pub of_freedoms: DMatrix<f64>,
    /// Parameters that the points cannot tell.
    unknown: Vec<&'static str>,
}

impl Uncertainty {
    /// That of `shape` fitted to points with noise `sigma`, of which each of `points` stands for `share` like
    /// it; none for the torus, and none for fewer points than degrees of freedom.
    ///
    /// `shape` should have its origin beside the centroid of `points` (see [`Shape::recentred`]).
    pub fn of(shape: &Shape, points: &[Vec3], share: f64, sigma: f64) -> Option<Self> {
        if points.len() <= shape.family.dof() {
            return None;
        }
        let of_freedoms = Spread::of(shape, points).covariance(sigma, share);
        let names = names(shape.family)?;
        let columns: Vec<_> = motions(shape).iter().map(|m| m.parameters(shape)).collect();
        let change = DMatrix::from_columns(&columns);
        let covariance = &change * &of_freedoms * change.transpose();
        let finite = covariance.iter().all(|v| v.is_finite());
        let mut this = Self { names, covariance, of_freedoms, unknown: Vec::new() };
        this.unknown = this.not_told(shape);
        finite.then_some(this)
    }

    /// The entry of a result: for each parameter its standard deviation (a number for a length or an angle
    /// and for the angle of a direction, one for each coordinate of a point and for each of a list),
    /// `covariance` with `covariance_of`, the parameters whose components its rows are, and
    /// `identifiable`, false where a radius, a semi-axis or an angle is not three standard deviations
    /// away from zero or a direction is known to no better than a third of a radian; then
    /// `not_identifiable` names the parameters.
    pub fn to_json(&self) -> Value {
        let mut out = Map::new();
        for (name, at, width) in self.places() {
            let deviations = self.deviations(name, at, width);
            let list = name.starts_with("semi_axis") || deviations.len() > 1;
            out.insert(name.into(), if list { json!(deviations) } else { json!(deviations[0]) });
        }
        let names: Vec<_> = self.names.iter().map(|n| n.0).collect();
        let rows: Vec<Vec<f64>> =
            self.covariance.row_iter().map(|r| r.iter().copied().collect()).collect();
        out.insert("covariance_of".into(), json!(names));
        out.insert("covariance".into(), json!(rows));
        out.insert("identifiable".into(), json!(self.unknown.is_empty()));
        if !self.unknown.is_empty() {
            out.insert("not_identifiable".into(), json!(self.unknown));
        }
        Value::Object(out)
    }

    /// Standard deviations of the components of a parameter; of a direction one, its angle's.
    fn deviations(&self, name: &str, at: usize, width: usize) -> Vec<f64> {
        let one = |k: usize| self.covariance[(k, k)].max(0.0).sqrt();
        if is_direction(name) {
            let angle = |k: usize| one(k).hypot(one(k + 1)).hypot(one(k + 2));
            (at..at + width).step_by(3).map(angle).collect()
        } else {
            (at..at + width).map(one).collect()
        }
    }

    /// Name, first row and width of each parameter.
    fn places(&self) -> impl Iterator<Item = (&'static str, usize, usize)> {
        self.names.iter().scan(0, |at, &(name, width)| {
            *at += width;
            Some((name, *at - width, width))
        })
    }

    fn not_told(&self, shape: &Shape) -> Vec<&'static str> {
        let told = |name: &str, deviations: &[f64]| match name {
            _ if is_direction(name) => deviations.iter().all(|d| *d < IDENTIFIABLE),
            "radius" | "semi_axes" | "half_angle" => {
                deviations.iter().zip(sizes(shape)).all(|(d, size)| *d < size * IDENTIFIABLE)
            }
            _ => true,
        };
        self.places()
            .filter(|&(name, at, width)| !told(name, &self.deviations(name, at, width)))
            .map(|p| p.0)
            .collect()
    }
}

fn is_direction(name: &str) -> bool {
    matches!(name, "normal" | "axis_direction" | "semi_axis_directions")
}

/// The parameters of a family's surface in the order of its fields, with their number of components.
fn names(family: Family) -> Option<Vec<(&'static str, usize)>> {
    Some(match family {
        Family::Plane => vec![("point", 3), ("normal", 3)],
        Family::Sphere => vec![("center", 3), ("radius", 1)],
        Family::Cylinder => vec![("axis_point", 3), ("axis_direction", 3), ("radius", 1)],
        Family::Cone => vec![("apex", 3), ("axis_direction", 3), ("half_angle", 1)],
        Family::EllipticCylinder => vec![
            ("axis_point", 3),
            ("axis_direction", 3),
            ("semi_axes", 2),
            ("semi_axis_directions", 6),
        ],
        Family::Ellipsoid => vec![("center", 3), ("semi_axes", 3), ("semi_axis_directions", 9)],
        Family::Torus => return None,
    })
}

/// Radius, semi-axes (the larger first) or half angle.
fn sizes(shape: &Shape) -> Vec<f64> {
    match shape.family {
        Family::Plane | Family::Torus => Vec::new(),
        Family::Sphere | Family::Cylinder => vec![shape.size[0]],
        Family::Cone => vec![shape.size[1].abs()],
        Family::EllipticCylinder | Family::Ellipsoid => {
            falling(shape).iter().map(|&i| shape.size[i]).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::least_squares::{Options, fit};
    use crate::segment::random::SplitMix64;

    struct Noise(SplitMix64);

    impl Noise {
        fn uniform(&mut self, from: f64, to: f64) -> f64 {
            from + (to - from) * self.0.below(1 << 40) as f64 / (1_u64 << 40) as f64
        }

        fn normal(&mut self) -> f64 {
            (0..12).map(|_| self.uniform(-0.5, 0.5)).sum()
        }
    }

    /// `n` points within `arc` of a cylinder's section, 20 long, with noise along the normal.
    fn arc(radius: f64, arc: f64, n: usize, sigma: f64, noise: &mut Noise) -> Vec<Vec3> {
        let mut point = || {
            let a = noise.uniform(-arc / 2.0, arc / 2.0);
            let r = radius + sigma * noise.normal();
            Vec3::new(r * a.cos(), r * a.sin(), noise.uniform(-10.0, 10.0))
        };
        (0..n).map(|_| point()).collect()
    }

    fn fitted(start: &Shape, points: &[Vec3]) -> Shape {
        let options = Options { cauchy: None, steps: 40, tolerance: 1e-10 };
        fit(start, points, None, &options).unwrap().shape
    }

    fn deviation_of_radius(shape: &Shape, points: &[Vec3], sigma: f64) -> f64 {
        let json = Uncertainty::of(shape, points, 1.0, sigma).unwrap().to_json();
        json["radius"].as_f64().unwrap()
    }

    #[test]
    fn the_radius_of_an_arc_is_known_as_theory_says() {
        // sd(R) = k sigma / sqrt(N); k of a circle's arc, the axis' direction being known as well.
        for (degrees, k) in [(360.0, 1.0), (180.0, 2.3), (90.0, 10.0), (60.0, 24.0), (30.0, 97.0)] {
            let (n, sigma) = (4000, 0.01);
            let mut noise = Noise(SplitMix64::new(7));
            let points = arc(10.0, f64::to_radians(degrees), n, sigma, &mut noise);
            let truth =
                Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [10.0, 0.0, 0.0]);
            let ratio = deviation_of_radius(&truth, &points, sigma) / (sigma / (n as f64).sqrt());
            assert!((ratio / k - 1.0).abs() < 0.06, "{degrees}: {ratio} for {k}");
        }
    }

    #[test]
    fn repeated_fits_scatter_as_the_deviation_says() {
        for degrees in [360.0, 90.0, 60.0_f64] {
            let (sigma, rounds) = (0.01, 300);
            let mut noise = Noise(SplitMix64::new(11));
            let truth =
                Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [10.0, 0.0, 0.0]);
            let (mut sum, mut squares, mut told) = (0.0, 0.0, 0.0);
            for _ in 0..rounds {
                let points = arc(10.0, degrees.to_radians(), 400, sigma, &mut noise);
                let found = fitted(&truth, &points);
                let error = found.size[0] - 10.0;
                sum += error;
                squares += error * error;
                told += deviation_of_radius(&found, &points, sigma) / f64::from(rounds);
            }
            let mean = sum / f64::from(rounds);
            let spread = (squares / f64::from(rounds) - mean * mean).sqrt();
            assert!((spread / told - 1.0).abs() < 0.15, "{degrees}: {spread} for {told}");
            assert!(mean.abs() < 4.0 * told / f64::from(rounds).sqrt(), "{degrees}: bias {mean}");
        }
    }

    /// Every component of the engineering parameters.
    fn components(shape: &Shape) -> Vec<f64> {
        fn flatten(value: &Value, into: &mut Vec<f64>) {
            match value {
                Value::Array(items) => items.iter().for_each(|v| flatten(v, into)),
                other => into.extend(other.as_f64()),
            }
        }
        let surface = serde_json::to_value(shape.surface().unwrap()).unwrap();
        let mut out = Vec::new();
        for (name, _) in names(shape.family).unwrap() {
            flatten(&surface[name], &mut out);
        }
        out
    }

    fn shapes() -> Vec<Shape> {
        let (o, w) = (Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.2, 0.3, 1.0));
        [
            (Family::Plane, [0.0; 3]),
            (Family::Sphere, [5.0, 0.0, 0.0]),
            (Family::Cylinder, [4.0, 0.0, 0.0]),
            (Family::Cone, [4.0, 0.4, 0.0]),
            (Family::Cone, [4.0, -0.4, 0.0]),
            (Family::EllipticCylinder, [6.0, 4.0, 0.0]),
            (Family::EllipticCylinder, [4.0, 6.0, 0.0]),
            (Family::Ellipsoid, [6.0, 5.0, 4.0]),
            (Family::Ellipsoid, [6.0, 4.0, 5.0]),
            (Family::Ellipsoid, [4.0, 6.0, 5.0]),
        ]
        .map(|(f, s)| Shape::with_axis(f, o, w, s))
        .to_vec()
    }

    #[test]
    fn motions_are_the_derivatives_of_the_engineering_parameters() {
        for shape in shapes() {
            for (k, motion) in motions(&shape).iter().enumerate() {
                let at = |h: f64| {
                    let mut delta = vec![0.0; shape.family.dof()];
                    delta[k] = h;
                    components(&shape.stepped(&delta).unwrap())
                };
                let (after, before) = (at(1e-6), at(-1e-6));
                for (i, slope) in motion.parameters(&shape).iter().enumerate() {
                    let numeric = (after[i] - before[i]) / 2e-6;
                    assert!((numeric - slope).abs() < 1e-4, "{shape:?} {k} {i}: {numeric} {slope}");
                }
            }
        }
    }

    #[test]
    fn every_parameter_has_its_deviation_and_rows_in_the_covariance() {
        let mut noise = Noise(SplitMix64::new(3));
        for shape in shapes() {
            let mut d = || noise.uniform(-4.0, 4.0);
            let points: Vec<Vec3> = (0..500)
                .map(|_| shape.origin + Vec3::new(d(), d(), d()))
                .map(|p| p - shape.offset(&p).normal * shape.offset(&p).distance)
                .collect();
            let json = Uncertainty::of(&shape, &points, 1.0, 0.01).unwrap().to_json();
            let rows = json["covariance"].as_array().unwrap();
            assert_eq!(rows.len(), components(&shape).len());
            assert!(rows.iter().all(|r| r.as_array().unwrap().len() == rows.len()));
            assert_eq!(json["identifiable"], true, "{json}");
            let surface = serde_json::to_value(shape.surface().unwrap()).unwrap();
            for name in surface.as_object().unwrap().keys() {
                let deviation = &json[name.as_str()];
                let numbers = deviation.as_array().cloned().unwrap_or(vec![deviation.clone()]);
                assert!(numbers.iter().all(|n| n.as_f64().unwrap() < 0.1), "{name}: {deviation}");
            }
        }
    }

    #[test]
    fn a_radius_that_a_short_arc_cannot_tell_is_said_to_be_unknown() {
        let mut noise = Noise(SplitMix64::new(5));
        let points = arc(10.0, 10_f64.to_radians(), 300, 0.08, &mut noise);
        let truth = Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [10.0, 0.0, 0.0]);
        let json = Uncertainty::of(&truth, &points, 1.0, 0.08).unwrap().to_json();
        assert_eq!(json["identifiable"], false);
        assert_eq!(json["not_identifiable"], json!(["radius"]));
        assert!(json["radius"].as_f64().unwrap() > 2.0);
    }

    #[test]
    fn what_the_points_do_not_determine_has_a_large_and_finite_deviation() {
        let shape = Shape::with_axis(Family::Sphere, Vec3::zeros(), Vec3::z(), [5.0, 0.0, 0.0]);
        let points = vec![Vec3::new(5.0, 0.0, 0.0); 100];
        let deviation = deviation_of_radius(&shape, &points, 0.01);
        assert!(deviation.is_finite() && deviation > 100.0, "{deviation}");
        assert!(Uncertainty::of(&shape, &points[..4], 1.0, 0.01).is_none());
    }
}
