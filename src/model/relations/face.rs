//! A region as relations see it: its surface and how exactly it is known, in a frame of the scene's size.

use nalgebra::{DMatrix, DVector, Matrix2, Matrix3x2, Vector2};
use serde::Deserialize;

use super::frame::Frame;
use crate::fit::constant::constants;
use crate::fit::{Family, Shape};
use crate::geometry::{Surface, Vec3};
use crate::segment::{Region, Uncertainty};

/// A region's surface.
#[derive(Clone, Debug)]
pub struct Face {
    /// The region's id.
    pub region: usize,
    /// The surface in the scene's frame, its origin beside the points' middle.
    pub shape: Shape,
    /// Covariance of its degrees of freedom, in the order of [`Shape::distance_jacobian`].
    pub covariance: DMatrix<f64>,
    /// Whether its points go round the axis, as those of a hole or a boss do; a fillet's or a slot's end go half round at
    /// most.
    pub is_round: bool,
    /// Where a plane's points are.
    pub patch: Option<Patch>,
    /// Half of the diagonal of its points' box, in the scene's frame: how far they reach from its origin.
    pub reach: f64,
}

/// Area and middle of a plane's outline, in the scene's frame.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// The area within it.
    pub area: f64,
    /// The middle of that.
    pub middle: Vec3,
}

impl Patch {
    fn of(region: &Region, frame: &Frame) -> Option<Self> {
        let Some(Surface::Plane(plane)) = region.surface else { return None };
        let loops = region.dimensions.outline.as_ref()?;
        let (mut area, mut moment) = (0.0, Vec3::zeros());
        for corners in loops {
            let corner = |k: usize| Vec3::from(corners[k % corners.len()]) - plane.point;
            for k in 0..corners.len() {
                let (p, q) = (corner(k), corner(k + 1));
                // twice the triangle with the plane's point; holes are negative
                let part = plane.normal.dot(&p.cross(&q));
                area += part;
                moment += (p + q) * part;
            }
        }
        let middle = plane.point + moment / (3.0 * area);
        (area > 0.0).then_some(Self {
            area: area / 2.0 / frame.unit.powi(2),
            middle: (middle - frame.origin) / frame.unit,
        })
    }
}

constants! {
    /// A direction that is known no better than this, in radians, says nothing.
    COARSE: f64 = 0.022, Derived("three standard deviations s turn a surface so far that a tenth of one is lost by taking the turn for linear: (3 s)^2 / 2 = s / 10");
    /// The smallest angle, in radians, that goes round.
    ROUND: f64 = 1.5 * std::f64::consts::PI, Derived("midway between a half turn and a whole one");
    /// A cone's origin is at least this share of the scene from its apex.
    OFF_APEX: f64 = 1e-3, Derived("a radius at the apex says nothing; this is below what is seen of a cone");
}

impl Face {
    /// That of a region; `None` where it has no surface or its uncertainty is not known.
    pub fn of(region: &Region, frame: &Frame) -> Option<Self> {
        let surface = region.surface.as_ref()?;
        let told = Uncertainty::deserialize(region.uncertainty.as_ref()?).ok()?;
        let n = told.covariance.len();
        let square = told.covariance.iter().all(|row| row.len() == n);
        let mut shape = Shape::from(surface);
        if let (Surface::Cone(cone), Some(extent)) = (surface, &region.extent) {
            let middle = (Vec3::from(extent.min) + Vec3::from(extent.max)) / 2.0;
            // points lie on the side of the apex that the axis points to
            let height = (middle - cone.apex).dot(&cone.axis_direction);
            let away = height.max(OFF_APEX.get() * frame.unit);
            shape = shape.recentred(&(cone.apex + away * cone.axis_direction));
        }
        let shape = frame.local(&shape);
        let change = freedoms(&shape);
        if !square || change.ncols() != n {
            return None;
        }
        let lengths = lengths(shape.family);
        let scale = |k: usize| if lengths[k] { 1.0 / frame.unit } else { 1.0 };
        let scaled = |i: usize, j: usize| told.covariance[i][j] * scale(i) * scale(j);
        let covariance = &change * DMatrix::from_fn(n, n, scaled) * change.transpose();
        covariance.iter().all(|v| v.is_finite()).then_some(Self {
            region: region.id,
            shape,
            covariance,
            reach: region
                .extent
                .map_or(0.0, |e| (Vec3::from(e.max) - Vec3::from(e.min)).norm() / 2.0 / frame.unit),
            patch: Patch::of(region, frame),
            is_round: region.dimensions.swept_angle.is_some_and(|angle| angle > ROUND.get()),
        })
    }

