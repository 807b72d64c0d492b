//! How parameters move with the steps of a fit.

use nalgebra::DVector;

use crate::fit::{Family, Shape};
use crate::geometry::Vec3;

/// Places of the semi-axes, the larger first: the order of a surface's fields.
pub fn falling(shape: &Shape) -> Vec<usize> {
    let count = if shape.family == Family::Ellipsoid { 3 } else { 2 };
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| shape.size[b].total_cmp(&shape.size[a]));
    order
}

/// Whether reordering a right-handed frame so makes it left-handed; the last direction is turned then.
pub fn is_odd(order: &[usize]) -> bool {
    let out_of_order = |k: usize| order[k..].iter().filter(|&&i| i < order[k]).count();
    (0..order.len()).map(out_of_order).sum::<usize>() % 2 == 1
}

/// How a shape changes with one of its degrees of freedom.
#[derive(Clone, Copy, Default)]
pub struct Motion {
    pub origin: Vec3,
    pub directions: [Vec3; 3],
    pub size: [f64; 3],
}

/// The motions of a shape, one for each degree of freedom, in the order of
/// [`Shape::distance_jacobian`].
pub fn motions(shape: &Shape) -> Vec<Motion> {
    let (shifts, turns): (&[usize], &[usize]) = match shape.family {
        Family::Plane => (&[2], &[0, 1]),
        Family::Sphere => (&[0, 1, 2], &[]),
        Family::Cylinder | Family::Cone => (&[0, 1], &[0, 1]),
        Family::EllipticCylinder => (&[0, 1], &[0, 1, 2]),
        Family::Torus => (&[0, 1, 2], &[0, 1]),
        Family::Ellipsoid => (&[0, 1, 2], &[0, 1, 2]),
    };
    let d = [0, 1, 2].map(|i| shape.frame.column(i).into_owned());
    let shift = |&k: &usize| Motion { origin: d[k], ..Motion::default() };
    let turn = |&k: &usize| Motion { directions: d.map(|x| d[k].cross(&x)), ..Motion::default() };
    let grow = |k: usize| {
        let mut motion = Motion::default();
        // The elliptic families are fitted in the logs of their semi-axes.
        let elliptic = matches!(shape.family, Family::EllipticCylinder | Family::Ellipsoid);
        motion.size[k] = if elliptic { shape.size[k] } else { 1.0 };
        motion
    };
    let rest = shape.family.dof() - shifts.len() - turns.len();
    shifts.iter().map(shift).chain(turns.iter().map(turn)).chain((0..rest).map(grow)).collect()
}

impl Motion {
    /// The change of every component of the engineering parameters.
    pub fn parameters(&self, shape: &Shape) -> DVector<f64> {
        let mut out = Vec::new();
        let mut vector = |v: &Vec3| out.extend(v.iter());
        match shape.family {
            Family::Plane | Family::Cylinder | Family::EllipticCylinder | Family::Torus => {
                vector(&self.origin);
                vector(&self.directions[2]);
            }
            Family::Sphere | Family::Ellipsoid => vector(&self.origin),
            Family::Cone => {
                vector(&self.apex(shape));
                vector(&(self.directions[2] * shape.size[1].signum()));
            }
        }
        match shape.family {
            Family::Sphere | Family::Cylinder => out.push(self.size[0]),
            Family::Cone => out.push(self.size[1] * shape.size[1].signum()),
            Family::EllipticCylinder | Family::Ellipsoid => {
                let order = falling(shape);
                out.extend(order.iter().map(|&i| self.size[i]));
                let turned = order.len() - 1;
                for (k, &i) in order.iter().enumerate() {
                    let sign = if k == turned && is_odd(&order) { -1.0 } else { 1.0 };
                    out.extend((self.directions[i] * sign).iter());
                }
            }
            Family::Torus => out.extend(&self.size[..2]),
            Family::Plane => {}
        }
        DVector::from_vec(out)
    }

    /// Change of a cone's apex = origin - w size0 / tan size1.
    pub fn apex(&self, shape: &Shape) -> Vec3 {
        let [radius, angle, _] = shape.size;
        let (sin, tan) = (angle.sin(), angle.tan());
        self.origin - self.directions[2] * (radius / tan) - shape.w() * (self.size[0] / tan)
            + shape.w() * (self.size[1] * radius / (sin * sin))
    }
}
