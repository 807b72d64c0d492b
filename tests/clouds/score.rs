//! Scores of a labelling against a cloud's truth.

use std::{collections::BTreeSet, fmt, num::NonZeroUsize};

use conicoid::geometry::{Quadric, SurfaceType, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

use super::Cloud;

/// A reported surface, at the place of its label; a torus has no coefficients.
pub type Reported = (SurfaceType, Option<[f64; 10]>);

/// How good a result is.
#[derive(Clone, Debug, Default)]
pub struct Score {
    /// Mean over the true surfaces of the IoU with the region matched to each.
    pub miou: f64,
    /// `miou` over that of an oracle that knows the surfaces and labels each point with the nearest.
    pub ratio: f64,
    /// The worst IoU of a true surface.
    pub worst_iou: f64,
    /// Regions reported, tori left out.
    pub regions: usize,
    /// True surfaces.
    pub surfaces: usize,
    /// Share of the points of no quadric that were labelled.
    pub false_points: f64,
    /// The same for the oracle.
    pub oracle_false: f64,
    /// Share of the matched surfaces (IoU > 0.5) with the right type.
    pub type_ok: f64,
    /// For each matched surface: distance between reported and true surface, over the information
    /// limit sigma sqrt(d / n) of a fit to perfectly labelled points.
    pub efficiencies: Vec<f64>,
}

impl fmt::Display for Score {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.surfaces == 0 {
            return write!(f, "regions {:3}/  0 false {:.3}", self.regions, self.false_points);
        }
        let mut sorted = self.efficiencies.clone();
        sorted.sort_by(f64::total_cmp);
        let cell = |value: Option<&f64>| value.map_or("-".into(), |v| format!("{v:.2}"));
        write!(
            f,
            "ratio {:.3} worst {:.3} regions {:3}/{:3} type_ok {:.3} eff {}/{} false {:.3}/{:.3}",
            self.ratio,
            self.worst_iou,
            self.regions,
            self.surfaces,
            self.type_ok,
            cell(sorted.get(sorted.len() / 2)),
            cell(sorted.last()),
            self.false_points,
            self.oracle_false
        )
    }
}

/// Scores `labels` (one a point, -1 = none) and the surfaces reported for them.
pub fn score(cloud: &Cloud, labels: &[i32], reported: &[Reported]) -> Score {
    let scored = |values: &[i32]| -> Vec<i32> {
        let pairs = cloud.labels.iter().zip(values);
        pairs.filter(|(truth, _)| **truth >= -1).map(|(_, v)| *v).collect()
    };
    // What is on no quadric may be a torus.
    let is_torus = |l: i32| {
        let reported = usize::try_from(l).ok().and_then(|l| reported.get(l));
        reported.is_some_and(|r| r.0 == SurfaceType::Torus)
    };
    let labels: Vec<i32> = labels.iter().map(|&l| if is_torus(l) { -1 } else { l }).collect();
    let (truth, labels, oracle) =
        (scored(&cloud.labels), scored(&labels), scored(&oracle_labels(cloud)));
    let surfaces = cloud.surfaces.len();
    let table = Table::new(&truth, &labels, surfaces);
    let matches = table.best_matches();
    let miou = table.mean(&matches);
    let oracle_table = Table::new(&truth, &oracle, surfaces);
    let found: BTreeSet<_> = labels.iter().filter(|l| **l >= 0).collect();
    let ious = matches.iter().enumerate().map(|(i, m)| m.map_or(0.0, |j| table.iou(i, j)));
    let mut score = Score {
        miou,
        ratio: miou / oracle_table.mean(&oracle_table.best_matches()),
        worst_iou: ious.fold(1.0, f64::min),
        regions: found.len(),
        surfaces,
        false_points: false_share(&truth, &labels),
        oracle_false: false_share(&truth, &oracle),
        ..Score::default()
    };
    score.judge_surfaces(cloud, &table, &matches, reported);
    score
}

impl Score {
    fn judge_surfaces(
        &mut self,
        cloud: &Cloud,
        table: &Table,
        matches: &[Option<usize>],
        reported: &[Reported],
    ) {
        let (mut matched, mut right) = (0u32, 0);
        for (i, truth) in cloud.surfaces.iter().enumerate() {
            let Some(j) = matches[i].filter(|&j| table.iou(i, j) > 0.5) else { continue };
            let Some((found, Some(coefficients))) = reported.get(j) else { continue };
            let true_type = truth.surface.surface_type();
            matched += 1;
            right += u32::from(*found == true_type);
            if cloud.sigma > 0.0 {
                let limit = cloud.sigma * (freedom(true_type) / truth.points as f64).sqrt();
                self.efficiencies.push(rms_between(cloud, i, coefficients) / limit);
            }
        }
        self.type_ok = f64::from(right) / f64::from(matched.max(1));
    }
}

