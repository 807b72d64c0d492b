use std::collections::HashMap;

use crate::geometry::Vec3;

/// Cells along the longest side in the first look, which tells about how much surface there is.
const FIRST_CELLS: f64 = 64.0;
/// A cell of the second look is so many spacings wide: enough points to count, few enough to follow their density.
const SPACINGS: f64 = 5.0;
/// Area of a surface in a cell that it crosses, in squares of its side: between 1 (along a side) and 0.6 (across the
/// corners).
const AREA: f64 = 0.8;

type Cell = [i32; 3];

/// About how far points lie from their neighbours where each is: the side of a square of surface that holds one point.
pub fn spacings(points: &[Vec3]) -> Vec<f32> {
    let Some(first) = points.first() else { return Vec::new() };
    let (low, high) = points.iter().fold((*first, *first), |(l, h), p| (l.inf(p), h.sup(p)));
    let size = (high - low).max();
    if size <= 0.0 {
        return vec![0.0; points.len()];
    }
    let coarse = size / FIRST_CELLS;
    let occupied = counted(points, &low, coarse).len() as f64;
    let mean = coarse * (AREA * occupied / points.len() as f64).sqrt();
    // no finer than single numbers of cells allow
    let side = (SPACINGS * mean).max(size / 4096.0);
    let counts = counted(points, &low, side);
    let shared: HashMap<Cell, f32> = counts
        .keys()
        .map(|cell| {
            // the cells beside make up for one that is only grazed
            let (n, sum) = around(cell)
                .filter_map(|c| counts.get(&c))
                .fold((0, 0), |(n, sum), c| (n + 1, sum + c));
            let density = f64::from(sum) / f64::from(n);
            (*cell, (side * (AREA / density).sqrt()) as f32)
        })
        .collect();
    points
        .iter()
        .map(|p| shared.get(&cell(p, &low, side)).copied().unwrap_or(mean as f32))
        .collect()
}

fn counted(points: &[Vec3], low: &Vec3, side: f64) -> HashMap<Cell, u32> {
    let mut counts = HashMap::new();
    points.iter().for_each(|p| *counts.entry(cell(p, low, side)).or_insert(0) += 1);
    counts
}

fn cell(p: &Vec3, low: &Vec3, side: f64) -> Cell {
    let q = (p - low) / side;
    [q.x as i32, q.y as i32, q.z as i32]
}

fn around(cell: &Cell) -> impl Iterator<Item = Cell> {
    let [x, y, z] = *cell;
    (0..27).map(move |k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spacing_of_a_lattice_is_its_step_and_follows_its_density() {
        let plate = |n: i32, step: f64, x: f64| {
            (0..n * n)
                .map(move |k| Vec3::new(x + step * f64::from(k % n), step * f64::from(k / n), 0.0))
        };
        let points: Vec<_> = plate(100, 0.1, 0.0).chain(plate(50, 0.2, 20.0)).collect();
        let told = spacings(&points);
        let mean = |of: &[f32]| of.iter().sum::<f32>() / of.len() as f32;
        let (dense, sparse) = (mean(&told[..10_000]), mean(&told[10_000..]));
        assert!(
            (0.07..0.13).contains(&dense) && (0.14..0.26).contains(&sparse),
            "{dense} {sparse}"
        );
    }

    #[test]
    fn points_in_one_place_have_none() {
        assert_eq!(spacings(&[Vec3::zeros(); 3]), [0.0; 3]);
        assert!(spacings(&[]).is_empty());
    }
}
