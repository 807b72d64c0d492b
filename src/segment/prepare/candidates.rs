//! Points that may be among the nearest.

/// Neighbours found for each point.
pub const K: usize = 16;

/// Distances compared at once.
const LANES: usize = 8;

/// Room for points that may be among the nearest.
pub const ROOM: usize = 128;

/// Points that may be among the nearest: all of those looked at that are no further than `limit`.
pub struct Candidates {
    pub sq: [f64; ROOM],
    pub place: [u32; ROOM],
    pub len: usize,
    pub limit: f64,
}

impl Candidates {
    pub fn within(limit: f64) -> Self {
        Self { sq: [0.0; ROOM], place: [0; ROOM], len: 0, limit }
    }

    /// Keeps the `K` nearest, nearest first, of equally near ones those of lower place; the furthest of them
    /// is the new limit.
    ///
    /// Each goes straight to the place that the number of nearer ones gives: no branch depends on the
    /// distances.
    #[inline(always)]
    pub fn reduce(&mut self) {
        let n = self.len.next_multiple_of(LANES);
        self.sq[self.len..n].fill(f64::INFINITY);
        // What is not among the nearest ends up behind them.
        let (mut sq, mut place) = ([f64::INFINITY; K + 1], [u32::MAX; K + 1]);
        let mut ranks = 0;
        for from in (0..n).step_by(LANES) {
            let rank = self.ranks(from);
            for (l, &nearer) in rank.iter().enumerate().take(self.len - from) {
                ranks += nearer;
                let to = (nearer as usize).min(K);
                (sq[to], place[to]) = (self.sq[from + l], self.place[from + l]);
            }
        }
        if ranks == (self.len * self.len.saturating_sub(1) / 2) as u64 {
            self.sq[..K].copy_from_slice(&sq[..K]);
            self.place[..K].copy_from_slice(&place[..K]);
        } else {
            self.sort();
        }
        self.len = self.len.min(K);
        self.limit = self.limit.min(self.sq[K - 1]);
    }

    /// How many are nearer than each of a few, from `from` on.
    #[inline(always)]
    pub fn ranks(&self, from: usize) -> [u64; LANES] {
        let mut own = [0.0; LANES];
        own.copy_from_slice(&self.sq[from..from + LANES]);
        let mut rank = [0; LANES];
        for other in &self.sq[..self.len] {
            for l in 0..LANES {
                rank[l] += u64::from(*other < own[l]);
            }
        }
        rank
    }

    /// The same where some are equally near.
    #[cold]
    pub fn sort(&mut self) {
        let mut all: Vec<(f64, u32)> = self.sq[..self.len]
            .iter()
            .copied()
            .zip(self.place[..self.len].iter().copied())
            .collect();
        all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        all.resize(self.len.max(K), (f64::INFINITY, u32::MAX));
        for (k, (sq, place)) in all.into_iter().take(K).enumerate() {
            (self.sq[k], self.place[k]) = (sq, place);
        }
    }
}
