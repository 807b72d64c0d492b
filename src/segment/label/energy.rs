//! What a label costs at a point, from its own residual and its neighbours'.

use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::label::asked::Asked;
use crate::segment::label::labelling::Labelling;
use crate::segment::objective::unassigned;
use crate::segment::prepare::candidates::K;

constants! {
    /// Cost of each neighbour with another label.
    DISAGREEMENT: f64 = 0.3, Trial(0.3, 0.3);
    /// And this much across a sharp edge: a point past it says that it lies there itself, not that its
    /// neighbour does.
    SHARP_CUT: f64 = 1.0, Trial(1.0, 1.0);
    /// Evidence for one label over the next best that needs no more points' word.
    ENOUGH: f64 = 12.0, Effort("evidence beyond which no more points are asked");
    /// Rings of neighbours' neighbours that are asked where there is less than that.
    RINGS: usize = 2, Effort("rings of points that are asked");
}

/// Surfaces that part by more than this within a neighbourhood, squared and in sigmas, meet at a sharp edge.
fn sharp() -> f64 {
    unassigned()
}

/// Most labels met at one point: its own and its neighbours'.
const MOST: usize = K + 1;

/// What a label costs at a point.
#[derive(Clone, Copy, Debug, Default)]
pub struct Energy {
    /// The label.
    pub label: i32,
    /// Its own r2/sigma2 and its neighbours' evidence about that surface.
    pub evidence: f64,
    /// A little for each neighbour with another label.
    pub against: f64,
}

impl Energy {
    fn total(&self) -> f64 {
        self.evidence + self.against
    }
}

/// What the labels met at a point cost there.
pub struct Energies {
    all: [Energy; MOST],
    len: usize,
}

impl Energies {
    /// Energies at point `i` of its own label and its neighbours', of those within reach of it.
    ///
    /// The neighbours' evidence is what places a smooth joint better than the point alone can: there each
    /// tells the surfaces apart a little, and together they tell much. Two surfaces that join smoothly part with
    /// the square of the way from the joint, on either side alike: the more of their points are asked, the
    /// better, as long as they see one joint and no edge. So rings of neighbours are added until they tell enough.
    pub fn at(of: &impl Labelling, i: u32) -> Self {
        let (mut met, parting) = Met::heard(of, i);
        let mut asked = None;
        for ring in 1..=RINGS.get() {
            let width = (ring + 1) as f64;
            if met.len < 2 || parting * width * width > sharp() || met.margin() > ENOUGH.get() {
                break;
            }
            let asked = asked.get_or_insert_with(|| Asked::of(i, of.neighbours(i)));
            met.ask(of, asked.widen(of), unassigned());
        }
        met.energies()
    }

    /// [`at`](Self::at) by the nearest neighbours alone: for trials of surfaces, whose labels do not stay.
    pub fn near(of: &impl Labelling, i: u32) -> Self {
        Met::heard(of, i).0.energies()
    }

    /// The labels and their costs.
    pub fn iter(&self) -> impl Iterator<Item = &Energy> + Clone {
        self.all[..self.len].iter()
    }

    /// The label with the least energy, -1 where none lies within reach.
    pub fn best(&self) -> i32 {
        self.iter().min_by(|a, b| a.total().total_cmp(&b.total())).map_or(-1, |e| e.label)
    }
}

/// The labels met at a point, and what was heard about each.
struct Met {
    len: usize,
    labels: [i32; MOST],
    /// Squared distance of the point from each surface, in sigmas.
    own: [f64; MOST],
    /// What the points asked add to it.
    around: [f64; MOST],
    /// How many of them have each label.
    for_it: [u32; MOST],
    asked: u32,
}

impl Met {
    /// The distinct labels of a point and its neighbours, the point's own first.
    fn of(of: &impl Labelling, i: u32) -> Self {
        let (mut len, mut labels) = (0, [0; MOST]);
        let near = of.neighbours(i).iter().map(|&j| of.label(j));
        for l in std::iter::once(of.label(i)).chain(near) {
            if l >= 0 && !labels[..len].contains(&l) {
                labels[len] = l;
                len += 1;
            }
        }
        let mut own = [0.0; MOST];
        own.iter_mut().zip(&labels[..len]).for_each(|(own, &l)| *own = of.sq(l, i));
        Self { len, labels, own, around: [0.0; MOST], for_it: [0; MOST], asked: 0 }
    }

