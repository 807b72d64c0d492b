//! How many points surfaces are looked for on.

pub mod discovery;

use crate::geometry::Vec3;
use crate::segment::discover::further;
use crate::segment::label::{shares, spread};
use crate::segment::prepare::noise;
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

/// Points that a sample has even where they lie on rows, if there are as many.
const SPARSE: usize = 2_000;

/// Points that surfaces are looked for on where the others are too thin for what is there.
const FINE: usize = 320_000;

/// Points of the sample that every surface must have for the sample to count as dense enough.
const DENSE_ENOUGH: usize = 200;

/// Share of a sample that surfaces with a form error explain where a denser one is worth a look.
const MOSTLY: f64 = 0.5;

/// Share of a sample that surfaces with a form error must explain to be believed although a fine sample might
/// show that there is none.
const SEEN: f64 = 0.9;

/// Finds surfaces on a sample, on a denser one where that is too thin for what is there, and labels all points.
pub fn discover_on_samples<'a>(
    points: &[Vec3],
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<(Discovery<'a>, shares::Labelled), SegmentError> {
    let noise = noise::estimate(points, monitor);
    monitor.check()?;
    // A denser sample's neighbourhoods lie on single rows.
    let whole = noise.spanning.max(points.len().min(SPARSE));
    let most = whole.min(FINE);
    let label = |found: Discovery<'a>| -> Result<_, SegmentError> {
        let labelled = label_all(points, &found.scene, &found.model, found.sigma, monitor)?;
        Ok((found, labelled))
    };
    let look = |size, enough| discover(points, size, &noise, None, enough, parameters, monitor);
    // A sample of most of the points saves nothing.
    let mut size = if whole <= 2 * COARSE { whole } else { COARSE };
    let mut formed: Option<Discovery> = None;
    let mut thinner = Thinner::None;
    loop {
        let found = look(size, if size < most { DENSE_ENOUGH } else { 0 })?;
        if let Some(few) = found.model.thin {
            thinner = Thinner::Glanced(size);
            size = denser(size, few, whole);
        } else if found.model.form_error {
            // What explained a thinner sample without a form error needs none.
            let thin = match std::mem::replace(&mut thinner, Thinner::None) {
                Thinner::None => None,
                Thinner::Found(thin) => Some(*thin),
                Thinner::Glanced(size) => Some(look(size, 0)?),
            };
            if let Some(thin) = thin.filter(|t| !t.model.form_error && t.model.explained() > SEEN) {
                return label(thin);
            }
            if let Some(formed) = formed {
                return label(formed);
            }
            if size < most.min(CONFIRMED) {
                size = CONFIRMED;
                continue;
            }
            let bare = Some(found.noise);
            let look = |size| discover(points, size, &noise, bare, 0, parameters, monitor);
            let mut loose = look(FORM)?;
            // Where that leaves small surfaces out.
            if loose.model.explained() > MOSTLY
                && let Judged::Thin(_) = judge(points, &loose, parameters, monitor)?
            {
                loose = look(most.min(CONFIRMED))?;
            }
            if size >= most || loose.model.explained() > SEEN {
                return label(loose);
            }
            // Narrow faces that are crowded on a coarse sample are not on a fine one.
            (formed, size) = (Some(loose), FINE);
        } else if let Some(formed) =
            formed.take_if(|f| f.model.explained() > found.model.explained())
        {
            return label(formed);
        } else if size >= most {
            return label(found);
        } else {
            match judge(points, &found, parameters, monitor)? {
                Judged::Enough(labelled) => return Ok((found, labelled)),
                Judged::Thin(least) => {
                    size = denser(size, least, whole);
                    thinner = Thinner::Found(Box::new(found));
                }
            }
        }
    }
}

/// What a thinner sample gave.
enum Thinner<'a> {
    /// There was none.
    None,
    /// A glance at a sample of so many points.
    Glanced(usize),
    /// Surfaces.
    Found(Box<Discovery<'a>>),
}

/// The size of the next sample of `n` points after one of `size`, of which surfaces had as `few`.
fn denser(size: usize, few: usize, n: usize) -> usize {
    let more = (size * DENSE_ENOUGH / few.max(1)).max(2 * size);
    // A third look would cost more than it saves, above all where the next one may be at the cloud itself.
    let (most, share) = if n <= FINE { (n, 4) } else { (FINE, 2) };
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
    if least < DENSE_ENOUGH {
        return Ok(Judged::Thin(least));
    }
    let labelled = spread::spread(points, &found.scene, &found.model, found.sigma, monitor)?;
    let left: Vec<Vec3> =
        points.iter().zip(&labelled.labels).filter(|(_, l)| **l < 0).map(|(p, _)| *p).collect();
    let lacking =
        left.len() >= 64 && further::holds_surface(&left, found.sigma, parameters, monitor)?;
    Ok(if lacking { Judged::Thin(0) } else { Judged::Enough(labelled) })
}
