use crate::fit::{Scatter, direct_fit_through};
use crate::geometry::{Frame, Quadric, Vec3};

/// A surface fitted to points by the seed's direct fit, with what its next fit needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectSurface {
    /// World coefficients, a10 = 1 where that scale exists (else unit length).
    pub quadric: Quadric,
    /// The region's first two points, which choose the section plane (9, 10).
    pub first_two: [Vec3; 2],
    /// The frame the fit was made in: centred on the points and about their size.
    pub frame: Frame,
    /// S of the points in that frame.
    pub scatter: Scatter,
}

impl DirectSurface {
    /// The surface of `points`. `None` where they lie in a plane or are fewer than ten.
    pub fn fit(points: impl Iterator<Item = Vec3> + Clone, first_two: [Vec3; 2]) -> Option<Self> {
        let frame = Frame::of(points.clone());
        Self::from_scatter(Scatter::of(points, &frame), frame, first_two)
    }

    /// The surface of the points whose scatter matrix in `frame` is given.
    pub fn from_scatter(scatter: Scatter, frame: Frame, first_two: [Vec3; 2]) -> Option<Self> {
        let local = direct_fit_through(&scatter, &first_two[0], &first_two[1])?;
        let (quadric, _) = frame.world_quadric(&local).scaled();
        Some(Self { quadric, first_two, frame, scatter })
    }

    /// |x.a|, the algebraic residual of a point.
    pub fn residual(&self, x: &Vec3) -> f64 {
        self.quadric.value(x).abs()
    }

    /// Mean square of the algebraic residual over the points it was fitted to.
    pub fn mean_sq_residual(&self) -> f64 {
        let local = self.frame.local_quadric(&self.quadric);
        self.scatter.sq_residual(&local) / self.scatter.count()
    }
}