    /// What the nearest neighbours of a point say, and how far surfaces part among them.
    fn heard(of: &impl Labelling, i: u32) -> (Self, f64) {
        let near = of.neighbours(i);
        let mut met = Self::of(of, i);
        let parting = met.parting(of, i, near);
        met.ask(of, near, if parting > sharp() { SHARP_CUT.get() } else { unassigned() });
        (met, parting)
    }

    /// Adds what points say, each at most `cut`.
    fn ask(&mut self, of: &impl Labelling, points: &[u32], cut: f64) {
        for points in points.chunks(K) {
            // Mostly two surfaces meet: the table is no larger than it need be.
            match self.len {
                ..=2 => self.ask_few::<2>(of, points, cut),
                3..=5 => self.ask_few::<5>(of, points, cut),
                _ => self.ask_few::<MOST>(of, points, cut),
            }
        }
    }

    fn ask_few<const M: usize>(&mut self, of: &impl Labelling, points: &[u32], cut: f64) {
        let n = points.len();
        let mut at = [Vec3::zeros(); K];
        at.iter_mut().zip(points).for_each(|(p, &j)| *p = *of.point(j));
        let mut sq = [[0.0; K]; M];
        let mut least = [f64::INFINITY; K];
        let inverse = of.inverse();
        for (sq, &l) in sq.iter_mut().zip(&self.labels[..self.len]) {
            of.ruler(l).distances(&at[..n], sq);
            for (sq, least) in sq[..n].iter_mut().zip(&mut least) {
                *sq = sq.powi(2) * inverse;
                *least = least.min(*sq);
            }
        }
        for c in 0..self.len {
            self.around[c] +=
                sq[c][..n].iter().zip(&least).map(|(sq, least)| (sq - least).min(cut)).sum::<f64>();
            let l = self.labels[c];
            self.for_it[c] += points.iter().filter(|&&j| of.label(j) == l).count() as u32;
        }
        self.asked += n as u32;
    }

    /// By how much the evidence for the best label exceeds that for the next.
    fn margin(&self) -> f64 {
        let mut best = [f64::INFINITY; 2];
        for e in self.energies().iter().map(|e| e.evidence) {
            best = if e < best[0] { [e, best[0]] } else { [best[0], best[1].min(e)] };
        }
        best[1] - best[0]
    }

    /// Of the labels within reach.
    fn energies(&self) -> Energies {
        let (mut all, mut len) = ([Energy::default(); MOST], 0);
        for c in (0..self.len).filter(|&c| self.own[c] <= unassigned()) {
            let others = (self.asked - self.for_it[c]) as f64;
            let evidence = self.own[c] + self.around[c];
            all[len] =
                Energy { label: self.labels[c], evidence, against: DISAGREEMENT.get() * others };
            len += 1;
        }
        Energies { all, len }
    }

    /// By how much the two nearest surfaces part within the neighbourhood if they meet at the point, squared and in
    /// sigmas: much where they meet at an edge that single neighbours see.
    fn parting(&self, of: &impl Labelling, i: u32, near: &[u32]) -> f64 {
        let (true, Some(&middle)) = (self.len > 1, near.get(near.len() / 2)) else { return 0.0 };
        // The nearest, and the nearest of the others; the first where several are as near.
        let nearest = |but: usize| {
            let others = (0..self.len).filter(|&c| c != but);
            others.min_by(|&a, &b| self.own[a].total_cmp(&self.own[b])).unwrap_or(0)
        };
        let a = nearest(usize::MAX);
        let p = of.point(i);
        let sq_reach = (of.point(middle) - p).norm_squared();
        let [a, b] = [a, nearest(a)].map(|c| of.ruler(self.labels[c]).shape().offset(p).normal);
        a.cross(&b).norm_squared() * sq_reach * of.inverse()
    }
}
