//! Discovery of surfaces with a form error.

use crate::segment::discover::choose;
use crate::segment::discover::noise::tighten;
use crate::segment::family::Families;
use crate::segment::grow::hypothesis::Hypothesis;
use crate::segment::judge::{form, stability};
use crate::segment::moves::converge;
use crate::segment::partition::Partition;
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor, Parameters};

/// Share of the points that surfaces with a form error explain at least.
const LEAST: f64 = 0.1;

/// Share that counts as all, and how much more of them another level must explain to be preferred.
pub const ALL: f64 = 0.95;

const MORE: f64 = 0.05;

/// Finds the surfaces of a scene that have a form error: at the first multiple of the noise at which they
/// explain nearly all, or else most. `scatter` is that of the scene's own neighbourhoods.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn discover_with_form_error(
    scene: &Scene,
    families: &mut Families,
    scatter: f64,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Partition, Cancelled> {
    let seed = parameters.seed;
    let mut trials = (0, 0);
    let mut best: Option<(Partition, Families)> = None;
    let explained =
        |best: &Option<(Partition, Families)>| best.as_ref().map_or(0.0, |b| b.0.explained());
    let between = form::between(families.sigma);
    for sigma in form::levels(families.sigma, scatter).into_iter().chain(between) {
        // What no level finds, none between them does.
        if explained(&best) > ALL || between.contains(&sigma) && explained(&best) < LEAST {
            break;
        }
        let mut looser = Families { sigma, ..families.clone() };
        let hypotheses = form::loose_hypotheses(scene, &looser, seed, &mut trials, monitor)?;
        let Some(hypotheses) = hypotheses else { continue };
        let model = settled(scene, hypotheses, &mut looser, monitor)?;
        if model.explained() > explained(&best) + MORE {
            best = Some((model, looser));
        }
    }
    if let Some((model, looser)) = best.filter(|b| b.0.explained() > LEAST) {
        *families = looser;
        return Ok(Partition { trials, ..model });
    }
    let few = form::outstanding_hypotheses(scene, families, seed, &mut trials, monitor)?;
    let model = settled(scene, few, families, monitor)?;
    Ok(Partition { trials, ..model })
}

/// The model with a form error that hypotheses lead to.
fn settled(
    scene: &Scene,
    hypotheses: Vec<Hypothesis>,
    families: &mut Families,
    monitor: &dyn Monitor,
) -> Result<Partition, Cancelled> {
    let (chosen, labels) = choose(scene, hypotheses, families, 0, monitor)?;
    let shapes = chosen.iter().map(|h| h.shape).collect();
    let allowed = families.sigma;
    let mut model = Partition { shapes, labels, form_error: true, allowed, ..Partition::default() };
    if model.shapes.is_empty() {
        return Ok(model);
    }
    converge(scene, &mut model, families, monitor)?;
    model.spurious = stability::spurious(scene, families, &model);
    monitor.check()?;
    tighten(scene, &model, families);
    Ok(model)
}
