//! Discovery on a scene: hypotheses, selection, relabelling, merging, types, rejection.

pub mod further;
pub mod noise;

use crate::fit::Shape;
use crate::fit::constant::constants;
use crate::segment::discover::noise::tighten;
use crate::segment::family::Families;
use crate::segment::grow::hypothesis::Hypothesis;
use crate::segment::grow::search::Search;
use crate::segment::grow::select::select;
use crate::segment::judge::form::{self, Looked};
use crate::segment::judge::parabola::is_parabolic;
use crate::segment::judge::stability;
use crate::segment::judge::whiteness::{correlated, correlation};
use crate::segment::moves::adopt::adopt;
use crate::segment::moves::converge;
use crate::segment::objective::{FEW, HALF, LITTLE, PART};
use crate::segment::partition::{Partition, members, retain};
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor, Parameters, Stage};

constants! {
    /// Points that must confirm that residuals go together: a coarse sample of many narrow faces looks like that too.
    CONFIRMED: usize = 50_000, Effort("points of the second sample");
    /// Share of what is left that surfaces must explain for it to be no rougher ones.
    MISSED: f64 = 0.7, Trial(0.5, 0.9);
    /// Rounds over what is still without a surface.
    PASSES: usize = 3, Effort("passes");
}

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
    let mut model = Partition::of_none(scene.len(), Partition::default());
    let mut left = Left::of(scene.len());
    let (mut suspected, mut seen, mut pass) = (false, false, 0);
    while pass < PASSES.get() {
        if left.look(&model.labels) < families.policy.least {
            break;
        }
        let seed = parameters.seed ^ pass as u64;
        let (chosen, labels) = if pass == 0 {
            let dense = enough == 0 || scene.len() >= CONFIRMED.get();
            let looked =
                form::hypotheses(scene, families, seed, (dense, seen), &mut model.trials, monitor)?;
            suspected = matches!(looked, Looked::Suspected(_));
            model.rougher = matches!(looked, Looked::Found(_, false));
            first(scene, looked, families, enough, &mut model, monitor)?
        } else {
            left.chosen(scene, families, seed, &mut model, monitor)?
        };
        if chosen.is_empty() || model.thin.is_some() {
            break;
        }
        if pass > 0 && model.rougher && families.common == 0.0 && is_rough(&labels) {
            break;
        }
        left.open.iter().zip(labels).for_each(|(&i, l)| model.labels[i as usize] = l);
        model.shapes.extend(chosen.iter().map(|h| h.shape));
        monitor.progress(Stage::Merge, 0.3 + 0.2 * pass as f64);
        converge(scene, &mut model, families, monitor)?;
        if std::mem::take(&mut suspected) && form::is_seen(scene, &model, families.sigma) {
            model = Partition::of_none(scene.len(), model);
            (left, seen) = (Left::of(scene.len()), true);
            continue;
        }
        model.thin = thin(&model.labels, families, enough, LITTLE.get());
        if model.thin.is_some() {
            break;
        }
        drop_unsound(scene, &mut model, families, pass + 1 == PASSES.get());
        if families.policy.merge {
            adopt(scene, &mut model, families.sigma);
        }
        monitor.check()?;
        if parameters.noise_sigma.is_none() {
            tighten(scene, &model, families);
        }
        pass += 1;
    }
    if model.rougher || families.rougher {
        model.spurious = spurious(scene, families, &model);
    }
    Ok(model)
}

/// Whether what surfaces with less noise than others leave, here with its first labels, is these others: else growth had only
/// missed it.
fn is_rough(labels: &[i32]) -> bool {
    let explained = labels.iter().filter(|l| **l >= 0).count() as f64;
    explained < MISSED.get() * labels.len() as f64
}

/// The regions that are no surfaces: growth from elsewhere in them ends elsewhere. They keep their points from flowing to
/// their neighbours, and are not reported. None where most are surfaces: narrow faces hardly tell, and there it is a
/// face rather than freeform. Of what smooth noise leaves beside finer surfaces nothing is taken for granted.
fn spurious(scene: &Scene, families: &Families, model: &Partition) -> Vec<bool> {
    let groups = members(&model.labels, model.shapes.len());
    let unstable = stability::unstable(scene, families, &model.shapes, &groups);
    let count = unstable.iter().filter(|u| **u).count() as f64;
    let strict = families.rougher && families.common > 0.0;
    if strict || count > HALF.get() * unstable.len() as f64 { unstable } else { Vec::new() }
}

/// The hypotheses chosen among those of the whole scene and its first labels; `model` is thin where a denser sample with
/// `enough` points for each may tell more.
fn first(
    scene: &Scene,
    looked: Looked,
    families: &Families,
    enough: usize,
    model: &mut Partition,
    monitor: &dyn Monitor,
) -> Result<(Vec<Hypothesis>, Vec<i32>), Cancelled> {
    let (Looked::Found(found, _) | Looked::Suspected(found)) = looked else {
        model.thin = Some(enough / 2);
        return Ok((Vec::new(), Vec::new()));
    };
    if families.common > 0.0 || families.rougher {
        model.allowed = families.sigma;
    }
    let (chosen, labels) = choose(scene, found, families, 0, monitor)?;
    model.thin = thin(&labels, families, enough, PART.get());
    Ok((chosen, labels))
}

