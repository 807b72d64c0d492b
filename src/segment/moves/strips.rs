//! Planes that hold strips parallel to a better known plane, each at a height of its own.

use crate::fit::Shape;
use crate::geometry::Vec3;
use crate::segment::moves::directions::asked;
use crate::segment::moves::pieces::{Piece, SAMPLE, large_pieces};
use crate::segment::moves::site::Site;
use crate::segment::objective::FEW;
use crate::segment::prepare::take::take;

/// A plane for each large piece of a plane's region where they are parallel to a better known plane, at heights
/// of their own.
pub fn instead(site: &Site<'_>) -> Option<Vec<Piece>> {
    let Site { scene, families, directions, group, .. } = *site;
    let plane = site.shape();
    if group.len() < 2 * FEW.get() {
        return None;
    }
    let own = |points: &[Vec3]| families.score(*plane, points).chi2;
    let whole = take(scene, group, SAMPLE.get());
    let needed = asked(&whole, group.len());
    let joint = directions.plane(&whole, &plane.w(), needed, families)?.1;
    // Nothing is to be gained where the plane could be parallel to that one itself.
    let length = directions.length(plane, &whole, needed, families);
    if joint <= own(&whole) + length {
        return None;
    }
    let pieces = large_pieces(scene, plane, group)?;
    let along = |piece: &[u32]| {
        directions.plane(&take(scene, piece, usize::MAX), &plane.w(), needed, families)
    };
    let mut gain = length;
    let mut strips: Vec<(Shape, f64, Vec<u32>)> = Vec::with_capacity(pieces.len());
    for piece in pieces {
        if scene.cancelled() {
            return None;
        }
        let (strip, cost) = along(&piece)?;
        gain += own(&take(scene, &piece, usize::MAX));
        strips.push((strip, cost, piece));
    }
    // Cuts across a strip leave pieces of one height.
    let height = |s: &Shape| s.origin.dot(&plane.w());
    strips.sort_by(|a, b| height(&a.0).total_cmp(&height(&b.0)));
    let mut planes: Vec<(Shape, f64, Vec<u32>)> = Vec::with_capacity(strips.len());
    for (strip, cost, piece) in strips {
        if let Some(last) = planes.last_mut() {
            let mut both = [&last.2[..], &piece].concat();
            both.sort_unstable();
            if let Some((shape, joint)) = along(&both).filter(|b| b.1 < last.1 + cost) {
                *last = (shape, joint, both);
                continue;
            }
        }
        planes.push((strip, cost, piece));
    }
    gain -= planes.iter().map(|p| p.1).sum::<f64>();
    let several = planes.len() > 1 && gain > 0.0;
    several.then(|| planes.into_iter().map(|(shape, _, piece)| (shape, piece)).collect())
}
