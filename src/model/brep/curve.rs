//! The curve in which two surfaces meet, followed step by step with every point exact on both.

use nalgebra::Matrix2;

use super::form::{Form, form};
use super::sheet::Sheet;
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// Turn of the tangent from one point to the next, in radians: with 0.1 a cubic through them leaves a circle by 3e-7 of its
    /// radius.
    TURN: f64 = 0.1, Trial(0.1, 0.1);
    /// Steps of Newton's method.
    NEWTON: usize = 20, Effort("work of the boundary representation");
    /// Points of one curve, at most.
    MOST: usize = 20_000, Effort("work of the boundary representation");
    /// The sine of the angle between two surfaces below which they have no line in common that is worth the name.
    pub LEAST_SINE: f64 = 0.02, Trial(0.02, 0.02);
}

/// A curve on two surfaces.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The surfaces.
    pub sheets: [Sheet; 2],
    /// Points in order, exact on both.
    pub points: Vec<Vec3>,
    /// Length of the polygon up to each point; a closed one has one number more.
    pub lengths: Vec<f64>,
    /// Whether the last point is followed by the first.
    pub closed: bool,
    /// What kind of curve it is.
    pub form: Form,
}

/// The place on both surfaces nearest to `x`; none where they do not meet there.
pub fn meet(f: &Sheet, g: &Sheet, x: &Vec3) -> Option<Vec3> {
    let mut x = *x;
    for _ in 0..NEWTON.get() {
        let ((a, n), (b, m)) = (f.offset(&x), g.offset(&x));
        let c = n.dot(&m);
        let inverse = Matrix2::new(1.0, c, c, 1.0).try_inverse()?;
        let s = inverse * nalgebra::Vector2::new(a, b);
        let step = n * s.x + m * s.y;
        x -= step;
        if step.norm() <= 1e-15 * x.norm().max(1.0) {
            break;
        }
    }
    let size = x.norm().max(1.0);
    (f.value(&x).abs().max(g.value(&x).abs()) < 1e-11 * size).then_some(x)
}

/// The place on all three surfaces nearest to `x`; none where they do not meet there.
pub fn meet_three(sheets: [&Sheet; 3], x: &Vec3) -> Option<Vec3> {
    let mut x = *x;
    for _ in 0..NEWTON.get() {
        let o = sheets.map(|s| s.offset(&x));
        let rows = nalgebra::Matrix3::from_rows(&[
            o[0].1.transpose(),
            o[1].1.transpose(),
            o[2].1.transpose(),
        ]);
        let step = rows.try_inverse()? * Vec3::new(o[0].0, o[1].0, o[2].0);
        x -= step;
        if step.norm() <= 1e-15 * x.norm().max(1.0) {
            break;
        }
    }
    let size = x.norm().max(1.0);
    sheets.iter().all(|s| s.value(&x).abs() < 1e-11 * size).then_some(x)
}

/// Unit tangent; none where the surfaces touch.
fn tangent(f: &Sheet, g: &Sheet, x: &Vec3) -> Option<Vec3> {
    let t = f.normal(x).cross(&g.normal(x));
    let sine = t.norm();
    (sine > LEAST_SINE.get()).then(|| t / sine)
}

impl Curve {
    /// The curve through `start`, a place on both surfaces, as far as `goes_on` says, by steps of at most `most`.
    pub fn through(
        f: &Sheet,
        g: &Sheet,
        start: Vec3,
        most: f64,
        goes_on: impl Fn(&Vec3) -> bool,
    ) -> Option<Self> {
        tangent(f, g, &start)?;
        let (forward, closed) = half(f, g, start, 1.0, most, &goes_on);
        let mut points = forward;
        if !closed {
            let (back, _) = half(f, g, start, -1.0, most, &goes_on);
            points = back.into_iter().skip(1).rev().chain(points).collect();
        }
        (points.len() > 1).then(|| Self::of([*f, *g], points, closed))
    }

