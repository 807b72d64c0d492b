//! Fits of surfaces of which a radius or a direction is known.

use super::columns::Columns;
use super::constant::constants;
use super::least_squares::{FIRST_DAMPING, Fitted, LEAST_DAMPING, MOST_DAMPING};
use super::linearised::{cost, linearise};
use super::loss::Loss;
use super::normal::Normal;
use super::retraction::Moments;
use super::shape::{Family, MAX_DOF, Shape};
use crate::geometry::{Mat3, Vec3, perpendicular_frame};

constants! {
    /// Steps of a fit, those that are refused among them.
    STEPS: usize = 60, Effort("steps of one fit");
    /// Share of its cost below which a step of that is none.
    NO_STEP: f64 = 1e-10, Effort("steps of one fit");
}

/// What of a surface is known beforehand and stays as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Radius of a sphere or cylinder.
    pub radius: Option<f64>,
    /// Direction of an axis or normal, a unit vector.
    pub direction: Option<Vec3>,
}

impl Held {
    /// Whether nothing is.
    pub fn is_nothing(&self) -> bool {
        self.radius.is_none() && self.direction.is_none()
    }

    /// Which of a family's degrees of freedom stay, in the order of [`Shape::distance_jacobian`]. What a family has not
    /// does not matter to it.
    pub fn freedoms(&self, family: Family) -> [bool; MAX_DOF] {
        let mut held = [false; MAX_DOF];
        if self.direction.is_some() {
            let turns: &[usize] = match family {
                Family::Plane => &[1, 2],
                Family::Cylinder | Family::Cone | Family::EllipticCylinder => &[2, 3],
                Family::Torus => &[3, 4],
                Family::Sphere | Family::Ellipsoid => &[],
            };
            turns.iter().for_each(|&k| held[k] = true);
        }
        if self.radius.is_some() {
            match family {
                Family::Sphere => held[3] = true,
                Family::Cylinder => held[4] = true,
                _ => {}
            }
        }
        held
    }

    /// The shape with what is known in place.
    pub fn put_in(&self, shape: &Shape) -> Shape {
        let mut s = *shape;
        let axial = !matches!(s.family, Family::Sphere | Family::Ellipsoid);
        if let Some(direction) = self.direction.filter(|_| axial) {
            let w = if direction.dot(&s.w()) < 0.0 { -direction } else { direction };
            // the other two axes turn no more than they must
            let u = s.frame.column(0).into_owned();
            let across = u - u.dot(&w) * w;
            let u = across.try_normalize(1e-6).unwrap_or_else(|| perpendicular_frame(&w).0);
            s.frame = Mat3::from_columns(&[u, w.cross(&u), w]);
        }
        if let (Some(radius), Family::Sphere | Family::Cylinder) = (self.radius, s.family) {
            s.size[0] = radius;
        }
        s
    }
}

/// Fits `start`'s family to `points` by orthogonal distances, what is `held` apart: plain least squares by Levenberg and
/// Marquardt. `None` for fewer points than degrees of freedom or a start that is not proper.
pub fn fit_held(start: &Shape, points: &[Vec3], held: &Held) -> Option<Fitted> {
    if points.len() <= start.family.dof() || !start.is_proper() {
        return None;
    }
    let columns = Columns::of(points, None);
    let origin = columns.origin();
    let mask = held.freedoms(start.family);
    let placed = |s: &Shape| held.put_in(&s.recentred(&Vec3::zeros()));
    let linear = |s: &Shape| {
        let mut there = linearise(s, &columns, Loss::Squares);
        there.normal.hold(&mask);
        there
    };
    let moments = Moments(columns.products());
    let mut shape = placed(&start.translated(&-origin));
    let mut here = linear(&shape);
    let mut damping = LEAST_DAMPING;
    for _ in 0..STEPS.get() {
        let next = here.normal.damped_step(&shape, damping, &moments).map(|s| placed(&s));
        match next.map(|s| (s, cost(&s, &columns, Loss::Squares))) {
            Some((next, there)) if there <= here.cost => {
                let gain = (here.cost - there) / here.cost.max(1e-300);
                shape = next;
                if gain < NO_STEP.get() {
                    break;
                }
                here = linear(&shape);
                damping = (damping * 0.1).max(LEAST_DAMPING);
            }
            _ => {
                damping = (damping * 8.0).max(FIRST_DAMPING);
                if damping > MOST_DAMPING {
                    break;
                }
            }
        }
    }
    let mean_sq = cost(&shape, &columns, Loss::Squares) / columns.total();
    mean_sq.is_finite().then(|| Fitted { shape: shape.translated(&origin), mean_sq })
}

