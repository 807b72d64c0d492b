//! Putting the best family in the place of a surface's own.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::fit::starts::Patch;
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::family::Families;
use crate::segment::moves::memo::{Key, Memo, Move};
use crate::segment::objective::SOUND;
use crate::segment::partition::{Partition, members, put_in};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::{take, take_core};

/// Puts each region's best family in, judged on its core.
pub fn retype(scene: &Scene, model: &mut Partition, families: &Families) -> usize {
    let groups = members(&model.labels, model.shapes.len());
    let labels = &model.labels;
    let keys: Vec<Option<Key>> =
        (0..groups.len()).map(|l| Memo::key(&model.changes, Move::Retype, l, [])).collect();
    let next: Vec<Option<Shape>> = model
        .shapes
        .par_iter()
        .zip(&groups)
        .enumerate()
        .map(|(l, (s, g))| {
            if scene.cancelled() || model.vain.is_vain(keys[l].as_ref()) {
                return None;
            }
            let (points, normals) = take_core(scene, labels, g, l as i32, SAMPLE.get());
            let worth = worth_trying(families, s, &points)?;
            let all = worth.each(&Patch { points: &points, normals: &normals }, &[*s]);
            let best = all.into_iter().min_by(|a, b| a.bic.total_cmp(&b.bic))?;
            let whole = take(scene, g, WHOLE.get());
            let sound = families.score(best.shape, &whole).chi2 < SOUND.get() * whole.len() as f64;
            (best.shape.family != s.family && sound).then_some(best.shape)
        })
        .collect();
    model.vain.add(keys, &next);
    put_in(&mut model.shapes, next)
}

/// The families to try for points that `shape` may explain already: then only those that cost less, if any.
fn worth_trying(families: &Families, shape: &Shape, points: &[Vec3]) -> Option<Families> {
    let mut worth = families.clone();
    if families.explains(&families.score(*shape, points), points.len()) {
        let length = |family: Family| family.description_length(families.worth(points.len()));
        let own = length(shape.family);
        worth.allowed.retain(|f| *f == shape.family || length(*f) < own);
        if worth.allowed.iter().all(|f| *f == shape.family) {
            return None;
        }
    }
    Some(worth)
}

constants! {
    /// Points of a region's core that families are fitted to.
    SAMPLE: usize = 2000, Effort("points of one fit");
    /// Points of the whole region that the best of them must describe.
    WHOLE: usize = 600, Effort("points of one look");
}
