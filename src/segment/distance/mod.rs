//! The default method: hypotheses grown from local starts, chosen by description length, relabelled
//! together, typed and fitted by orthogonal distance.

mod adopt;
mod breadth;
mod bridges;
mod compounds;
mod constraints;
mod directions;
mod engine;
mod evidence;
mod family;
mod finish;
mod form;
mod hypothesis;
mod joints;
mod label;
mod median;
mod merge;
mod moves;
mod nearest;
mod noise;
mod others;
mod parabolas;
mod pieces;
mod reasons;
mod report;
mod rings;
mod scene;
mod search;
mod select;
mod spread;
mod steps;
mod strays;
mod trial;
mod uncertainty;
mod union;

use rayon::prelude::*;

use engine::Model;
use family::{Families, MOST_RADIUS, MOST_RADIUS_OF_FORM, Policy};
use scene::{Scene, morton_order};

use super::{Cancelled, Counters, Monitor, Parameters, SegmentError, Segmentation, Stage};
use crate::fit::{Family, Shape};
use crate::geometry::{PointCloud, Vec3};

/// What the default method found.
pub struct Found<'a> {
    /// The cloud's distinct points relative to `centre`, in Morton order.
    pub points: Vec<Vec3>,
    /// The cloud's centre.
    pub centre: Vec3,
    /// Where each of the cloud's points stands in `points`.
    pub places: Vec<u32>,
    /// Each region's surface, relative to `centre`; tori, which are not reported, among them.
    pub shapes: Vec<Shape>,
    /// Each point's region, -1 = none.
    pub labels: Vec<i32>,
    /// The noise's standard deviation, as estimated or given.
    pub noise: f64,
    /// Largest distance of a point from its surface, unless one was given.
    pub reach: f64,
    /// Noise below this is that of the coordinates' digits.
    pub rounding: f64,
    /// The points that surfaces were looked for on, taken evenly from `points`: see [`place`].
    pub scene: Scene<'a>,
    /// How much work it was.
    pub counters: Counters,
}

/// Finds the surfaces of a cloud by orthogonal distance.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn segment(
    cloud: &PointCloud,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Segmentation, SegmentError> {
    let found = find(&cloud.points, parameters, monitor)?;
    monitor.progress(Stage::Report, 0.95);
    Ok(report::report(parameters, found, monitor)?)
}

fn find<'a>(
    cloud: &[Vec3],
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<Found<'a>, SegmentError> {
    monitor.progress(Stage::Prepare, 0.0);
    let (points, centre, places) = distinct_points(cloud, monitor)?;
    let (discovery, labelled) = discover_on_samples(&points, parameters, monitor)?;
    monitor.progress(Stage::Refine, 0.85);
    let reach = label::ACCEPT * discovery.scatter(points.len());
    let rounding = rounding(&discovery.scene.points);
    let Discovery { scene, mut model, sigma, noise } = discovery;
    if parameters.refine {
        finish::finish(&points, &labelled, &mut model, sigma, monitor);
        monitor.check()?;
    }
    let (trials, merges) = (model.trials, model.merges);
    let counters =
        Counters { trials: trials.0, failed_trials: trials.1, merges, ..Counters::default() };
    let mut labels = labelled.labels;
    for l in labels.iter_mut().filter(|l| !model.is_surface(**l)) {
        *l = -1;
    }
    let shapes = model.shapes;
    Ok(Found { points, centre, places, shapes, labels, noise, reach, rounding, scene, counters })
}

/// The distinct points of a cloud in Morton order relative to their centre, that centre, and where each
/// point of the cloud stands among them. Copies of a point say nothing new, and would fill its
/// neighbourhood.
fn distinct_points(
    cloud: &[Vec3],
    monitor: &dyn Monitor,
) -> Result<(Vec<Vec3>, Vec3, Vec<u32>), Cancelled> {
    let order = morton_order(cloud, monitor)?;
    let mut points: Vec<Vec3> = order.par_iter().map(|&i| cloud[i as usize]).collect();
    // Summed in this order and in chunks of one size: the centre must depend neither on the order of the input
    // nor on the number of threads.
    let sums: Vec<Vec3> = points.par_chunks(4096).map(|chunk| chunk.iter().sum()).collect();
    let centre = sums.iter().sum::<Vec3>() / cloud.len() as f64;
    monitor.check()?;
    let mut places = vec![0; cloud.len()];
    let mut last = 0;
    for (k, &i) in order.iter().enumerate() {
        if k > 0 && points[k] != points[last] {
            last += 1;
            points[last] = points[k];
        }
        places[i as usize] = last as u32;
    }
    points.truncate(last + 1);
    points.par_iter_mut().with_min_len(4096).for_each(|p| *p -= centre);
    monitor.check()?;
    Ok((points, centre, places))
}

