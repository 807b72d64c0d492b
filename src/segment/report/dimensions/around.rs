//! The part of a circle that points cover.

use std::f64::consts::TAU;

/// An arc: its first angle, and how far it goes from there; 2 pi where it closes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Where it begins, counter-clockwise.
    pub from: f64,
    /// Its angle, in 0..=2 pi.
    pub angle: f64,
}

impl Arc {
    /// The smallest that holds all `angles`; all of the circle where no gap between them is wider than `gap`.
    pub fn of(angles: &mut [f64], gap: f64) -> Self {
        angles.iter_mut().for_each(|a| *a = a.rem_euclid(TAU));
        angles.sort_unstable_by(f64::total_cmp);
        let (Some(&first), Some(&last)) = (angles.first(), angles.last()) else {
            return Self { from: 0.0, angle: 0.0 };
        };
        let mut widest = (first + TAU - last, first);
        for pair in angles.windows(2) {
            if pair[1] - pair[0] > widest.0 {
                widest = (pair[1] - pair[0], pair[1]);
            }
        }
        if widest.0 <= gap {
            Self { from: 0.0, angle: TAU }
        } else {
            Self { from: widest.1, angle: TAU - widest.0 }
        }
    }

    /// Whether it goes all round.
    pub fn closes(&self) -> bool {
        self.angle >= TAU
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_may_pass_nought_and_one_without_a_gap_closes() {
        let turn =
            |from: i32, to: i32| (from..=to).map(|k| 0.01 * f64::from(k)).collect::<Vec<_>>();
        let arc = Arc::of(&mut turn(-100, 150), 0.1);
        assert!((arc.from - (TAU - 1.0)).abs() < 1e-9 && (arc.angle - 2.5).abs() < 1e-9);
        assert!(Arc::of(&mut turn(0, 628), 0.1).closes());
        assert!(!Arc::of(&mut turn(0, 600), 0.1).closes());
        assert_eq!(Arc::of(&mut [], 0.1).angle, 0.0);
    }
}
