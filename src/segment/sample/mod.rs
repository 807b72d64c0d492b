//! How many points surfaces are looked for on.

pub mod discovery;

use crate::geometry::Vec3;
use crate::segment::discover::further;
use crate::segment::label::{shares, spread};
use crate::segment::sample::discovery::{Discovery, discover, label_all};
use crate::segment::{Monitor, Parameters, SegmentError, partition};

/// Points that surfaces are first looked for on.
const COARSE: usize = 25_000;

/// Points that must confirm a form error before surfaces with one are looked for: a coarse sample of many narrow
/// faces looks like that too.
const CONFIRMED: usize = 50_000;

/// Points that surfaces with a form error are looked for on. It is the same for all points nearby: more of them
/// tell no more about the surface, but make its waves look like surfaces of their own.
const FORM: usize = 11_000;

/// Points that surfaces are looked for on where the others are too thin for what is there.
const FINE: usize = 320_000;

/// Points of the sample that every surface must have for the sample to count as dense enough.
const DENSE_ENOUGH: usize = 200;

/// Share of a sample that surfaces with a form error must explain to be believed although a fine sample might
/// show that there is none.
const SEEN: f64 = 0.9;

/// Finds surfaces on a sample, on a denser one where that is too thin for what is there, and labels all points.
pub fn discover_on_samples<'a>(
    points: &[Vec3],
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<(Discovery<'a>, shares::Labelled), SegmentError> {
    let n = points.len();
    let label = |found: Discovery<'a>| -> Result<_, SegmentError> {
        let labelled = label_all(points, &found.scene, &found.model, found.sigma, monitor)?;
        Ok((found, labelled))
    };
    // A sample of most of the points saves nothing.
    let mut size = if n <= 2 * COARSE { n } else { COARSE };
    let mut formed: Option<Discovery> = None;
    let mut thin: Option<Discovery> = None;
    loop {
        let found = discover(points, size, None, parameters, monitor)?;
        if found.model.form_error {
            // What explained a thinner sample without a form error needs none.
            if let Some(thin) = thin {
                return label(thin);
            }
            if let Some(formed) = formed {
                return label(formed);
            }
            if size < n.min(CONFIRMED) {
                size = CONFIRMED;
                continue;
            }
            let loose = discover(points, FORM, Some(found.noise), parameters, monitor)?;
            if size >= n.min(FINE) || loose.model.explained() > SEEN {
                return label(loose);
            }
            // Narrow faces that are crowded on a coarse sample are not on a fine one.
            (formed, size) = (Some(loose), FINE);
        } else if let Some(formed) =
            formed.take_if(|f| f.model.explained() > found.model.explained())
        {
            return label(formed);
        } else if size >= n.min(FINE) {
            return label(found);
        } else {
            match judge(points, &found, parameters, monitor)? {
                Judged::Enough(labelled) => return Ok((found, labelled)),
                Judged::Thin(more) => {
                    // A third look would cost more than it saves.
                    size = if more > FINE / 2 { FINE } else { more.max(2 * size) };
                    thin = Some(found).filter(|found| found.model.explained() > SEEN);
                }
            }
        }
    }
}

/// Whether a sample was dense enough.
enum Judged {
    /// It was: every point's label.
    Enough(shares::Labelled),
    /// It was not: about how many points are.
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
    if least < DENSE_ENOUGH {
        return Ok(Judged::Thin(size * DENSE_ENOUGH / least.max(1)));
    }
    let labelled = spread::spread(points, &found.scene, &found.model, found.sigma, monitor)?;
    let left: Vec<Vec3> =
        points.iter().zip(&labelled.labels).filter(|(_, l)| **l < 0).map(|(p, _)| *p).collect();
    let lacking =
        left.len() >= 64 && further::holds_surface(&left, found.sigma, parameters, monitor)?;
    Ok(if lacking { Judged::Thin(FINE) } else { Judged::Enough(labelled) })
}
