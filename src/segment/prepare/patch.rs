//! A patch of a cloud: how far its points scatter about a smooth sheet through them, or about two side by side.

use nalgebra::{Cholesky, Const, SMatrix, SVector, SymmetricEigen};

use crate::fit::constant::constants;
use crate::geometry::{Mat3, Vec3, perpendicular_frame};
use crate::segment::prepare::closest::MANY;

/// A number for each point.
type Column = [f64; MANY];
/// Normal equations of a graph quadric.
type Equations = Cholesky<f64, Const<6>>;

/// The ridge of the last fit: it only keeps the equations solvable.
const TINY: f64 = 1e-11;

/// Degrees of freedom that a quadric leaves, and a quadric with a wall.
const ONE_SHEET: f64 = (MANY - 6) as f64;
const TWO_SHEETS: f64 = (MANY - 7) as f64;

constants! {
    /// Ridge, in mean squares of columns scaled to unit reach, of the fit that turns a patch into its own frame. Two
    /// rows of points leave the tilt about them to the noise: without it the sheet stands upright on them and nothing
    /// is left.
    RIDGE: f64 = 1e-4, Trial(1e-4, 1e-4);
    /// Nearest points that tell whether the cloud is as dense in all directions.
    pub INNER: usize = 9, Trial(9.0, 9.0);
    /// Times that points change sides.
    REASSIGNED: usize = 6, Effort("rounds of reassignment");
    /// Share of the scatter about one sheet that is left about two: halving normal residuals leaves 0.6.
    LEFT: f64 = 0.3, Trial(0.3, 0.3);
    /// Points of 24 on the smaller sheet at least.
    SIDE: usize = 4, Trial(4.0, 4.0);
    /// Points of 24 whose nearest one along the sheets is on the other: an edge's two faces lie beside each other, a
    /// wall's on top of each other.
    OPPOSITE: usize = 6, Trial(6.0, 6.0);
    /// Thickness of a wall in spacings at least: thinner ones are noise as like as not.
    WALL: f64 = 0.15, Trial(0.15, 0.15);
    /// Scatter that two sheets leave one, in reaches: the smaller holds 15 % of the points, the wall is 0.15 spacings
    /// thick, and a quadric may follow half of that.
    LEAST_OF_SHEETS: f64 = 0.01, Derived("sqrt(0.15 * 0.85) * 0.15 * 0.512 / 2, less a margin");
}

/// The spacing of points spread evenly over a disc, in root mean square distances from its centre: sqrt(2 pi / 24).
const SPACING: f64 = 0.512;

/// A patch of 24 points.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Standard deviation about a graph quadric.
    pub scatter: f64,
    /// The same about two sheets side by side, where these are there.
    pub of_sheets: Option<f64>,
    /// The same about a graph quadric of the nearest half of the points alone.
    pub nearer: f64,
    /// Root mean square distance of the points from their centre.
    pub reach: f64,
    /// Variance across the direction in which points scatter most over that along it: 1 for a disc, 0 for a line.
    pub breadth: f64,
    /// The same of the nearest few.
    pub inner_breadth: f64,
    /// The quadric's normal at the patch's place.
    pub normal: Vec3,
}

impl Patch {
    /// The patch of points relative to its place, nearest first; `None` where a quadric does not fit them.
    pub fn of(points: &[Vec3; MANY]) -> Option<Self> {
        patch(points)
    }

    #[inline(always)]
    fn measured(points: &[Vec3; MANY]) -> Option<Self> {
        let (mean_sq, breadth, normal) = spread(points);
        let scale = points.iter().map(Vec3::norm_squared).fold(0.0, f64::max).sqrt();
        if !(scale > 0.0 && scale.is_finite()) {
            return None;
        }
        let q = points.map(|p| p / scale);
        let rough = Sheet::of(&q, MANY, normal, RIDGE.get())?;
        let fine = Sheet::of(&q, MANY, rough.normal, TINY)?;
        let rss = dot(&fine.left, &fine.left);
        let reach = mean_sq.sqrt();
        let scatter = (rss / ONE_SHEET).sqrt();
        let most = LEFT.get() * scatter;
        let wall = WALL.get() * SPACING * reach / scale;
        let of_sheets = (scatter > LEAST_OF_SHEETS.get() * reach / scale)
            .then(|| fine.two_sheets(&rough.heights, most, wall))
            .flatten();
        let [scatter, of_sheets] = [Some(scatter), of_sheets].map(|s| s.map(|s| s * scale));
        let nearer = Sheet::of(&q, NEARER, rough.normal, TINY).map_or(f64::INFINITY, |s| {
            scale * (dot(&s.left, &s.left) / (NEARER - 6) as f64).sqrt()
        });
        let inner_breadth = inner_breadth(points);
        let normal = fine.normal;
        let scatter = scatter.filter(|s| s.is_finite())?;
        Some(Self { scatter, of_sheets, nearer, reach, breadth, inner_breadth, normal })
    }

    /// Scatter over reach: how thick the patch is.
    pub fn thickness(&self) -> f64 {
        self.scatter / self.reach
    }
}

/// Breadth of the nearest points of a patch.
pub fn inner_breadth(points: &[Vec3]) -> f64 {
    spread(&points[..INNER.get().min(points.len())]).1
}

#[multiversion::multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn patch(points: &[Vec3; MANY]) -> Option<Patch> {
    Patch::measured(points)
}

