use rayon::prelude::*;

use super::{scene::Scene, splats::Winners};

/// Longest way that is looked, in pixels.
const FARTHEST: usize = 48;
/// A hole is no wider than so many radii of the discs around it.
const WIDEST: f32 = 2.5;
/// The eight directions, the first four ones and their opposites: row and column.
const DIRECTIONS: [(isize, isize); 8] =
    [(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1), (-1, 1)];
/// How many of the directions may see nothing: on a region's edge some do.
const BLIND: usize = 1;

/// Closes the holes that points in no order leave between their discs: pixels around which a surface that is nearer
/// stands on all sides.
pub fn close(scene: &Scene, winners: &Winners) {
    let pixels = 0..winners.width * winners.height;
    let filled = |at: usize| Some((at, around(scene, winners, at)?));
    // found in the picture as it is, and closed when all are found
    let holes: Vec<(usize, usize)> =
        pixels.into_par_iter().with_min_len(winners.width).filter_map(filled).collect();
    holes.into_iter().for_each(|(at, from)| winners.copy(from, at));
}

/// The nearest pixel of the surface in which `at` is a hole.
fn around(scene: &Scene, winners: &Winners, at: usize) -> Option<usize> {
    let (mut label, mut nearest, mut blind) = (None, (usize::MAX, 0), 0);
    for direction in DIRECTIONS {
        let Some((steps, seen, own)) = look(scene, winners, at, direction) else {
            blind += 1;
            if blind > BLIND {
                return None;
            }
            continue;
        };
        if *label.get_or_insert(own) != own {
            return None;
        }
        nearest = nearest.min((steps, seen));
    }
    Some(nearest.1)
}

/// The first pixel in a direction that shows a region's point in front of what `at` shows, if it is near: how many
/// steps away, which, and its region.
fn look(
    scene: &Scene,
    winners: &Winners,
    at: usize,
    (down, right): (isize, isize),
) -> Option<(usize, usize, i32)> {
    let (x, y) = ((at % winners.width) as isize, (at / winners.width) as isize);
    let depth = winners.depth(at);
    for steps in 1..FARTHEST as isize {
        let (x, y) = (x + steps * right, y + steps * down);
        if x < 0 || y < 0 || x >= winners.width as isize || y >= winners.height as isize {
            return None;
        }
        let seen = y as usize * winners.width + x as usize;
        let Some(point) = winners.point(seen) else { continue };
        let (label, radius) = (scene.labels[point], winners.radii[point]);
        let way = steps as f32 * ((down * down + right * right) as f32).sqrt();
        // what is as deep belongs to the same surface
        if label < 0 || winners.depth(seen) + f64::from(2.0 * radius) > depth {
            if depth.is_finite() && way > WIDEST * radius {
                return None;
            }
            continue;
        }
        return (way <= WIDEST * radius).then_some((steps as usize, seen, label));
    }
    None
}
