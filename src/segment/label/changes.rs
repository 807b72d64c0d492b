//! What has changed since labels were last looked at, and which regions are still what they were.

use crate::fit::constant::constants;
use crate::segment::label::blocks::{BLOCK, Block, blocks_beside};
use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::fit::Shape;
use crate::segment::prepare::scene::Scene;

constants! {
    /// Share of its points that a region may win or lose and still be the same to whoever judges its surface: a
    /// decision that so few points turn is none.
    SAME_POINTS: f64 = 0.01, Effort("changes that are not followed up");
    /// The same for the noise: squares in its units change by twice that.
    SAME_NOISE: f64 = 0.02, Derived("twice SAME_POINTS: squares in units of the noise change by twice its change");
}

/// Keeps account of changes in a partition's surfaces and labels.
///
/// Points are watched in blocks. Where no label has changed within or beside a block, nor the surface of any label met
/// there, every label in it is still the best. Each region has a revision, a number that no other ever had, which
/// changes with its surface or with more than a few of its points: what was tried with regions of the same revisions
/// would turn out the same.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    sigma: f64,
    shapes: Vec<Shape>,
    labels: Vec<i32>,
    blocks: Vec<Block>,
    /// The blocks with neighbours in each block: what its labels are matters to them.
    beside: Vec<Vec<u32>>,
    /// Blocks to look at.
    open: Vec<bool>,
    /// Regions whose surface or points have changed.
    regions: Vec<Region>,
    last: u64,
}

#[derive(Clone, Debug, Default)]
struct Region {
    revision: u64,
    /// Whether its surface or points have changed since it was last fitted.
    changed: bool,
    /// Points won and lost since it got its revision.
    turned: usize,
    count: usize,
}

impl Changes {
    /// Renumbers labels as the partition's are: `to` says which label each becomes, -1 = none.
    pub fn renumber(&mut self, to: &[i32]) {
        let known = self.shapes.len();
        let kept = |k: usize| to.get(k).is_some_and(|t| *t >= 0);
        let mut k = 0;
        self.shapes.retain(|_| (kept(k), k += 1).0);
        k = 0;
        self.regions.retain(|_| (kept(k), k += 1).0);
        let renumber = |l: &mut i32| {
            let new = usize::try_from(*l).ok().filter(|l| *l < known).and_then(|l| to.get(l));
            *l = new.copied().unwrap_or(-1);
        };
        self.labels.iter_mut().for_each(renumber);
        for block in &mut self.blocks {
            block.met.iter_mut().for_each(renumber);
            block.pairs.iter_mut().for_each(|p| {
                p.0.iter_mut().for_each(renumber);
                p.0.sort_unstable();
            });
            block.pairs.retain(|p| p.0[0] >= 0);
        }
    }

    /// Whether `sigma` is another noise than that of what was noted.
    pub fn is_other_noise(&self, sigma: f64) -> bool {
        (sigma - self.sigma).abs() > SAME_NOISE.get() * self.sigma
    }

    /// Notes the surfaces and labels of a scene as they are now. Returns how many labels have changed.
    pub fn note(&mut self, scene: &Scene, shapes: &[Shape], labels: &[i32], sigma: f64) -> usize {
        let (n, blocks) = (scene.len(), scene.len().div_ceil(BLOCK));
        if self.labels.len() != n || self.is_other_noise(sigma) {
            let (last, mut beside) = (self.last, std::mem::take(&mut self.beside));
            if self.labels.len() != n {
                beside = blocks_beside(scene);
            }
            *self = Self { sigma, last, beside, open: vec![true; blocks], ..Self::default() };
            self.blocks = vec![Block::default(); blocks];
            self.labels = vec![-1; n];
        }
        self.regions.truncate(shapes.len());
        self.regions.resize(shapes.len(), Region::default());
        let moved: Vec<bool> =
            shapes.iter().enumerate().map(|(l, s)| self.shapes.get(l) != Some(s)).collect();
        self.shapes.clear();
        self.shapes.extend_from_slice(shapes);
        let mut stale = vec![false; blocks];
        let turned = self.turn(scene, labels, &mut stale);
        for (open, block) in self.open.iter_mut().zip(&self.blocks) {
            *open |= block.met.iter().any(|&l| l < 0 || moved.get(l as usize).is_none_or(|m| *m));
        }
        for (r, moved) in self.regions.iter_mut().zip(moved) {
            r.changed |= moved;
            if moved || r.turned as f64 > SAME_POINTS.get() * r.count as f64 {
                self.last += 1;
                (r.revision, r.turned) = (self.last, 0);
            }
        }
        self.meet(scene, &stale);
        turned
    }

