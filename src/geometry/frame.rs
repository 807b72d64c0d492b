use super::{Quadric, Vec3};

/// A translated and scaled coordinate system: local = (world - origin) / scale.
///
/// Directions are the same in both; sums of powers stay well conditioned in a frame that is centred
/// on its points and about their size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The local origin in world coordinates.
    pub origin: Vec3,
    /// The world length of one local unit, > 0.
    pub scale: f64,
}

impl Frame {
    /// The frame centred on `points` (their mean) with their root mean square distance from it as
    /// unit; unit 1 where all points coincide, origin 0 where there are none.
    pub fn of(points: impl Iterator<Item = Vec3> + Clone) -> Self {
        let count = points.clone().count().max(1) as f64;
        let origin = points.clone().sum::<Vec3>() / count;
        let sq_size = points.map(|p| (p - origin).norm_squared()).sum::<f64>() / count;
        let scale = if sq_size > 0.0 { sq_size.sqrt() } else { 1.0 };
        Self { origin, scale }
    }

    /// Local coordinates of a world point.
    pub fn local_from_world(&self, x: &Vec3) -> Vec3 {
        (x - self.origin) / self.scale
    }

    /// World coordinates of a local point.
    pub fn world_from_local(&self, x: &Vec3) -> Vec3 {
        x * self.scale + self.origin
    }

    /// The function that `quadric` is in world coordinates, written in local ones.
    pub fn local_quadric(&self, quadric: &Quadric) -> Quadric {
        let moved = quadric.moved_to(&self.origin);
        let s = self.scale;
        Quadric::from_parts(&(moved.e() * (s * s)), &(moved.linear() * s), moved.0[9])
    }

    /// The function that `quadric` is in local coordinates, written in world ones.
    pub fn world_quadric(&self, quadric: &Quadric) -> Quadric {
        let s = self.scale;
        Quadric::from_parts(&(quadric.e() / (s * s)), &(quadric.linear() / s), quadric.0[9])
            .moved_to(&-self.origin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadric_has_the_same_values_in_both_frames() {
        let frame = Frame { origin: Vec3::new(10.0, -20.0, 5.0), scale: 3.0 };
        let world = Quadric([1.0, 2.0, 3.0, 0.4, -0.5, 0.6, 7.0, -8.0, 9.0, 10.0]);
        let local = frame.local_quadric(&world);
        let x = Vec3::new(0.3, -1.2, 2.5);
        assert!((local.value(&frame.local_from_world(&x)) - world.value(&x)).abs() < 1e-9);
        let back = frame.world_quadric(&local);
        assert!(back.0.iter().zip(world.0).all(|(a, b)| (a - b).abs() < 1e-9));
        assert!((frame.world_from_local(&frame.local_from_world(&x)) - x).norm() < 1e-12);
    }

    #[test]
    fn the_frame_of_coinciding_points_has_unit_one() {
        let p = Vec3::new(4.0, 5.0, 6.0);
        assert_eq!(Frame::of([p; 3].into_iter()), Frame { origin: p, scale: 1.0 });
    }
}
