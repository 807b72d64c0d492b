//! What a boundary representation is made from: the regions' surfaces and points.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use rayon::prelude::*;

use super::near::Near;
use super::sheet::Sheet;
use crate::fit::constant::constants;
use crate::geometry::{Surface, Vec3};
use crate::segment::{Continuity, Region};

constants! {
    /// Points of a region that tell its spacing.
    ASKED: usize = 100, Effort("points looked at");
    /// Points that they are compared with.
    COMPARED: usize = 5000, Effort("points looked at");
    /// Gaps about an axis up to this many spacings are none.
    GAP: f64 = 4.0, Trial(4.0, 4.0);
    /// The largest such gap in radians, where a tube is hardly wider than the spacing.
    MOST_GAP: f64 = 1.0, Trial(1.0, 1.0);
    /// Labels beside a smooth joint are looked for this many spacings away at most, however far off they may be.
    FUZZY: f64 = 8.0, Trial(8.0, 8.0);
}

/// A segmentation's regions and points.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// The points.
    pub points: &'a [Vec3],
    /// The label of each.
    pub labels: &'a [i32],
    /// The regions; their place is their label.
    pub regions: &'a [Region],
    /// Standard deviation of the points' noise.
    pub noise: f64,
}

/// The regions' surfaces and points about the model's centre.
pub struct Part {
    /// The middle of the points' box: all else is told from here.
    pub centre: Vec3,
    /// The surface of each region; none for those that have no parameters here.
    pub sheets: Vec<Option<Sheet>>,
    /// The points of each region.
    pub points: Vec<Vec<Vec3>>,
    /// Their spacing: the median distance to the fourth neighbour.
    pub spacing: Vec<f64>,
    /// The median spacing over all points.
    pub usual: f64,
    /// All points, by place.
    pub near: Near,
    /// How far from a smooth joint labels may be off, for the regions that meet in one.
    pub smooth: BTreeMap<[usize; 2], f64>,
    /// Standard deviation of the points' noise.
    pub noise: f64,
}

impl Part {
    /// The part of a segmentation.
    pub fn of(source: &Source) -> Self {
        let n = source.regions.len();
        let bound = |fold: fn(&Vec3, &Vec3) -> Vec3, from: f64| {
            source.points.iter().fold(Vec3::repeat(from), |m, p| fold(&m, p))
        };
        let centre = match source.points.is_empty() {
            true => Vec3::zeros(),
            false => (bound(Vec3::inf, f64::INFINITY) + bound(Vec3::sup, f64::NEG_INFINITY)) / 2.0,
        };
        let mut points: Vec<Vec<Vec3>> = vec![Vec::new(); n];
        for (p, l) in source.points.iter().zip(source.labels) {
            if let Some(own) = usize::try_from(*l).ok().and_then(|l| points.get_mut(l)) {
                own.push(p - centre);
            }
        }
        let spacing: Vec<f64> = points.par_iter().map(|p| spacing(p)).collect();
        let usual = weighted_median(&spacing, &points);
        let sheets = source.regions.par_iter().zip(&points).zip(&spacing);
        let sheets: Vec<Option<Sheet>> = sheets
            .map(|((r, p), s)| {
                let surface = r.surface.as_ref().filter(|_| !p.is_empty())?;
                Some(charted(Sheet::new(surface, &centre), p, *s))
            })
            .collect();
        let labelled = points.iter().enumerate().filter(|(l, _)| sheets[*l].is_some());
        let all = labelled.flat_map(|(l, p)| p.iter().map(move |p| (*p, l as u32)));
        let near = Near::of(all, 3.0 * usual);
        Self {
            centre,
            sheets,
            spacing,
            usual,
            near,
            smooth: smooth(source.regions),
            noise: source.noise,
            points,
        }
    }

    /// How far beyond the border between two regions points of either are looked for.
    pub fn reach(&self, pair: [usize; 2]) -> f64 {
        let spacing = self.spacing[pair[0]].max(self.spacing[pair[1]]).min(3.0 * self.usual);
        let fuzzy = self.smooth.get(&pair).copied().unwrap_or(0.0);
        3.0 * spacing + fuzzy.min(FUZZY.get() * self.usual)
    }
}

/// The regions that meet smoothly, the smaller first, and how far labels may be off there.
fn smooth(regions: &[Region]) -> BTreeMap<[usize; 2], f64> {
    let joints = regions.iter().flat_map(|r| {
        let smooth = r.neighbours.iter().filter(|n| n.continuity == Continuity::G1);
        smooth.map(|n| ([r.id.min(n.region), r.id.max(n.region)], n.resolution))
    });
    joints.collect()
}