    /// Takes over labels, opens the blocks where they have changed, marks those to which that matters as `stale`, and
    /// counts the changes of each region.
    fn turn(&mut self, scene: &Scene, labels: &[i32], stale: &mut [bool]) -> usize {
        let (mut turned, mut changed) = (0, vec![false; stale.len()]);
        for (i, (&now, before)) in labels.iter().zip(&mut self.labels).enumerate() {
            if now == *before {
                continue;
            }
            turned += 1;
            for (l, more) in [(now, true), (*before, false)] {
                if let Some(r) = usize::try_from(l).ok().and_then(|l| self.regions.get_mut(l)) {
                    r.changed = true;
                    r.turned += 1;
                    r.count = if more { r.count + 1 } else { r.count.saturating_sub(1) };
                }
            }
            *before = now;
            for &j in scene.neighbours(i).iter().chain([&(i as u32)]) {
                self.open[j as usize / BLOCK] = true;
            }
            changed[i / BLOCK] = true;
        }
        let changed = changed.into_iter().zip(&self.beside).filter(|(changed, _)| *changed);
        changed.flat_map(|(_, beside)| beside).for_each(|&b| stale[b as usize] = true);
        turned
    }

    /// Notes anew which labels some blocks meet.
    fn meet(&mut self, scene: &Scene, stale: &[bool]) {
        let labels = &self.labels;
        let stale = self.blocks.par_iter_mut().zip(stale).enumerate().filter(|(_, (_, s))| **s);
        stale.for_each(|(b, (block, _))| {
            block.met.clear();
            block.pairs.clear();
            for i in b * BLOCK..labels.len().min((b + 1) * BLOCK) {
                block.add(labels[i], scene.neighbours(i).iter().map(|&j| labels[j as usize]));
            }
        });
    }

    /// Pairs of labels that meet along a border, as last noted, each with how many graph edges cross it.
    pub fn borders(&self) -> BTreeMap<(usize, usize), usize> {
        let mut out = BTreeMap::new();
        for &([a, b], n) in self.blocks.iter().flat_map(|block| &block.pairs) {
            *out.entry((a as usize, b as usize)).or_insert(0) += n;
        }
        out
    }

    /// The blocks to look at, which are then looked at.
    pub fn take_open(&mut self) -> Vec<usize> {
        let open = (0..self.open.len()).filter(|&b| self.open[b]).collect();
        self.open.fill(false);
        open
    }

    /// Which regions have changed since they were last fitted; now they are.
    pub fn take_changed(&mut self) -> Vec<bool> {
        self.regions.iter_mut().map(|r| std::mem::take(&mut r.changed)).collect()
    }

