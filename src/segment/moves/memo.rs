//! What was tried before, without gain.

use std::collections::HashSet;

use crate::segment::label::changes::Changes;

/// A kind of move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Move {
    /// Another family for one region.
    Retype,
    /// Another family for one region, judged with those around it.
    Swap,
    /// One surface for two regions.
    Merge,
    /// None for a region that others explain.
    Remove,
    /// Several surfaces for one.
    Split,
}

/// Moves that gained nothing, by the revisions of the regions that they were tried on.
#[derive(Clone, Debug, Default)]
pub struct Memo {
    vain: HashSet<(Move, Box<[u64]>)>,
}

/// A move on regions as they are.
pub type Key = (Move, Box<[u64]>);

impl Memo {
    /// What a move on some regions is remembered by: the first of them, and the others in whatever order. `None`
    /// where one has no revision yet.
    pub fn key(
        changes: &Changes,
        kind: Move,
        region: usize,
        others: impl IntoIterator<Item = usize>,
    ) -> Option<Key> {
        let others: Option<Vec<u64>> = others.into_iter().map(|r| changes.revision(r)).collect();
        let (mut all, first) = (others?, changes.revision(region)?);
        all.sort_unstable();
        all.insert(0, first);
        Some((kind, all.into()))
    }

    /// Whether a move was tried in vain.
    pub fn is_vain(&self, key: Option<&Key>) -> bool {
        key.is_some_and(|k| self.vain.contains(k))
    }

    /// Remembers those of some moves that gained nothing: of what each came to, `None`.
    pub fn add<T>(&mut self, keys: Vec<Option<Key>>, gains: &[Option<T>]) {
        let vain = keys.into_iter().zip(gains).filter(|(_, gain)| gain.is_none());
        self.vain.extend(vain.filter_map(|(key, _)| key));
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.vain.clear();
    }
}
