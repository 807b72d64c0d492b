//! What was found on a sample.

use crate::fit::Family;
use crate::geometry::Vec3;
use crate::segment::family::{Families, MOST_RADIUS, Policy};
use crate::segment::judge::{breadth, strays};
use crate::segment::label::{shares, spread};
use crate::segment::partition::Partition;
use crate::segment::prepare::noise::Noise;
use crate::segment::prepare::place::place;
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor, Parameters, SegmentError, Stage, discover, objective};

/// How far points reach from the cloud's centre.
fn extent(points: &[Vec3]) -> f64 {
    points.iter().map(|p| p.norm()).fold(0.0, f64::max)
}

/// The rounding of coordinates of single precision.
pub fn rounding(points: &[Vec3]) -> f64 {
    5e-8 * extent(points)
}

/// What was found on a sample.
pub struct Discovery<'a> {
    pub scene: Scene<'a>,
    pub model: Partition,
    /// What was fitted, and the scatter about the surfaces that was reckoned with: noise, and form error where it is
    /// allowed.
    pub families: Families,
    pub noise: f64,
    /// Whether that scatter is more than the noise between neighbours: not all surfaces need have so much.
    pub raised: bool,
}

impl Discovery<'_> {
    /// What the labels of `n` points reckon with.
    pub fn scatter(&self, n: usize) -> f64 {
        // Those of a sample's own points stay as they were given where it is all there is.
        if self.scene.len() == n { self.noise.max(self.model.allowed) } else { self.noise }
    }
}

/// Finds surfaces on at most `limit` of the points, evenly along their Morton order, whose noise is `estimated`; where they
/// lie on rows, of those that do not.
pub fn discover<'a>(
    points: &[Vec3],
    limit: usize,
    estimated: &Noise,
    enough: usize,
    parameters: &Parameters,
    monitor: &'a dyn Monitor,
) -> Result<Discovery<'a>, SegmentError> {
    let n = estimated.even.as_ref().map_or(points.len(), |even| even.len());
    let m = n.min(limit);
    let at = |k: usize| estimated.even.as_ref().map_or(k, |even| even[k] as usize);
    let places: Vec<u32> = (0..m).map(|k| at(place(k, m, n)) as u32).collect();
    let taken = places.iter().map(|&i| points[i as usize]).collect();
    let mut scene = Scene::on_profiles(taken, estimated.profiles, monitor)?
        .taken_from(places)
        .stepped(estimated.steps);
    let extent = extent(&scene.points);
    let rounding = rounding(&scene.points);
    let noise = parameters.noise_sigma.unwrap_or(estimated.sigma).max(rounding);
    monitor.check()?;
    // A tolerance above four sigmas allows form error: surfaces are looked for at that scale.
    let allowed = parameters.tolerance.map_or(0.0, |t| t / objective::ACCEPT.get());
    let sigma = noise.max(allowed);
    let floor = if parameters.noise_sigma.is_some() || estimated.rougher {
        sigma
    } else {
        allowed.max(rounding)
    };
    scene.sharpen_normals(sigma);
    monitor.check()?;
    let mut families = Families {
        allowed: Family::ALL.to_vec(),
        sigma,
        max_radius: extent * MOST_RADIUS.get(),
        floor,
        common: 0.0,
        rougher: estimated.rougher,
        strips: true,
        policy: Policy::of(parameters),
    };
    monitor.progress(Stage::Grow, 0.1);
    let mut model = if parameters.noise_sigma.is_none() && estimated.fills_volume {
        Partition { labels: vec![-1; m], ..Partition::default() }
    } else {
        discover::discover(&scene, &mut families, enough, parameters, monitor)?
    };
    let (least, sigma) = (sigma, families.sigma);
    if model.thin.is_none() {
        breadth::mark(&scene, &mut model, sigma);
    }
    monitor.check()?;
    let noise = if allowed > noise { noise } else { sigma };
    let raised = model.rougher || sigma > least || families.common > 0.0;
    Ok(Discovery { scene, model, families, noise, raised })
}

pub fn label_all(
    points: &[Vec3],
    scene: &Scene,
    model: &Partition,
    sigma: f64,
    monitor: &dyn Monitor,
) -> Result<shares::Labelled, Cancelled> {
    if scene.len() == points.len() {
        let mut shares = shares::shares(scene, model, sigma);
        monitor.check()?;
        let mut labels = model.labels.clone();
        for i in strays::strays(scene, &labels) {
            labels[i as usize] = -1;
        }
        shares.retain(|(i, _)| labels[*i as usize] >= 0);
        Ok(shares::Labelled { labels, shares })
    } else {
        spread::spread(points, scene, model, sigma, monitor)
    }
}
