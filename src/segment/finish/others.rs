//! The other quadrics (paraboloids, hyperboloids, ...), looked for where the user asks for them.

use crate::fit::constant::constants;
use crate::geometry::{Frame, Quadric, SurfaceType, Tolerance, Vec3, recover};
use crate::segment::judge::one_quadric::one_quadric;
use crate::segment::objective::{ACCEPT, APART, MOST};
use crate::segment::report::pieces::pieces;
use crate::segment::{Monitor, Parameters};

constants! {
    /// Points that a fit looks at.
    SAMPLE: usize = 20_000, Effort("points of one fit");
}

/// A quadric of some other type and its points.
pub struct Other {
    /// Its type.
    pub surface_type: SurfaceType,
    /// The quadric, relative to the cloud's centre.
    pub quadric: Quadric,
    /// The places of its points.
    pub members: Vec<u32>,
}

impl Other {
    /// Root mean square distance of its points from the quadric.
    pub fn rms(&self, points: &[Vec3]) -> f64 {
        let squares =
            self.members.iter().map(|&i| self.quadric.distance(&points[i as usize]).powi(2));
        (squares.sum::<f64>() / self.members.len().max(1) as f64).sqrt()
    }
}

/// Whether any type beside the default ones is asked for.
pub fn asked_for(parameters: &Parameters) -> bool {
    parameters.surfaces.iter().any(|t| !SurfaceType::DEFAULT.contains(t))
}

/// Quadrics of the other types asked for, among the `free` points: one for each connected piece of them
/// that a single quadric explains.
pub fn others(
    points: &[Vec3],
    free: &[u32],
    spacing: f64,
    noise: f64,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Vec<Other> {
    let own: Vec<Vec3> = free.iter().map(|&i| points[i as usize]).collect();
    let found = pieces(&own, APART.get() * spacing)
        .into_iter()
        .take_while(|p| p.len() >= parameters.min_points);
    found
        .take_while(|_| !monitor.cancelled())
        .filter_map(|piece| {
            let part: Vec<Vec3> = piece.iter().map(|&k| own[k as usize]).collect();
            let (surface_type, quadric) = explain(&part, noise, parameters)?;
            let tolerance = parameters.tolerance.unwrap_or(ACCEPT.get() * noise);
            let near = |k: &&u32| quadric.distance(&own[**k as usize]) <= tolerance;
            let members: Vec<u32> = piece.iter().filter(near).map(|&k| free[k as usize]).collect();
            let enough = members.len() as f64 >= MOST.get() * piece.len() as f64
                && members.len() >= parameters.min_points;
            enough.then_some(Other { surface_type, quadric, members })
        })
        .take(parameters.max_regions)
        .collect()
}

/// The quadric through a piece, where it scatters about it by no more than noise (or the tolerance) lets
/// it and its type is asked for.
fn explain(points: &[Vec3], noise: f64, parameters: &Parameters) -> Option<(SurfaceType, Quadric)> {
    let sample: Vec<Vec3> =
        points.iter().step_by(points.len().div_ceil(SAMPLE.get())).copied().collect();
    let sigma = parameters.tolerance.map_or(noise, |t| noise.max(t / ACCEPT.get()));
    let quadric = one_quadric(&sample, sigma)?;
    let frame = Frame::of(sample.iter().copied());
    let surface_type = recover(&quadric, &frame, Tolerance::default())?.surface_type;
    let wanted = !SurfaceType::DEFAULT.contains(&surface_type)
        && parameters.surfaces.contains(&surface_type);
    wanted.then_some((surface_type, quadric))
}