    /// The curve through points on both surfaces.
    pub fn of(sheets: [Sheet; 2], points: Vec<Vec3>, closed: bool) -> Self {
        let mut lengths = vec![0.0];
        let next = points.iter().skip(1).chain(closed.then(|| &points[0]));
        let mut sum = 0.0;
        for (a, b) in points.iter().zip(next) {
            sum += (b - a).norm();
            lengths.push(sum);
        }
        let form = form(&sheets[0], &sheets[1], &points);
        Self { sheets, points, lengths, closed, form }
    }

    /// The closed circle or the like about the axis of `f` that `g` cuts out, by steps that turn by no more than [`TURN.get()`].
    pub fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// The place at that length along the polygon, exact on both surfaces.
    pub fn at(&self, t: f64) -> Vec3 {
        let total = self.length();
        let t = if self.closed { t.rem_euclid(total) } else { t.clamp(0.0, total) };
        let k = self.lengths.partition_point(|l| *l <= t).clamp(1, self.lengths.len() - 1) - 1;
        let (a, b) = (self.points[k], self.points[(k + 1) % self.points.len()]);
        let span = self.lengths[k + 1] - self.lengths[k];
        let x = a + (b - a) * if span > 0.0 { (t - self.lengths[k]) / span } else { 0.0 };
        meet(&self.sheets[0], &self.sheets[1], &x).unwrap_or(x)
    }

    /// Unit tangent at a place of the curve, in the direction of its points.
    pub fn tangent(&self, t: f64) -> Vec3 {
        let h = 1e-3 * self.length() / self.points.len() as f64;
        let along = self.at(t + h) - self.at(t - h);
        let x = self.at(t);
        match tangent(&self.sheets[0], &self.sheets[1], &x) {
            Some(d) => d * d.dot(&along).signum(),
            None => along.normalize(),
        }
    }

    /// Length along the polygon of the place nearest to `x`, and how far that is.
    pub fn locate(&self, x: &Vec3) -> (f64, f64) {
        let mut best = (0.0, f64::INFINITY);
        for k in 0..self.lengths.len() - 1 {
            let (a, b) = (self.points[k], self.points[(k + 1) % self.points.len()]);
            let d = b - a;
            let sq = d.norm_squared();
            let s = if sq > 0.0 { ((x - a).dot(&d) / sq).clamp(0.0, 1.0) } else { 0.0 };
            let off = (a + d * s - x).norm();
            if off < best.1 {
                best = (self.lengths[k] + s * (self.lengths[k + 1] - self.lengths[k]), off);
            }
        }
        best
    }

    /// The points from length `from` to `to` (which may go beyond the end of a closed curve), both included.
    pub fn between(&self, from: f64, to: f64) -> Vec<Vec3> {
        let total = self.length();
        let mut out = vec![self.at(from)];
        let n = self.points.len();
        let near = 1e-3 * total / n as f64;
        let rounds = if self.closed { 2 } else { 1 };
        for k in 0..n * rounds {
            let l = self.lengths[k % n] + (k / n) as f64 * total;
            if l > from + near && l < to - near {
                out.push(self.points[k % n]);
            }
        }
        out.push(self.at(to));
        out
    }
}

