//! The distinct points of a cloud.

use rayon::prelude::*;

use crate::geometry::Vec3;
use crate::segment::prepare::morton::morton_order;
use crate::segment::{Cancelled, Monitor};

/// The distinct points of a cloud in Morton order relative to their centre, that centre, and where each
/// point of the cloud stands among them. Copies of a point say nothing new, and would fill its
/// neighbourhood.
pub fn distinct_points(
    cloud: &[Vec3],
    monitor: &dyn Monitor,
) -> Result<(Vec<Vec3>, Vec3, Vec<u32>), Cancelled> {
    let order = morton_order(cloud, monitor)?;
    let mut points: Vec<Vec3> = order.par_iter().map(|&i| cloud[i as usize]).collect();
    // Summed in this order and in chunks of one size: the centre must depend neither on the order of the input
    // nor on the number of threads.
    let sums: Vec<Vec3> = points.par_chunks(4096).map(|chunk| chunk.iter().sum()).collect();
    let centre = sums.iter().sum::<Vec3>() / cloud.len() as f64;
    monitor.check()?;
    let places = drop_copies(&mut points, &order);
    points.par_iter_mut().with_min_len(4096).for_each(|p| *p -= centre);
    monitor.check()?;
    Ok((points, centre, places))
}

/// Drops copies from points in Morton order, in which the `order`-th of the cloud stand. Where each point of the
/// cloud stands then.
pub fn drop_copies(points: &mut Vec<Vec3>, order: &[u32]) -> Vec<u32> {
    let mut places = vec![0; order.len()];
    let mut last = 0;
    for (k, &i) in order.iter().enumerate() {
        if k > 0 && points[k] != points[last] {
            last += 1;
            points[last] = points[k];
        }
        places[i as usize] = last as u32;
    }
    points.truncate(last + 1);
    places
}
