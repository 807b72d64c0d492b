//! Points that may be among the nearest.

/// Neighbours found for each point.
pub const K: usize = 16;

/// Distances compared at once.
const LANES: usize = 16;

/// Room for points that may be among the nearest.
pub const ROOM: usize = 128;

/// Points that may be among the nearest: all of those looked at that are no further than `limit`.
pub struct Candidates {
    pub sq: [f64; ROOM],
    pub place: [u32; ROOM],
    pub len: usize,
    pub limit: f64,
    /// What makes squared distances fit into single precision.
    scale: f64,
}

impl Candidates {
    /// None yet, in a place about as large as the root of `sq_size`.
    pub fn within(limit: f64, sq_size: f64) -> Self {
        let scale = if sq_size.is_normal() { 1.0 / sq_size } else { 1.0 };
        Self { sq: [0.0; ROOM], place: [0; ROOM], len: 0, limit, scale }
    }

    /// Keeps the `K` nearest, nearest first, of equally near ones those of lower place; the furthest of them
    /// is the new limit.
    ///
    /// Each goes straight to the place that the number of nearer ones gives: no branch depends on the
    /// distances. They are compared in single precision, twice as many at once; where that does not tell two
    /// apart, all are sorted.
    #[inline(always)]
    pub fn reduce(&mut self) {
        let mut short = [f32::INFINITY; ROOM];
        for (short, sq) in short.iter_mut().zip(&self.sq[..self.len]) {
            *short = (*sq * self.scale) as f32;
        }
        // What is not among the nearest ends up behind them.
        let (mut sq, mut place) = ([f64::INFINITY; K + 1], [u32::MAX; K + 1]);
        let mut ranks = 0;
        for from in (0..self.len).step_by(LANES) {
            let rank = ranks_of(&short[..self.len], &short[from..from + LANES]);
            for (l, &nearer) in rank.iter().enumerate().take(self.len - from) {
                ranks += nearer;
                let to = (nearer as usize).min(K);
                (sq[to], place[to]) = (self.sq[from + l], self.place[from + l]);
            }
        }
        if ranks as usize == self.len * self.len.saturating_sub(1) / 2 {
            self.sq[..K].copy_from_slice(&sq[..K]);
            self.place[..K].copy_from_slice(&place[..K]);
        } else {
            self.sort();
        }
        self.len = self.len.min(K);
        self.limit = self.limit.min(self.sq[K - 1]);
    }

    /// The same where some are equally near.
    #[cold]
    fn sort(&mut self) {
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

/// How many of `all` are less than each of `some`.
#[inline(always)]
fn ranks_of(all: &[f32], some: &[f32]) -> [u32; LANES] {
    let mut own = [0.0; LANES];
    own.copy_from_slice(some);
    let mut rank = [0; LANES];
    for other in all {
        for l in 0..LANES {
            rank[l] += u32::from(*other < own[l]);
        }
    }
    rank
}