    /// The revision of a region; none where it is newer than the last note.
    pub fn revision(&self, region: usize) -> Option<u64> {
        self.regions.get(region).map(|r| r.revision)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::geometry::Vec3;

    /// Two halves of a square sheet, in rows of blocks.
    fn halves() -> (Scene<'static>, Vec<Shape>, Vec<i32>) {
        let points: Vec<Vec3> =
            (0..64 * 64).map(|k| Vec3::new((k / 64) as f64, (k % 64) as f64, 0.0)).collect();
        let labels = points.iter().map(|p| i32::from(p.x > 31.5)).collect();
        let plane =
            |z| Shape::with_axis(Family::Plane, Vec3::new(0.0, 0.0, z), Vec3::z(), [0.0; 3]);
        (Scene::new(points), vec![plane(0.0), plane(0.1)], labels)
    }

    #[test]
    fn what_has_not_changed_is_not_open_and_keeps_its_revision() {
        let (scene, mut shapes, mut labels) = halves();
        let mut changes = Changes::default();
        assert_eq!(changes.note(&scene, &shapes, &labels, 1.0), labels.len());
        assert_eq!(changes.take_open().len(), 32);
        assert_eq!(changes.take_changed(), [true, true]);
        let revisions = [0, 1].map(|r| changes.revision(r));
        assert!(revisions[0] != revisions[1] && revisions[0].is_some());
        assert_eq!(changes.note(&scene, &shapes, &labels, 1.001), 0);
        assert_eq!((changes.take_open().len(), changes.take_changed()), (0, vec![false; 2]));
        assert_eq!([0, 1].map(|r| changes.revision(r)), revisions);
        // one label: its block and those beside, and both regions, which are still the same to judges
        labels[0] = 1;
        assert_eq!(changes.note(&scene, &shapes, &labels, 1.0), 1);
        assert!((1..4).contains(&changes.take_open().len()));
        assert_eq!(changes.take_changed(), [true, true]);
        assert_eq!([0, 1].map(|r| changes.revision(r)), revisions);
        // a surface: all that meet it
        shapes[1].origin.z = 0.2;
        changes.note(&scene, &shapes, &labels, 1.0);
        assert!((16..20).contains(&changes.take_open().len()));
        assert_eq!(changes.take_changed(), [false, true]);
        assert!(changes.revision(0) == revisions[0] && changes.revision(1) != revisions[1]);
        // another noise: everything
        changes.note(&scene, &shapes, &labels, 1.1);
        assert_eq!(changes.take_open().len(), 32);
    }

    #[test]
    fn borders_are_those_of_all_pairs_of_neighbours() {
        let (scene, shapes, mut labels) = halves();
        labels[77..90].fill(-1);
        let mut changes = Changes::default();
        changes.note(&scene, &shapes, &labels, 1.0);
        let crossing =
            (0..scene.len()).flat_map(|i| scene.neighbours(i).iter().map(move |&j| (i, j)));
        let edges = crossing.filter(|&(i, j)| {
            labels[i] + labels[j as usize] == 1 && labels[i] * labels[j as usize] == 0
        });
        assert_eq!(changes.borders(), BTreeMap::from([((0, 1), edges.count())]));
    }

    #[test]
    fn borders_stay_right_where_to_be_near_is_not_mutual() {
        let random = &mut crate::fit::fits::Random::new(5);
        // ever denser towards one side
        let mut at = || Vec3::new(random.uniform(0.0, 1.0).powi(4), random.uniform(0.0, 0.3), 0.0);
        let points: Vec<Vec3> = (0..5000).map(|_| at()).collect();
        let scene = Scene::new(crate::segment::fixtures::ordered(&points));
        let plane =
            |z| Shape::with_axis(Family::Plane, Vec3::new(0.0, 0.0, z), Vec3::z(), [0.0; 3]);
        let shapes: Vec<Shape> = (0..6).map(|k| plane(f64::from(k))).collect();
        let mut labels = vec![0; scene.len()];
        let mut changes = Changes::default();
        for round in 0..40 {
            let regions = 2 + (round * 7) % 5;
            labels.iter_mut().for_each(|l| *l = (*l).min(regions as i32 - 1));
            for k in 0..60 {
                labels[(round * 977 + k * 83) % scene.len()] = (k % (regions + 1)) as i32 - 1;
            }
            changes.note(&scene, &shapes[..regions], &labels, 1.0);
            let mut expected = BTreeMap::new();
            for (i, &a) in labels.iter().enumerate() {
                for &j in scene.neighbours(i) {
                    let b = labels[j as usize];
                    if a >= 0 && b >= 0 && a != b {
                        *expected.entry((a.min(b) as usize, a.max(b) as usize)).or_insert(0) += 1;
                    }
                }
            }
            assert_eq!(changes.borders(), expected, "{round}");
        }
    }

    #[test]
    fn a_region_that_goes_leaves_the_others_as_they_are() {
        let (scene, mut shapes, mut labels) = halves();
        let mut changes = Changes::default();
        changes.note(&scene, &shapes, &labels, 1.0);
        changes.take_open();
        let revision = changes.revision(1);
        shapes.remove(0);
        labels.iter_mut().for_each(|l| *l -= 1);
        changes.renumber(&[-1, 0]);
        assert_eq!(changes.note(&scene, &shapes, &labels, 1.0), 0);
        assert_eq!((changes.revision(0), changes.revision(1)), (revision, None));
        // what met the one that went
        assert!((16..20).contains(&changes.take_open().len()));
    }
}