/// The place among `n` points of the `k`-th of `m` taken evenly.
fn place(k: usize, m: usize, n: usize) -> usize {
    k * n / m
}

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
fn discover_on_samples<'a>(
    points: &[Vec3],
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<(Discovery<'a>, spread::Labelled), SegmentError> {
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

/// How far points reach from the cloud's centre.
fn extent(points: &[Vec3]) -> f64 {
    points.iter().map(|p| p.norm()).fold(0.0, f64::max)
}

/// The rounding of coordinates of single precision.
fn rounding(points: &[Vec3]) -> f64 {
    5e-8 * extent(points)
}

/// What was found on a sample.
struct Discovery<'a> {
    scene: Scene<'a>,
    model: Model,
    /// Scatter about the surfaces that was reckoned with: noise, and form error where it is allowed.
    sigma: f64,
    noise: f64,
}

impl Discovery<'_> {
    /// What the labels of `n` points reckon with.
    fn scatter(&self, n: usize) -> f64 {
        // Those of a sample's own points stay as they were given where it is all there is.
        if self.scene.len() == n { self.noise.max(self.model.allowed) } else { self.noise }
    }
}

/// Finds surfaces on at most `limit` of the points, evenly along their Morton order; those with a form error
/// only where `bare_noise`, that of the points without it, is given.
fn discover<'a>(
    points: &[Vec3],
    limit: usize,
    bare_noise: Option<f64>,
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<Discovery<'a>, SegmentError> {
    let n = points.len();
    let m = n.min(limit);
    let taken = (0..m).map(|k| points[place(k, m, n)]).collect();
    let mut scene = Scene::watched(taken, monitor)?;
    let extent = extent(&scene.points);
    let rounding = rounding(&scene.points);
    let estimate = noise::estimate(&scene);
    let noise = parameters.noise_sigma.or(bare_noise).unwrap_or(estimate).max(rounding);
    monitor.check()?;
    // A tolerance above four sigmas allows form error: surfaces are looked for at that scale.
    let allowed = parameters.tolerance.map_or(0.0, |t| t / label::ACCEPT);
    let sigma = noise.max(allowed);
    let floor = if parameters.noise_sigma.is_some() { sigma } else { allowed.max(rounding) };
    scene.sharpen_normals(sigma);
    monitor.check()?;
    let mut families = Families {
        allowed: Family::ALL.to_vec(),
        sigma,
        max_radius: extent * if bare_noise.is_some() { MOST_RADIUS_OF_FORM } else { MOST_RADIUS },
        floor,
        strips: bare_noise.is_none(),
        policy: Policy::of(parameters),
    };
    monitor.progress(Stage::Grow, 0.1);
    let mut model = if parameters.noise_sigma.is_none() && noise::fills_volume(&scene, sigma) {
        Model { labels: vec![-1; m], ..Model::default() }
    } else if bare_noise.is_some() {
        engine::discover_with_form_error(&scene, &mut families, estimate, parameters, monitor)?
    } else {
        engine::discover(&scene, &mut families, parameters, monitor)?
    };
    let sigma = families.sigma;
    breadth::mark(&scene, &mut model, sigma);
    monitor.check()?;
    Ok(Discovery { scene, model, sigma, noise: if allowed > noise { noise } else { sigma } })
}

fn label_all(
    points: &[Vec3],
    scene: &Scene,
    model: &Model,
    sigma: f64,
    monitor: &dyn Monitor,
) -> Result<spread::Labelled, Cancelled> {
    if scene.len() == points.len() {
        let mut shares = finish::shares(scene, model, sigma);
        monitor.check()?;
        let mut labels = model.labels.clone();
        for i in strays::strays(scene, &labels) {
            labels[i as usize] = -1;
        }
        shares.retain(|(i, _)| labels[*i as usize] >= 0);
        Ok(spread::Labelled { labels, shares })
    } else {
        spread::spread(points, scene, model, sigma, monitor)
    }
}

/// Whether a sample was dense enough.
enum Judged {
    /// It was: every point's label.
    Enough(spread::Labelled),
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
    let sizes = label::members(&found.model.labels, found.model.shapes.len());
    let least = sizes.iter().map(Vec::len).min().unwrap_or(size);
    if least < DENSE_ENOUGH {
        return Ok(Judged::Thin(size * DENSE_ENOUGH / least.max(1)));
    }
    let labelled = spread::spread(points, &found.scene, &found.model, found.sigma, monitor)?;
    let left: Vec<Vec3> =
        points.iter().zip(&labelled.labels).filter(|(_, l)| **l < 0).map(|(p, _)| *p).collect();
    let lacking =
        left.len() >= 64 && engine::holds_surface(&left, found.sigma, parameters, monitor)?;
    Ok(if lacking { Judged::Thin(FINE) } else { Judged::Enough(labelled) })
}