/// The points that surfaces leave.
struct Left {
    open: Vec<u32>,
    /// Whether a point was there when hypotheses were last looked for among what is left.
    vain: Vec<bool>,
}

impl Left {
    fn of(points: usize) -> Self {
        Self { open: Vec::new(), vain: vec![false; points] }
    }

    /// Looks which points have no label. Returns how many of them have not been looked at in vain.
    fn look(&mut self, labels: &[i32]) -> usize {
        self.open = (0..labels.len() as u32).filter(|&i| labels[i as usize] < 0).collect();
        self.open.iter().filter(|&&i| !self.vain[i as usize]).count()
    }

    /// The points with a graph of their own: strips a point or two wide hold together in it.
    fn scene<'a>(
        &self,
        scene: &Scene,
        sigma: f64,
        monitor: &'a dyn Monitor,
    ) -> Result<Scene<'a>, Cancelled> {
        let points = self.open.iter().map(|&i| scene.points[i as usize]).collect();
        let mut rest = Scene::on_profiles(points, scene.profiles, monitor)?.stepped(scene.steps);
        rest.sharpen_normals(sigma);
        Ok(rest)
    }

    /// The hypotheses chosen among them, and their labels, which follow those of the model's surfaces.
    fn chosen(
        &mut self,
        scene: &Scene,
        families: &Families,
        seed: u64,
        model: &mut Partition,
        monitor: &dyn Monitor,
    ) -> Result<(Vec<Hypothesis>, Vec<i32>), Cancelled> {
        let few = families.with_least(FEW.get());
        let rest = self.scene(scene, families.sigma, monitor)?;
        let found = self.hypotheses(&rest, &few, seed, &mut model.trials, monitor)?;
        scene.work.leave_with(&rest.work);
        choose(&rest, found, &few, model.shapes.len(), monitor)
    }

    /// The sound hypotheses among them, from what has not been looked at in vain.
    fn hypotheses(
        &mut self,
        rest: &Scene,
        families: &Families,
        seed: u64,
        trials: &mut (usize, usize),
        monitor: &dyn Monitor,
    ) -> Result<Vec<Hypothesis>, Cancelled> {
        let looked = |&i: &u32| std::mem::replace(&mut self.vain[i as usize], true);
        let vain: Vec<bool> = self.open.iter().map(looked).collect();
        let search = Search { vain: &vain, ..Search::new(rest, families, seed) };
        let found = search.run(trials, |_| false, monitor)?;
        let found = stability::rescued(rest, families, found);
        Ok(found.into_iter().filter(|h| h.sound).collect())
    }
}

/// Points of the surfaces with the fewest, where more than a `share` of them have fewer than `enough`. Where neighbours
/// share their noise a denser sample hardly says more, and what surfaces leave is looked at by itself.
fn thin(labels: &[i32], families: &Families, enough: usize, share: f64) -> Option<usize> {
    if families.common > 0.0 {
        return None;
    }
    let surfaces = labels.iter().max().map_or(0, |l| (l + 1) as usize);
    let mut sizes: Vec<usize> = members(labels, surfaces).iter().map(Vec::len).collect();
    sizes.sort_unstable();
    let few = sizes.partition_point(|s| *s < enough);
    let typical = sizes.get((LITTLE.get() * surfaces as f64) as usize).copied();
    typical.filter(|_| few as f64 > share * surfaces as f64)
}

pub fn choose(
    part: &Scene,
    found: Vec<Hypothesis>,
    families: &Families,
    first_label: usize,
    monitor: &dyn Monitor,
) -> Result<(Vec<Hypothesis>, Vec<i32>), Cancelled> {
    let chosen = select(part, found, families.sigma, first_label, families.policy.least);
    monitor.check().map(|()| chosen)
}

/// Takes out regions that are parabolas, and, unless this is the `last` pass, those whose residuals are correlated:
/// they bridge several surfaces, which the next pass finds one by one.
fn drop_unsound(scene: &Scene, model: &mut Partition, families: &Families, last: bool) {
    let mut groups = members(&model.labels, model.shapes.len());
    let together = |(l, (s, g)): (usize, (&Shape, &Vec<u32>))| {
        let inside = |j: u32| model.labels[j as usize] == l as i32;
        let own = correlation(scene, s, g, families.sigma, inside);
        !last && correlated(own, families.common, g.len())
    };
    let mut bridge: Vec<bool> =
        model.shapes.iter().zip(&groups).enumerate().map(together).collect();
    if families.common > 0.0 {
        // How much neighbours have in common differs from surface to surface.
        groups.iter_mut().zip(&bridge).filter(|g| !g.1).for_each(|(g, _)| g.clear());
        let unstable = stability::unstable(scene, families, &model.shapes, &groups);
        bridge.iter_mut().zip(unstable).for_each(|(b, unstable)| *b &= unstable);
    }
    let keep: Vec<bool> = model
        .shapes
        .iter()
        .zip(bridge)
        .map(|(s, bridge)| !bridge && !is_parabolic(s) && !scene.cancelled())
        .collect();
    for l in &mut model.labels {
        if *l >= 0 && !keep[*l as usize] {
            *l = -1;
        }
    }
    retain(model, &keep);
}