impl Normal {
    /// Takes degrees of freedom out: no step moves them.
    fn hold(&mut self, held: &[bool; MAX_DOF]) {
        let top = (0..MAX_DOF).map(|a| self.jj[a][a]).fold(0.0, f64::max).max(1e-300);
        for a in (0..MAX_DOF).filter(|a| held[*a]) {
            (0..a).for_each(|b| self.jj[a][b] = 0.0);
            (a + 1..MAX_DOF).for_each(|b| self.jj[b][a] = 0.0);
            (self.jj[a][a], self.jr[a]) = (top, 0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::fits::{Random, shapes};
    use super::super::least_squares::{Options, fit};
    use super::*;

    /// Points of an arc of `angle` of a tube of radius 10 about z, 20 long.
    fn arc(n: usize, angle: f64, sigma: f64, random: &mut Random) -> Vec<Vec3> {
        let mut point = || {
            let (t, r) = (random.uniform(-0.5, 0.5) * angle, 10.0 + sigma * random.normal());
            Vec3::new(r * t.cos(), r * t.sin(), random.uniform(-10.0, 10.0))
        };
        (0..n).map(|_| point()).collect()
    }

    #[test]
    fn a_known_radius_tells_the_axis_of_a_short_arc() {
        let random = &mut Random::new(3);
        let (mut free, mut held) = (0.0, 0.0);
        for _ in 0..20 {
            let points = arc(400, 0.4, 0.02, random);
            let truth =
                Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [10.0, 0.0, 0.0]);
            let start =
                Shape { size: [11.0, 0.0, 0.0], origin: Vec3::new(-1.0, 0.0, 0.0), ..truth };
            let options = Options { cauchy: None, steps: 60, tolerance: 1e-9 };
            free += fit(&start, &points, None, &options).unwrap().shape.origin.x.powi(2);
            let known = Held { radius: Some(10.0), direction: Some(-Vec3::z()) };
            let fitted = fit_held(&start, &points, &known).unwrap().shape;
            assert_eq!((fitted.size[0], fitted.w()), (10.0, Vec3::z()));
            held += fitted.origin.x.powi(2);
        }
        // sigma / sqrt(n) is 0.001; the free radius of such an arc is off by 60 times that
        assert!((held / 20.0).sqrt() < 0.002, "{held}");
        assert!(held < 1e-3 * free, "{held} {free}");
    }

    #[test]
    fn what_is_known_stays_to_the_digit_in_every_family_and_nothing_known_is_the_plain_fit() {
        let random = &mut Random::new(5);
        for s in shapes() {
            let mut at = || Vec3::new(random.normal(), random.normal(), random.normal());
            let points: Vec<Vec3> = (0..300)
                .map(|_| {
                    let p = s.origin + 8.0 * at();
                    let o = s.offset(&p);
                    p - (o.distance + 0.01 * at().x) * o.normal
                })
                .collect();
            let direction = (s.w() + 0.02 * at()).normalize();
            let held = Held { radius: Some(s.size[0] * 1.01), direction: Some(direction) };
            let f = fit_held(&s, &points, &held).unwrap().shape;
            let axial = !matches!(s.family, Family::Sphere | Family::Ellipsoid);
            assert!(!axial || (f.w() - direction).norm() < 1e-15, "{:?}", s.family);
            if matches!(s.family, Family::Sphere | Family::Cylinder) {
                assert_eq!(Some(f.size[0]), held.radius);
            }
            let options = Options { cauchy: None, steps: 60, tolerance: 1e-12 };
            let plain = fit(&s, &points, None, &options).unwrap();
            let nothing = fit_held(&s, &points, &Held::default()).unwrap();
            assert!(nothing.mean_sq <= plain.mean_sq * (1.0 + 1e-6), "{:?}", s.family);
        }
    }
}
