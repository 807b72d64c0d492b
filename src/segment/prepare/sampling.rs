//! How a cloud was sampled: scattered, on scan lines, on a grid.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::median::median;
use crate::segment::prepare::place::place;
use crate::segment::prepare::steps::{coarser, steps};

constants! {
    /// Sites looked at.
    SITES: usize = 500, Effort("sites whose neighbours are looked at");
    /// Points before and after a site, in Morton order, that its neighbours are looked for among.
    WINDOW: usize = 512, Effort("points among which neighbours are looked for");
    /// Spacing across over that along from which on points lie on lines. Of points scattered evenly the nearest within
    /// 30 degrees of the direction at right angles to the nearest one is 1.7 times as far off.
    LINES: f64 = 2.5, Trial(2.5, 2.5);
    /// Median of sin2(2 a), a the angle between the directions of the two nearest points, below which these lie on
    /// lines or grids: 0 there, 0.5 where points are scattered.
    ALIGNED: f64 = 0.1, Trial(0.1, 0.1);
    /// Step of the coordinates over the spacing from which on points lie on a lattice.
    COARSE: f64 = 0.3, Trial(0.3, 0.3);
}

/// How points lie beside each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    Scattered,
    ScanLines,
    Grid,
    Lattice,
}

/// What tells of a cloud's sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampled {
    pub pattern: Pattern,
    /// Median distance to the nearest point; nought where there is none.
    pub along: f64,
    /// Median distance to the nearest point about at right angles to that.
    pub across: f64,
    /// The even step of each coordinate, nought where it has none.
    pub steps: [f64; 3],
}

/// The sampling of points in Morton order, whose coordinates are known to come in steps of `known` at least.
pub fn sampled(points: &[Vec3], known: &[f64; 3]) -> Sampled {
    let sites = points.len().min(SITES.get());
    let all: Vec<Around> = (0..sites)
        .into_par_iter()
        .filter_map(|k| Around::of(points, place(k, sites, points.len())))
        .collect();
    let middle = |of: fn(&Around) -> Option<f64>| {
        median(&mut all.iter().filter_map(of).collect::<Vec<_>>()).unwrap_or(0.0)
    };
    let (along, across) = (middle(|a| Some(a.along)), middle(|a| a.across));
    let turned = median(&mut all.iter().map(|a| a.turned).collect::<Vec<_>>());
    let steps = coarser(&steps(points), known);
    let pattern = if along > 0.0 && steps.iter().all(|s| *s >= COARSE.get() * along) {
        Pattern::Lattice
    } else if across >= LINES.get() * along {
        Pattern::ScanLines
    } else if turned.is_some_and(|t| t < ALIGNED.get()) {
        Pattern::Grid
    } else {
        Pattern::Scattered
    };
    Sampled { pattern, along, across, steps }
}

/// The nearest neighbours of a point.
struct Around {
    along: f64,
    /// None where no neighbour lies across.
    across: Option<f64>,
    /// sin2(2 a) of the angle between the two nearest.
    turned: f64,
}

impl Around {
    fn of(points: &[Vec3], site: usize) -> Option<Self> {
        let from = site.saturating_sub(WINDOW.get());
        let to = points.len().min(site + WINDOW.get() + 1);
        let at = points[site];
        let others = points[from..to].iter().map(|p| p - at).map(|d| (d.norm(), d));
        let mut all: Vec<(f64, Vec3)> = others.filter(|(length, _)| *length > 0.0).collect();
        // The two nearest come first.
        if all.len() < 2 {
            return None;
        }
        all.select_nth_unstable_by(1, |a, b| a.0.total_cmp(&b.0));
        let (first, second) = (all[0], all[1]);
        let cos = |d: &(f64, Vec3)| d.1.dot(&first.1) / (d.0 * first.0);
        let sq = cos(&second).powi(2);
        // within 30 degrees of a right angle
        let across = all.iter().filter(|d| cos(d).abs() < 0.5).map(|d| d.0).reduce(f64::min);
        Some(Self { along: first.0, across, turned: 4.0 * sq * (1.0 - sq) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::segment::fixtures::ordered;

    /// A sheet of points on rows `apart`, turned out of the axes; `loose` is how far each may be off along its row.
    fn rows(apart: f64, loose: f64) -> Sampled {
        let mut random = Random::new(2);
        let (u, v) = (Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.64, 0.48, 0.6));
        let mut at = |k: usize| {
            let (row, column) = ((k / 100) as f64, (k % 100) as f64);
            u * (column + loose * random.normal()) + v * (apart * row)
        };
        let points: Vec<Vec3> = (0..5000).map(&mut at).collect();
        sampled(&ordered(&points), &[0.0; 3])
    }

    #[test]
    fn rows_grids_and_scattered_points_are_told_apart() {
        let lines = rows(6.0, 0.05);
        assert_eq!(lines.pattern, Pattern::ScanLines);
        assert!((lines.along - 1.0).abs() < 0.1, "{lines:?}");
        assert!((lines.across - 6.0).abs() < 0.3, "{lines:?}");
        let grid = rows(1.0, 0.02);
        assert_eq!(grid.pattern, Pattern::Grid);
        assert!((grid.across - 1.0).abs() < 0.1, "{grid:?}");
        let mut random = Random::new(3);
        let mut at = || Vec3::new(random.uniform(0.0, 70.0), random.uniform(0.0, 70.0), 0.0);
        let even: Vec<Vec3> = (0..5000).map(|_| at()).collect();
        assert_eq!(sampled(&ordered(&even), &[0.0; 3]).pattern, Pattern::Scattered);
    }

    #[test]
    fn whole_steps_along_all_axes_are_a_lattice() {
        let points: Vec<Vec3> = (0..4000)
            .map(|k| Vec3::new((k % 60) as f64, (k / 60) as f64, ((k % 60) / 3) as f64))
            .collect();
        let found = sampled(&ordered(&points), &[0.0; 3]);
        assert_eq!((found.pattern, found.steps), (Pattern::Lattice, [1.0; 3]));
        assert_eq!(sampled(&[], &[0.0; 3]).along, 0.0);
    }
}