/// Degrees of freedom of a surface of that type.
fn freedom(surface_type: SurfaceType) -> f64 {
    match surface_type {
        SurfaceType::Plane => 3.0,
        SurfaceType::Sphere => 4.0,
        SurfaceType::Cylinder => 5.0,
        SurfaceType::Cone => 6.0,
        SurfaceType::EllipticCylinder => 7.0,
        _ => 9.0,
    }
}

fn points_of(cloud: &Cloud, label: usize) -> Vec<Vec3> {
    let pairs = cloud.points.iter().zip(&cloud.labels);
    pairs.filter(|(_, l)| **l == label as i32).map(|(p, _)| *p).collect()
}

fn mean_point(points: &[Vec3]) -> Vec3 {
    points.iter().sum::<Vec3>() / points.len().max(1) as f64
}

/// Root mean square distance from the true surface `label`, where its points lie, to another quadric.
fn rms_between(cloud: &Cloud, label: usize, coefficients: &[f64; 10]) -> f64 {
    let mut points = points_of(cloud, label);
    let origin = mean_point(&cloud.points);
    let Some(truth) = cloud.surfaces[label].surface.quadric() else { return 0.0 };
    let truth = truth.moved_to(&origin);
    let reported = Quadric(*coefficients).moved_to(&origin);
    for p in &mut points {
        *p -= origin;
        for _ in 0..4 {
            let gradient = truth.gradient(p);
            *p -= gradient * (truth.value(p) / gradient.norm_squared());
        }
    }
    let sum: f64 = points.iter().map(|p| reported.distance(p).powi(2)).sum();
    (sum / points.len().max(1) as f64).sqrt()
}

/// Each point's nearest true surface, within four sigma, among those whose points lie near it.
fn oracle_labels(cloud: &Cloud) -> Vec<i32> {
    let tolerance = (4.0 * cloud.sigma).max(1e-6);
    let origin = mean_point(&cloud.points);
    let mut best = vec![(f64::INFINITY, -1); cloud.points.len()];
    for (label, s) in cloud.surfaces.iter().enumerate() {
        let own = Near::new(&points_of(cloud, label));
        let Some(quadric) = s.surface.quadric() else { continue };
        let quadric = quadric.moved_to(&origin);
        for (p, best) in cloud.points.iter().zip(&mut best) {
            if own.outside_box(p) {
                continue;
            }
            let distance = quadric.distance(&(p - origin));
            if distance < best.0 && distance <= tolerance && own.is_near(p) {
                *best = (distance, label as i32);
            }
        }
    }
    best.into_iter().map(|(_, label)| label).collect()
}

/// Says whether a place is within four point spacings of a surface's points.
struct Near {
    tree: Option<ImmutableKdTree<f64, 3>>,
    reach: f64,
    low: Vec3,
    high: Vec3,
}

impl Near {
    fn new(points: &[Vec3]) -> Self {
        let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        for p in points {
            (low, high) = (low.inf(p), high.sup(p));
        }
        let entries: Vec<[f64; 3]> = points.iter().map(|&p| p.into()).collect();
        let tree = ImmutableKdTree::new_from_slice(&entries).ok();
        let mut near = Self { tree, reach: 0.0, low, high };
        let step = (points.len() / 500).max(1);
        let mut spacings: Vec<_> = points.iter().step_by(step).map(|p| near.spacing(p)).collect();
        spacings.sort_by(f64::total_cmp);
        near.reach = 4.0 * spacings.get(spacings.len() / 2).copied().unwrap_or_default();
        near.low.add_scalar_mut(-near.reach);
        near.high.add_scalar_mut(near.reach);
        near
    }

    /// Distance from one of the points to the nearest other one.
    fn spacing(&self, p: &Vec3) -> f64 {
        let (Some(tree), Some(two)) = (&self.tree, NonZeroUsize::new(2)) else { return 0.0 };
        let query: [f64; 3] = (*p).into();
        let nearest = tree.query(&query).nearest_n::<SquaredEuclidean<f64>>(two).execute();
        nearest.last().map_or(0.0, |n| n.distance.sqrt())
    }