    /// The same known to no better than if its points had been made no better than to `scatter` in the scene's frame: its
    /// position and sizes to that, its direction and angles to that over its reach.
    pub fn scattered(&self, scatter: f64) -> Self {
        let mut covariance = self.covariance.clone();
        let angle = scatter / self.reach.max(scatter);
        let sizes = covariance.nrows() - sizes_of(self.shape.family);
        for k in 0..covariance.nrows() {
            let share = match self.shape.family {
                Family::EllipticCylinder | Family::Ellipsoid if k >= sizes => {
                    scatter / self.shape.size[k - sizes]
                }
                Family::Cone if k > sizes => angle,
                _ if k < self.position().end || k >= sizes => scatter,
                _ => angle,
            };
            covariance[(k, k)] += share * share;
        }
        Self { covariance, ..self.clone() }
    }

    /// Whether it has a direction, a plane's normal or an axis, that is known.
    pub fn is_directed(&self) -> bool {
        !matches!(self.shape.family, Family::Sphere | Family::Ellipsoid)
            && self.direction_covariance().trace() < COARSE.get().powi(2)
    }

    /// Whether it is a surface about an axis that is known.
    pub fn has_axis(&self) -> bool {
        self.is_directed() && self.shape.family != Family::Plane
    }

    /// Whether it has a centre: sphere, ellipsoid, torus.
    pub fn has_center(&self) -> bool {
        matches!(self.shape.family, Family::Sphere | Family::Ellipsoid | Family::Torus)
    }

    /// Places of the degrees of freedom of the position; along the normal, the two directions across the axis, or all.
    pub fn position(&self) -> std::ops::Range<usize> {
        match self.shape.family {
            Family::Plane => 0..1,
            Family::Cylinder | Family::Cone | Family::EllipticCylinder => 0..2,
            Family::Sphere | Family::Torus | Family::Ellipsoid => 0..3,
        }
    }

    /// The first of the two rotations of the direction, about the frame's first and second column.
    pub fn turn(&self) -> usize {
        self.position().end
    }

    /// Covariance of the direction's components along the frame's first and second column.
    pub fn direction_covariance(&self) -> Matrix2<f64> {
        let (t, c) = (self.turn(), &self.covariance);
        // turning about u moves w along -v, turning about v moves it along u
        Matrix2::new(c[(t + 1, t + 1)], -c[(t + 1, t)], -c[(t, t + 1)], c[(t, t)])
    }

    /// The frame's first two columns.
    pub fn across(&self) -> Matrix3x2<f64> {
        self.shape.frame.fixed_columns::<2>(0).into_owned()
    }

    /// The most likely position, and its covariance, of a surface whose direction is `w`, known to `covariance` across
    /// it (in the basis `across`): in degrees of freedom of [`Face::position`].
    pub fn placed(
        &self,
        w: &Vec3,
        across: &Matrix3x2<f64>,
        covariance: &Matrix2<f64>,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let (p, t) = (self.position().end, self.turn());
        let own = self.across();
        let sign = if w.dot(&self.shape.w()) < 0.0 { -1.0 } else { 1.0 };
        let tilt = own.transpose() * w * sign;
        let turned = Vector2::new(-tilt.y, tilt.x);
        let turns = self.covariance.view((t, t), (2, 2)).into_owned();
        let both = self.covariance.view((0, t), (p, 2)).into_owned();
        let gain = both * turns.try_inverse()?;
        let here =
            self.covariance.view((0, 0), (p, p)) - &gain * self.covariance.view((t, 0), (2, p));
        let basis = own.transpose() * across * sign;
        let known = basis * covariance * basis.transpose();
        let known = Matrix2::new(known.m22, -known.m21, -known.m12, known.m11);
        Some((&gain * turned, here + &gain * known * gain.transpose()))
    }
}