/// Mean square distance of points from their centre, variance across the direction of most scatter over that along
/// it, and the direction of least scatter.
#[inline(always)]
pub fn spread(points: &[Vec3]) -> (f64, f64, Vec3) {
    let n = points.len() as f64;
    let mean = points.iter().sum::<Vec3>() / n;
    let scatter: Mat3 = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let e = SymmetricEigen::new(scatter / n);
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| e.eigenvalues[*a].total_cmp(&e.eigenvalues[*b]));
    let [least, across, along] = order;
    let along = e.eigenvalues[along].max(f64::MIN_POSITIVE);
    let breadth = e.eigenvalues[across].max(0.0) / along;
    (e.eigenvalues.sum().max(0.0), breadth, e.eigenvectors.column(least).into_owned())
}

/// The nearest half of a patch's points.
pub const NEARER: usize = MANY / 2;

/// A graph quadric through the nearest `used` of the points of a patch of unit reach.
struct Sheet {
    columns: [Column; 6],
    equations: Equations,
    /// Heights over the plane at right angles to the frame's third direction, and what the quadric leaves of them.
    heights: Column,
    left: Column,
    /// The quadric's normal at the origin.
    normal: Vec3,
}

impl Sheet {
    #[inline(always)]
    fn of(q: &[Vec3; MANY], used: usize, up: Vec3, ridge: f64) -> Option<Self> {
        let (u, v) = perpendicular_frame(&up);
        let one: Column = std::array::from_fn(|k| if k < used { 1.0 } else { 0.0 });
        let [x, y, heights] = [u, v, up].map(|e| std::array::from_fn(|k| one[k] * q[k].dot(&e)));
        let product = |a: &Column, b: &Column| std::array::from_fn(|k| a[k] * b[k]);
        let columns = [one, x, y, product(&x, &x), product(&x, &y), product(&y, &y)];
        let mut a = SMatrix::<f64, 6, 6>::zeros();
        for r in 0..6 {
            for c in 0..=r {
                a[(r, c)] = dot(&columns[r], &columns[c]);
                a[(c, r)] = a[(r, c)];
            }
            a[(r, r)] += ridge * MANY as f64;
        }
        let equations = a.cholesky()?;
        let c = equations.solve(&projected(&columns, &heights));
        let left = without(&columns, &heights, &c);
        let normal = (up - u * c[1] - v * c[2]).normalize();
        normal.x.is_finite().then_some(Self { columns, equations, heights, left, normal })
    }

    /// Standard deviation about two sheets alike, where that is below `most` and they are a wall more than `wall`
    /// thick; sides are first told by `flat`, heights over a plane, and by the quadric.
    #[inline(always)]
    fn two_sheets(&self, flat: &Column, most: f64, wall: f64) -> Option<f64> {
        let mean = flat.iter().sum::<f64>() / MANY as f64;
        let starts = [flat.map(|h| side(h - mean)), self.left.map(side)];
        let ends = starts.into_iter().filter_map(|s| self.settle(s));
        let (rss, half, sides) = ends.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let scatter = (rss.max(0.0) / TWO_SHEETS).sqrt();
        let above = sides.iter().filter(|s| **s > 0.0).count();
        let both = above >= SIDE.get() && MANY - above >= SIDE.get();
        (scatter < most
            && 2.0 * half.abs() > wall
            && both
            && self.opposite(&sides) >= OPPOSITE.get())
        .then_some(scatter)
    }

    /// What is left of the heights' squares, half the wall and the sides once points have changed these.
    #[inline(always)]
    fn settle(&self, mut sides: Column) -> Option<(f64, f64, Column)> {
        let mut best = None;
        for _ in 0..REASSIGNED.get() {
            let c = self.equations.solve(&projected(&self.columns, &sides));
            let own = without(&self.columns, &sides, &c);
            let square = dot(&own, &own);
            if square < 1e-3 {
                break;
            }
            let half = dot(&self.left, &own) / square;
            let rss = dot(&self.left, &self.left) - half * half * square;
            let middle: Column = std::array::from_fn(|k| self.left[k] + half * (sides[k] - own[k]));
            best = Some((rss, half, sides));
            let next = middle.map(side);
            if next == sides {
                break;
            }
            sides = next;
        }
        best
    }

    /// Points whose nearest one along the sheet is on the other side.
    #[inline(always)]
    fn opposite(&self, sides: &Column) -> usize {
        let [_, x, y, ..] = &self.columns;
        let sq = |a: usize, b: usize| (x[a] - x[b]).powi(2) + (y[a] - y[b]).powi(2);
        let nearest = |a: usize| {
            let others = (0..MANY).filter(|b| *b != a);
            others.min_by(|b, c| sq(a, *b).total_cmp(&sq(a, *c)))
        };
        (0..MANY).filter(|&a| nearest(a).is_some_and(|b| sides[a] != sides[b])).count()
    }
}

#[inline(always)]
fn side(height: f64) -> f64 {
    if height < 0.0 { -1.0 } else { 1.0 }
}

/// Products of a column with each of six.
#[inline(always)]
fn projected(columns: &[Column; 6], b: &Column) -> SVector<f64, 6> {
    SVector::from_fn(|r, _| dot(&columns[r], b))
}

/// What the columns, each taken so many times, leave of another.
#[inline(always)]
fn without(columns: &[Column; 6], b: &Column, c: &SVector<f64, 6>) -> Column {
    let mut left = *b;
    for (c, column) in c.iter().zip(columns) {
        for (l, v) in left.iter_mut().zip(column) {
            *l -= c * v;
        }
    }
    left
}

/// The scalar product, in eight parts whatever the machine.
#[inline(always)]
fn dot(a: &Column, b: &Column) -> f64 {
    let mut parts = [0.0; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for l in 0..8 {
            parts[l] += a[l] * b[l];
        }
    }
    parts.iter().sum()
}