    fn outside_box(&self, p: &Vec3) -> bool {
        (0..3).any(|i| p[i] < self.low[i] || p[i] > self.high[i])
    }

    fn is_near(&self, p: &Vec3) -> bool {
        let Some(tree) = &self.tree else { return false };
        let query: [f64; 3] = (*p).into();
        let nearest = tree.query(&query).nearest_one::<SquaredEuclidean<f64>>().execute();
        nearest.distance.sqrt() < self.reach
    }
}

fn false_share(truth: &[i32], labels: &[i32]) -> f64 {
    let none: Vec<_> = truth.iter().zip(labels).filter(|(t, _)| **t < 0).collect();
    let taken = none.iter().filter(|(_, l)| **l >= 0).count();
    taken as f64 / none.len().max(1) as f64
}

/// How many points each pair of a true surface and a region shares.
struct Table {
    common: Vec<Vec<f64>>,
    truth: Vec<f64>,
    found: Vec<f64>,
}

impl Table {
    fn new(truth: &[i32], labels: &[i32], surfaces: usize) -> Self {
        let regions = labels.iter().max().map_or(0, |&l| (l + 1).max(0) as usize);
        let mut table = Self {
            common: vec![vec![0.0; regions]; surfaces],
            truth: vec![0.0; surfaces],
            found: vec![0.0; regions],
        };
        for (&t, &l) in truth.iter().zip(labels) {
            if t >= 0 {
                table.truth[t as usize] += 1.0;
            }
            if l >= 0 {
                table.found[l as usize] += 1.0;
            }
            if t >= 0 && l >= 0 {
                table.common[t as usize][l as usize] += 1.0;
            }
        }
        table
    }

    /// Intersection over union.
    fn iou(&self, surface: usize, region: usize) -> f64 {
        let common = self.common[surface][region];
        common / (self.truth[surface] + self.found[region] - common).max(1.0)
    }

    fn mean(&self, matches: &[Option<usize>]) -> f64 {
        let ious = matches.iter().enumerate().filter_map(|(i, m)| m.map(|j| self.iou(i, j)));
        ious.sum::<f64>() / matches.len().max(1) as f64
    }

    /// The assignment of regions to surfaces with the largest sum of IoUs (the Hungarian method in
    /// Jonker and Volgenant's form: shortest augmenting paths over dual prices).
    fn best_matches(&self) -> Vec<Option<usize>> {
        let rows = self.truth.len();
        // a surface may stay without a region: one free column for each
        let columns = self.found.len() + rows;
        let cost = |i: usize, j: usize| if j < self.found.len() { -self.iou(i, j) } else { 0.0 };
        let (mut row_price, mut column_price) = (vec![0.0; rows], vec![0.0; columns]);
        let mut row_of: Vec<Option<usize>> = vec![None; columns];
        for start in 0..rows {
            let mut reach = vec![f64::INFINITY; columns];
            let mut from = vec![None; columns];
            let mut done = vec![false; columns];
            let (mut row, mut column) = (start, None);
            loop {
                let base = column.map_or(0.0, |j: usize| reach[j]);
                for j in (0..columns).filter(|&j| !done[j]) {
                    let length = base + cost(row, j) - row_price[row] - column_price[j];
                    if length < reach[j] {
                        (reach[j], from[j]) = (length, column);
                    }
                }
                let open = (0..columns).filter(|&j| !done[j]);
                let Some(next) = open.min_by(|&a, &b| reach[a].total_cmp(&reach[b])) else { break };
                done[next] = true;
                column = Some(next);
                match row_of[next] {
                    Some(r) => row = r,
                    None => break,
                }
            }
            let Some(mut end) = column else { continue };
            let total = reach[end];
            row_price[start] += total;
            for j in (0..columns).filter(|&j| done[j] && j != end) {
                column_price[j] -= total - reach[j];
                if let Some(r) = row_of[j] {
                    row_price[r] += total - reach[j];
                }
            }
            while let Some(previous) = from[end] {
                row_of[end] = row_of[previous];
                end = previous;
            }
            row_of[end] = Some(start);
        }
        let mut matches = vec![None; rows];
        for (j, row) in row_of.iter().enumerate().take(self.found.len()) {
            if let Some(i) = row {
                matches[*i] = Some(j);
            }
        }
        matches
    }
}