/// How many sizes a family has among its degrees of freedom.
pub fn sizes_of(family: Family) -> usize {
    match family {
        Family::Plane => 0,
        Family::Sphere | Family::Cylinder => 1,
        Family::Cone | Family::EllipticCylinder | Family::Torus => 2,
        Family::Ellipsoid => 3,
    }
}

/// Which of the components that `covariance_of` names are lengths.
fn lengths(family: Family) -> Vec<bool> {
    let runs: &[(usize, bool)] = match family {
        Family::Plane => &[(3, true), (3, false)],
        Family::Sphere => &[(4, true)],
        Family::Cylinder => &[(3, true), (3, false), (1, true)],
        Family::Cone => &[(3, true), (4, false)],
        Family::EllipticCylinder => &[(3, true), (3, false), (2, true), (6, false)],
        Family::Ellipsoid => &[(6, true), (9, false)],
        Family::Torus => &[(3, true), (3, false), (2, true)],
    };
    runs.iter().flat_map(|&(n, is_length)| std::iter::repeat_n(is_length, n)).collect()
}

/// The degrees of freedom by the components of the parameters: what takes the covariance of the one to that of the other.
fn freedoms(shape: &Shape) -> DMatrix<f64> {
    let [u, v, w]: [Vec3; 3] = [0, 1, 2].map(|k| shape.frame.column(k).into_owned());
    let size = shape.size;
    let at = |place: usize, slopes: &[f64]| vec![(place, slopes.to_vec())];
    let shift = |d: &Vec3| at(0, d.as_slice());
    // turning by t moves a direction d by t x d
    let turn = |place: usize| [at(place, (-v).as_slice()), at(place, u.as_slice())];
    let mut rows = match shape.family {
        Family::Plane => vec![shift(&w)],
        Family::Sphere | Family::Torus | Family::Ellipsoid => vec![shift(&u), shift(&v), shift(&w)],
        Family::Cylinder | Family::EllipticCylinder => vec![shift(&u), shift(&v)],
        Family::Cone => {
            // the origin lies that far from the apex
            let height = size[0] / size[1].tan();
            let along = |d: &Vec3| [shift(d), at(3, (d * height).as_slice())].concat();
            vec![along(&u), along(&v)]
        }
    };
    match shape.family {
        Family::Sphere => rows.push(at(3, &[1.0])),
        Family::Ellipsoid => {
            let turns = [at(9, w.as_slice()), at(12, u.as_slice()), at(6, v.as_slice())];
            rows.extend(turns);
            rows.extend([0, 1, 2].map(|k| at(3 + k, &[1.0 / size[k]])));
        }
        _ => rows.extend(turn(3)),
    }
    match shape.family {
        Family::Cylinder => rows.push(at(6, &[1.0])),
        Family::Cone => {
            let (tan, cos) = (size[1].tan(), size[1].cos());
            let by_angle = at(6, &[size[0] / tan / (cos * cos)]);
            rows.push([shift(&(-w * tan)), by_angle].concat());
            rows.push(at(6, &[1.0]));
        }
        Family::EllipticCylinder => {
            rows.push(at(8, v.as_slice()));
            rows.extend([0, 1].map(|k| at(6 + k, &[1.0 / size[k]])));
        }
        Family::Torus => rows.extend([at(6, &[1.0]), at(7, &[1.0])]),
        Family::Plane | Family::Sphere | Family::Ellipsoid => {}
    }
    let mut out = DMatrix::zeros(rows.len(), lengths(shape.family).len());
    for (i, (place, slopes)) in
        rows.iter().enumerate().flat_map(|(i, r)| r.iter().map(move |p| (i, p)))
    {
        slopes.iter().enumerate().for_each(|(j, slope)| out[(i, place + j)] = *slope);
    }
    out
}

#[cfg(test)]
mod tests;
