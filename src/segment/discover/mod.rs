//! Discovery on a scene: hypotheses, selection, relabelling, merging, types, rejection.

pub mod further;
pub mod loose;
pub mod noise;

use crate::segment::discover::noise::tighten;
use crate::segment::family::Families;
use crate::segment::grow::hypothesis::Hypothesis;
use crate::segment::grow::search::Search;
use crate::segment::grow::select::select;
use crate::segment::judge::form;
use crate::segment::judge::parabola::is_parabolic;
use crate::segment::judge::whiteness::{correlated, correlation};
use crate::segment::moves::adopt::adopt;
use crate::segment::moves::converge;
use crate::segment::partition::{Partition, members, retain};
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor, Parameters, Stage};

/// Rounds over what is still without a surface.
const PASSES: usize = 3;

/// The same of what other surfaces leave: it gets the rest of its points back from them as labels settle.
const LEFT: usize = 24;

/// Finds the surfaces of a scene.
///
/// Passes over what is still without a surface: grow hypotheses on it, choose among them, then settle
/// labels, families and surfaces of the whole scene. Ends before that where the scene is a sample of which many
/// surfaces have fewer than `enough` points: a denser one is asked for.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn discover(
    scene: &Scene,
    families: &mut Families,
    enough: usize,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Partition, Cancelled> {
    let mut model = Partition { labels: vec![-1; scene.len()], ..Partition::default() };
    let mut doubtful = false;
    // points that were looked at among what is left
    let mut vain = vec![false; scene.len()];
    for pass in 0..PASSES {
        let open: Vec<u32> =
            (0..scene.len() as u32).filter(|&i| model.labels[i as usize] < 0).collect();
        // What surfaces leave of their own is more than what a whole cloud must have.
        let least = families.policy.least;
        let fresh = open.iter().filter(|&&i| !vain[i as usize]).count();
        if fresh < if pass == 0 { least } else { least * 3 / 2 } {
            break;
        }
        let seed = parameters.seed ^ pass as u64;
        let (chosen, labels) = if pass == 0 {
            let found = form::hypotheses(scene, families, seed, &mut model.trials, monitor)?;
            let Some((found, suspected)) = found else {
                model.form_error = true;
                break;
            };
            doubtful = suspected;
            choose(scene, found, families, 0, monitor)?
        } else {
            // What is left has a graph of its own: strips a point or two wide hold together in it.
            let left = open.iter().map(|&i| scene.points[i as usize]).collect();
            let mut rest = Scene::watched(left, monitor)?;
            rest.sharpen_normals(families.sigma);
            let few = families.with_least(LEFT);
            let before: Vec<bool> =
                open.iter().map(|&i| std::mem::replace(&mut vain[i as usize], true)).collect();
            let search = Search { vain: &before, ..Search::new(&rest, &few, seed) };
            let found = search.run(&mut model.trials, |_| false, monitor)?;
            let found = found.into_iter().filter(|h| h.sound).collect();
            choose(&rest, found, &few, model.shapes.len(), monitor)?
        };
        if chosen.is_empty() {
            break;
        }
        if pass == 0 {
            model.thin = thin(&labels, chosen.len(), enough);
            if model.thin.is_some() {
                break;
            }
        }
        for (&i, l) in open.iter().zip(labels) {
            model.labels[i as usize] = l;
        }
        model.shapes.extend(chosen.iter().map(|h| h.shape));
        monitor.progress(Stage::Merge, 0.3 + 0.2 * pass as f64);
        converge(scene, &mut model, families, monitor)?;
        if std::mem::take(&mut doubtful) && form::is_seen(scene, &model, families.sigma) {
            model.form_error = true;
            break;
        }
        let least = members(&model.labels, model.shapes.len()).iter().map(Vec::len).min();
        if let Some(least) = least.filter(|l| *l < enough) {
            model.thin = Some(least);
            break;
        }
        let last = pass + 1 == PASSES;
        drop_unsound(scene, &mut model, families.sigma, last);
        if families.policy.merge {
            adopt(scene, &mut model, families.sigma);
        }
        monitor.check()?;
        if parameters.noise_sigma.is_none() {
            tighten(scene, &model, families);
        }
    }
    Ok(model)
}

/// Share of the surfaces that may have too few points: hypotheses that bridge others leave slivers to these.
const SLIVERS: f64 = 0.25;
/// Share of the surfaces with the fewest points of which the next one tells how thin a sample is.
const FEWEST: f64 = 0.1;

/// Points of the surfaces with the fewest, where too many have fewer than `enough`.
fn thin(labels: &[i32], surfaces: usize, enough: usize) -> Option<usize> {
    let mut sizes: Vec<usize> = members(labels, surfaces).iter().map(Vec::len).collect();
    sizes.sort_unstable();
    let few = sizes.partition_point(|s| *s < enough);
    let typical = sizes.get((FEWEST * surfaces as f64) as usize).copied();
    typical.filter(|_| few as f64 > SLIVERS * surfaces as f64)
}

pub fn choose(
    part: &Scene,
    found: Vec<Hypothesis>,
    families: &Families,
    first_label: usize,
    monitor: &dyn Monitor,
) -> Result<(Vec<Hypothesis>, Vec<i32>), Cancelled> {
    let none = vec![-1; part.len()];
    let chosen = select(part, found, families.sigma, &none, first_label, families.policy.least);
    monitor.check().map(|()| chosen)
}

/// Takes out regions that are parabolas, and, unless this is the `last` pass, those whose residuals are correlated:
/// they bridge several surfaces, which the next pass finds one by one.
fn drop_unsound(scene: &Scene, model: &mut Partition, sigma: f64, last: bool) {
    let groups = members(&model.labels, model.shapes.len());
    let keep: Vec<bool> = model
        .shapes
        .iter()
        .zip(&groups)
        .enumerate()
        .map(|(l, (s, g))| {
            let inside = |j: u32| model.labels[j as usize] == l as i32;
            !scene.cancelled()
                && !is_parabolic(s)
                && (last || !correlated(correlation(scene, s, g, sigma, inside), g.len()))
        })
        .collect();
    for l in &mut model.labels {
        if *l >= 0 && !keep[*l as usize] {
            *l = -1;
        }
    }
    retain(model, &keep);
}