/// Median distance to the fourth neighbour.
fn spacing(points: &[Vec3]) -> f64 {
    let stride = points.len().div_ceil(COMPARED.get()).max(1);
    let few: Vec<Vec3> = points.iter().step_by(stride).copied().collect();
    let asked = few.len().div_ceil(ASKED.get()).max(1);
    let fourth = |p: &Vec3| {
        let mut sq: Vec<f64> = few.iter().map(|q| (q - p).norm_squared()).collect();
        if sq.len() < 5 {
            return sq.into_iter().fold(0.0, f64::max);
        }
        *sq.select_nth_unstable_by(4, f64::total_cmp).1
    };
    let mut all: Vec<f64> = few.iter().step_by(asked).map(fourth).collect();
    if all.is_empty() {
        return 0.0;
    }
    let middle = all.len() / 2;
    (*all.select_nth_unstable_by(middle, f64::total_cmp).1 / stride as f64).sqrt()
}

fn weighted_median(spacing: &[f64], points: &[Vec<Vec3>]) -> f64 {
    let mut all: Vec<(f64, usize)> =
        spacing.iter().copied().zip(points.iter().map(Vec::len)).collect();
    all.retain(|(s, _)| *s > 0.0);
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = all.iter().map(|a| a.1).sum::<usize>() / 2;
    let mut sum = 0;
    let found = all.iter().find(|a| {
        sum += a.1;
        sum >= half
    });
    found.map_or(1.0, |a| a.0)
}

/// A sheet whose chart begins in the widest gap between the points, with lengths as they are about the points' middle.
fn charted(mut sheet: Sheet, points: &[Vec3], spacing: f64) -> Sheet {
    let mean = points.iter().sum::<Vec3>() / points.len() as f64;
    match &sheet.surface {
        Surface::Plane(_) => return sheet,
        Surface::Sphere(_) | Surface::Ellipsoid(_) => {
            let toward = |y: Vec3| y.try_normalize(1e-3).unwrap_or_else(Vec3::z);
            let (w, radius) = match &sheet.surface {
                Surface::Sphere(s) => (toward((mean - s.center) / s.radius), s.radius),
                Surface::Ellipsoid(s) => {
                    let unit =
                        points.iter().map(|p| sheet.on_unit(p)).sum::<Vec3>() / points.len() as f64;
                    (toward(unit), s.semi_axes[1])
                }
                _ => (Vec3::z(), 1.0),
            };
            let (u, v) = crate::geometry::perpendicular_frame(&w);
            sheet.frame = crate::geometry::Mat3::from_columns(&[u, v, w]);
            sheet.scale = [radius; 2];
            return sheet;
        }
        Surface::Cylinder(s) => sheet.scale = [s.radius, 1.0],
        Surface::EllipticCylinder(s) => {
            sheet.scale = [(s.semi_axes[0] + s.semi_axes[1]) / 2.0, 1.0]
        }
        Surface::Cone(s) => {
            let away = points.iter().map(|p| (p - s.apex).dot(&s.axis_direction)).sum::<f64>();
            let radius = (away / points.len() as f64).abs() * s.half_angle.tan();
            sheet.scale = [radius.max(1e-12), 1.0];
        }
        Surface::Torus(s) => sheet.scale = [s.major_radius, s.minor_radius],
    }
    for k in 0..2 {
        if sheet.angular()[k] {
            let angles = points.iter().map(|p| sheet.parameters(p)[k]);
            let (start, gap) = widest_gap(angles.collect());
            sheet.start[k] = start;
            sheet.wraps[k] = gap <= (GAP.get() * spacing / sheet.scale[k]).min(MOST_GAP.get());
        }
    }
    sheet
}

/// The middle of the widest gap between angles, and its width.
fn widest_gap(mut angles: Vec<f64>) -> (f64, f64) {
    angles.sort_unstable_by(f64::total_cmp);
    let (Some(&first), Some(&last)) = (angles.first(), angles.last()) else { return (0.0, TAU) };
    let mut widest = (last, first + TAU - last);
    for pair in angles.windows(2) {
        if pair[1] - pair[0] > widest.1 {
            widest = (pair[0], pair[1] - pair[0]);
        }
    }
    (widest.0 + widest.1 / 2.0, widest.1)
}
