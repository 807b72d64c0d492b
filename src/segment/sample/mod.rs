//! How many points surfaces are looked for on.

pub mod discovery;

use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::discover::further;
use crate::segment::label::{shares, spread};
use crate::segment::objective::ENOUGH;
use crate::segment::prepare::noise::Noise;
use crate::segment::sample::discovery::{Discovery, discover, label_all};
use crate::segment::{Monitor, Parameters, SegmentError, partition};

constants! {
    /// Points that surfaces are first looked for on.
    COARSE: usize = 25_000, Effort("points of the first sample");
    /// Points that surfaces are looked for on where the others are too thin for what is there.
    FINE: usize = 320_000, Effort("points of the densest sample");
    /// Points of the sample that every surface must have for the sample to count as dense enough.
    DENSE_ENOUGH: usize = 200, Effort("samples that are not made denser");
}

/// Finds surfaces of points with such a `noise` on a sample, on a denser one where that is too thin for what is there, and
/// labels all points.
pub fn discover_on_samples<'a>(
    points: &[Vec3],
    noise: &Noise,
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<(Discovery<'a>, shares::Labelled), SegmentError> {
    // Neighbourhoods of a denser sample lie on single rows.
    let whole = noise.even.as_ref().map_or(points.len(), |even| even.len());
    let most = whole.min(FINE.get());
    let label = |found: Discovery<'a>| -> Result<_, SegmentError> {
        let labelled =
            label_all(points, &found.scene, &found.model, found.families.sigma, monitor)?;
        Ok((found, labelled))
    };
    let look = |size, enough| discover(points, size, noise, enough, parameters, monitor);
    // A sample of most of the points saves nothing.
    let mut size = if whole <= 2 * COARSE.get() { whole } else { COARSE.get() };
    loop {
        let found = look(size, if size < most { DENSE_ENOUGH.get() } else { 0 })?;
        if let Some(few) = found.model.thin {
            size = denser(size, few, whole);
        } else if size >= most || found.families.common > 0.0 {
            return label(found);
        } else {
            match judge(points, &found, parameters, monitor)? {
                Judged::Enough(labelled) => return Ok((found, labelled)),
                Judged::Thin(least) => size = denser(size, least, whole),
            }
        }
    }
}

/// The size of the next sample of `n` points after one of `size`, of which surfaces had as `few`.
fn denser(size: usize, few: usize, n: usize) -> usize {
    let more = (size * DENSE_ENOUGH.get() / few.max(1)).max(2 * size);
    // A third look would cost more than it saves, above all where the next one may be at the cloud itself.
    let (most, share) = if n <= FINE.get() { (n, 4) } else { (FINE.get(), 2) };
    if more * share > most { most } else { more }
}

/// Whether a sample was dense enough.
enum Judged {
    /// It was: every point's label.
    Enough(shares::Labelled),
    /// It was not: the points of the surface with the fewest.
    Thin(usize),
}

/// A sample is dense enough where every surface has points enough in it, and what it leaves unexplained in the
/// whole cloud holds no further surface.
fn judge(
    points: &[Vec3],
    found: &Discovery,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Judged, SegmentError> {
    let size = found.scene.len();
    let sizes = partition::members(&found.model.labels, found.model.shapes.len());
    let least = sizes.iter().map(Vec::len).min().unwrap_or(size);
    if least < DENSE_ENOUGH.get() {
        return Ok(Judged::Thin(least));
    }
    let labelled =
        spread::spread(points, &found.scene, &found.model, found.families.sigma, monitor)?;
    let left: Vec<Vec3> =
        points.iter().zip(&labelled.labels).filter(|(_, l)| **l < 0).map(|(p, _)| *p).collect();
    let lacking = left.len() >= ENOUGH.get()
        && further::holds_surface(&left, found.families.sigma, parameters, monitor)?;
    Ok(if lacking { Judged::Thin(0) } else { Judged::Enough(labelled) })
}

#[cfg(test)]
mod tests;