/// The points from `start` on in one direction, and whether they come back to it.
fn half(
    f: &Sheet,
    g: &Sheet,
    start: Vec3,
    sign: f64,
    most: f64,
    goes_on: &impl Fn(&Vec3) -> bool,
) -> (Vec<Vec3>, bool) {
    let mut points = vec![start];
    let Some(first) = tangent(f, g, &start).map(|t| t * sign) else { return (points, false) };
    let (mut x, mut d, mut h, mut side) = (start, first, most, sign);
    while points.len() < MOST.get() {
        let Some((y, e, turned)) = step(f, g, &x, &d, h, side) else {
            h /= 2.0;
            if h < 1e-4 * most {
                break;
            }
            continue;
        };
        if turned > TURN.get() && h > 1e-3 * most {
            h = (h * (TURN.get() / turned).max(0.3)).max(1e-3 * most) * 0.99;
            continue;
        }
        let on = (start - x).dot(&d);
        if points.len() > 3
            && on > 0.0
            && on <= 1.2 * h
            && (start - x).norm() <= 1.3 * h
            && e.dot(&first) > 0.5
        {
            if on < 0.2 * h && points.len() > 4 {
                points.pop();
            }
            return (points, true);
        }
        if !goes_on(&y) {
            break;
        }
        points.push(y);
        side = f.normal(&y).cross(&g.normal(&y)).dot(&e).signum();
        (x, d) = (y, e);
        h = (h * (0.8 * TURN.get() / turned.max(1e-9)).clamp(0.5, 1.5)).min(most);
    }
    (points, false)
}

/// The next point, the direction there, and how far it has turned.
fn step(f: &Sheet, g: &Sheet, x: &Vec3, d: &Vec3, h: f64, side: f64) -> Option<(Vec3, Vec3, f64)> {
    let y = meet(f, g, &(x + d * h))?;
    let e = tangent(f, g, &y)? * side;
    let turned = e.cross(d).norm().atan2(e.dot(d));
    (turned < 1.0 && (y - x).dot(d) > 0.2 * h).then_some((y, e, turned))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Cylinder, Sphere, Surface};

    fn cylinder(axis_direction: Vec3, radius: f64) -> Sheet {
        Sheet::new(
            &Surface::Cylinder(Cylinder { axis_point: Vec3::zeros(), axis_direction, radius }),
            &Vec3::zeros(),
        )
    }

    #[test]
    fn two_pipes_meet_in_a_closed_curve_on_both() {
        let (a, b) = (cylinder(Vec3::x(), 5.0), cylinder(Vec3::z(), 3.0));
        let start = meet(&a, &b, &Vec3::new(3.0, 0.0, 5.0)).unwrap();
        let curve = Curve::through(&a, &b, start, 1.0, |_| true).unwrap();
        assert!(curve.closed);
        for k in 0..200 {
            let x = curve.at(curve.length() * f64::from(k) / 200.0);
            assert!(a.value(&x).abs() < 1e-11 && b.value(&x).abs() < 1e-11 && x.z > 3.9);
        }
        // The length of (3 cos t, 3 sin t, sqrt(25 - 9 sin2 t)), by many chords.
        let at = |t: f64| {
            Vec3::new(3.0 * t.cos(), 3.0 * t.sin(), (25.0 - (3.0 * t.sin()).powi(2)).sqrt())
        };
        let n = 20_000;
        let true_length: f64 = (0..n)
            .map(|k| std::f64::consts::TAU / f64::from(n) * f64::from(k))
            .map(|t| (at(t + std::f64::consts::TAU / f64::from(n)) - at(t)).norm())
            .sum();
        assert!((curve.length() / true_length - 1.0).abs() < 1e-3, "{}", curve.length());
    }

    #[test]
    fn a_curve_ends_where_it_is_told_to() {
        let floor = Sheet::plane(Vec3::zeros(), Vec3::z());
        let ball = Sheet::new(
            &Surface::Sphere(Sphere { center: Vec3::zeros(), radius: 2.0 }),
            &Vec3::zeros(),
        );
        let curve =
            Curve::through(&floor, &ball, Vec3::new(2.0, 0.0, 0.0), 0.5, |x| x.x > 0.0).unwrap();
        assert!(!curve.closed && (curve.length() - 2.0 * std::f64::consts::PI).abs() < 0.5);
        let (t, off) = curve.locate(&Vec3::new(2.1, 0.0, 0.0));
        assert!((off - 0.1).abs() < 1e-9 && (curve.at(t) - Vec3::new(2.0, 0.0, 0.0)).norm() < 1e-9);
    }
}
