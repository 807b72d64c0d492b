use crate::fit::constant::constants;
use crate::fit::{Scatter, direct_fit_through, taubin_fit};
use crate::geometry::{Frame, Quadric, Vec3};

constants! {
    /// The direct fit stands while it leaves the points at most this far, mean square, against the best
    /// quadric there is.
    DIRECT_FIT_STANDS: f64 = 1.2, Trial(1.2, 1.2);
}

/// A surface fitted to points, with what its next fit needs.
///
/// The fit is the seed's direct one (3, 6). Held to ellipsoids, it closes a short arc too soon: 60
/// degrees with noise of R/1000 give half the radius, and worse when a few points of a neighbour
/// are among them. Where it misses the points by more than [`DIRECT_FIT_STANDS`], Taubin's fit, which
/// has the same sums to work on, replaces it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedSurface {
    /// World coefficients, a10 = 1 where that scale exists (else unit length).
    pub quadric: Quadric,
    /// The same in `frame`, as the fit gave it: far from the origin world coefficients cancel.
    pub local: Quadric,
    /// The region's first two points, which choose the section plane (9, 10).
    pub first_two: [Vec3; 2],
    /// The frame the fit was made in: centred on the points and about their size.
    pub frame: Frame,
    /// S of the points in that frame.
    pub scatter: Scatter,
}

impl FittedSurface {
    /// The surface of `points`. `None` where they lie in a plane or are fewer than ten.
    pub fn fit(points: impl Iterator<Item = Vec3> + Clone, first_two: [Vec3; 2]) -> Option<Self> {
        let frame = Frame::of(points.clone());
        Self::from_scatter(&Scatter::of(points, &frame), &frame, first_two)
    }

    /// The surface of `points` by Taubin's fit, whatever the direct one says: for points that are
    /// known to belong together.
    pub fn refined(
        points: impl Iterator<Item = Vec3> + Clone,
        first_two: [Vec3; 2],
    ) -> Option<Self> {
        let frame = Frame::of(points.clone());
        let scatter = Scatter::of(points, &frame);
        let local = taubin_fit(&scatter)?;
        let (quadric, _) = frame.world_quadric(&local).scaled();
        Some(Self { quadric, local, first_two, frame, scatter })
    }

    /// The surface of the points with that scatter matrix in the frame `given`.
    pub fn from_scatter(scatter: &Scatter, given: &Frame, first_two: [Vec3; 2]) -> Option<Self> {
        let frame = scatter.own_frame(given);
        let scatter = scatter.moved(given, &frame);
        let local = best_fit(&scatter, first_two)?;
        let (quadric, _) = frame.world_quadric(&local).scaled();
        Some(Self { quadric, local, first_two, frame, scatter })
    }

    /// The surface in another frame.
    pub fn within(&self, frame: &Frame) -> Quadric {
        let origin = frame.local_from_world(&self.frame.origin);
        Frame { origin, scale: self.frame.scale / frame.scale }.world_quadric(&self.local)
    }

    /// The algebraic residual |x.a| of a point within `threshold` of the surface.
    ///
    /// `None` beyond it, and where the residual says nothing of the distance: a quadric that closes on
    /// itself within the threshold, like a pair of near planes, has small residuals all through the
    /// gap. Along the gradient g the residual is F + |g| t + h t2, so that the other sheet stays clear of
    /// the threshold where |g|^2 > 8 |h| threshold.
    pub fn residual_within(&self, x: &Vec3, threshold: f64) -> Option<f64> {
        let residual = self.quadric.value(x).abs();
        if residual > threshold {
            return None;
        }
        let g = self.quadric.gradient(x);
        let h_times_sq_g = (self.quadric.e() * g).dot(&g).abs();
        let sq_g = g.norm_squared();
        (sq_g * sq_g > 8.0 * h_times_sq_g * threshold).then_some(residual)
    }

    /// Mean square of the algebraic residual over the points it was fitted to.
    pub fn mean_sq_residual(&self) -> f64 {
        let local = self.frame.local_quadric(&self.quadric);
        self.scatter.sq_residual(&local) / self.scatter.count()
    }
}

fn best_fit(scatter: &Scatter, [first, second]: [Vec3; 2]) -> Option<Quadric> {
    let (direct, free) = (direct_fit_through(scatter, &first, &second), taubin_fit(scatter));
    let (Some(direct), Some(free)) = (direct, free) else { return direct.or(free) };
    let stands = scatter.mean_sq_distance(&direct)
        <= DIRECT_FIT_STANDS.get() * scatter.mean_sq_distance(&free);
    Some(if stands { direct } else { free })
}
