use std::collections::BTreeMap;

use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::finish::normal_equations;
use crate::segment::label::around::Around;
use crate::segment::label::shares;
use crate::segment::label::spread::{self, spread_by};
use crate::segment::prepare::distinct::drop_copies;
use crate::segment::prepare::morton::{Codes, order_by};
use crate::segment::report::tally::tallies;
use crate::segment::tiles::guide::Guide;
use crate::segment::tiles::sums::Sums;
use crate::segment::{Cancelled, Monitor};

/// What has come of a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Labelled {
    /// Each point's surface, -1 = none.
    pub labels: Vec<i32>,
    /// The sums of each surface.
    pub sums: Vec<Sums>,
    /// Distinct points.
    pub distinct: usize,
}

/// Labels the points of a tile by a guide to the cloud; `None` where the guide cannot be followed.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn label(
    tile: &[Vec3],
    guide: &Guide,
    monitor: &dyn Monitor,
) -> Result<Option<Labelled>, Cancelled> {
    let (Some(around), Some(shapes)) = (guide.around(), guide.shapes()) else { return Ok(None) };
    let (points, places) = ordered(tile, guide, monitor)?;
    let mut of_all = by_scatter(&points, guide, &around, &shapes, monitor)?;
    let lost = take_far(&points, &mut of_all, &shapes, &guide.reaches());
    let normals = normal_equations(&points, &of_all, &shapes, monitor);
    monitor.check()?;
    let tallies = tallies(&points, &of_all.labels, &shapes, monitor);
    monitor.check()?;
    let mut sums: Vec<Sums> =
        normals.iter().zip(&tallies).map(|(normal, tally)| Sums::of(normal, tally)).collect();
    let mut labels = vec![-1; tile.len()];
    for (l, &place) in labels.iter_mut().zip(&places) {
        *l = of_all.labels[place as usize];
        if let Ok(l) = usize::try_from(*l) {
            sums[l].count += 1;
        } else if let Some(&l) = lost.get(&place) {
            sums[l].rejected_count += 1;
        }
    }
    lost.values().for_each(|&l| sums[l].rejected += 1);
    Ok(Some(Labelled { labels, sums, distinct: points.len() }))
}

/// The tile's distinct points relative to the cloud's centre in the order of their codes, and where each of its points
/// stands among them.
fn ordered(
    tile: &[Vec3],
    guide: &Guide,
    monitor: &dyn Monitor,
) -> Result<(Vec<Vec3>, Vec<u32>), Cancelled> {
    let centre = guide.centre();
    let moved: Vec<Vec3> = tile.iter().map(|p| p - centre).collect();
    let order = order_by(&moved, &guide.codes(), monitor)?;
    let mut points: Vec<Vec3> = order.iter().map(|&i| moved[i as usize]).collect();
    let places = drop_copies(&mut points, &order);
    Ok((points, places))
}

/// Labels of points, those of the surfaces with the least scatter first: what these leave is given to the others.
fn by_scatter(
    points: &[Vec3],
    guide: &Guide,
    around: &Around,
    shapes: &[Shape],
    monitor: &dyn Monitor,
) -> Result<shares::Labelled, Cancelled> {
    let (codes, sigmas, of_guide) = (guide.codes(), guide.sigmas(), guide.points());
    let mut rising = sigmas.clone();
    rising.sort_by(f64::total_cmp);
    rising.dedup();
    let mut labels = vec![-1; points.len()];
    let mut shares = Vec::new();
    for sigma in rising {
        let left: Vec<u32> = (0..points.len() as u32).filter(|&i| labels[i as usize] < 0).collect();
        let own: Vec<Vec3> = left.iter().map(|&i| points[i as usize]).collect();
        let around = around.only(|l| sigmas[l as usize] == sigma);
        let places = places(&of_guide, &own, &codes);
        let guide = spread::Guide { points: &of_guide, places: &places, around: &around };
        let found = spread_by(&own, &guide, shapes, sigma, monitor)?;
        left.iter().zip(found.labels).for_each(|(&i, l)| labels[i as usize] = l);
        shares.extend(found.shares.into_iter().map(|(k, share)| (left[k as usize], share)));
    }
    shares.sort_unstable_by_key(|share| share.0);
    Ok(shares::Labelled { labels, shares })
}

/// Where each of the guide's points stands among others in the order of their codes: -1 before the first, their number
/// after the last.
fn places(guide: &[Vec3], points: &[Vec3], codes: &Codes) -> Vec<i64> {
    let codes_of: Vec<u64> = points.iter().map(|p| codes.of_point(p)).collect();
    let mut least = -1;
    let place = |p: &Vec3| {
        let place = codes_of.partition_point(|c| *c < codes.of_point(p)) as i64;
        // one in front of the first stands before it
        let before = place == 0 && codes_of.first().is_some_and(|c| *c != codes.of_point(p));
        least = least.max(if before { -1 } else { place });
        least
    };
    guide.iter().map(place).collect()
}

/// Takes the points from surfaces that lie further from these than their reach. Those points, with the surface.
fn take_far(
    points: &[Vec3],
    labelled: &mut shares::Labelled,
    shapes: &[Shape],
    reaches: &[f64],
) -> BTreeMap<u32, usize> {
    let rulers: Vec<Ruler> = shapes.iter().map(Ruler::of).collect();
    let mut lost = BTreeMap::new();
    for (i, (p, l)) in points.iter().zip(&mut labelled.labels).enumerate() {
        let Ok(k) = usize::try_from(*l) else { continue };
        if rulers[k].distance(p).abs() > reaches[k] {
            lost.insert(i as u32, k);
            *l = -1;
        }
    }
    labelled.shares.retain(|share| labelled.labels[share.0 as usize] >= 0);
    lost
}
