//! The linear program of minimum zones, by exchange of constraints (Stiefel; the dual simplex method).

#![expect(clippy::needless_range_loop, reason = "small matrices read best by index")]

use super::pose::SLOTS;

/// Most unknowns: the places of a step, and the bound.
pub const MOST: usize = SLOTS + 1;

/// A function that is to stay below the bound: its value here and its derivatives by the `p` open places.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Value.
    pub value: f64,
    /// Derivatives.
    pub slope: [f64; SLOTS],
}

/// A constraint of the basis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// A piece, or its negative.
    Piece {
        /// Its place.
        index: usize,
        /// 1, or -1 for the negative.
        sign: f64,
    },
    /// A side of the box.
    Side {
        /// Its place.
        place: usize,
        /// 1 or -1.
        sign: f64,
    },
}

/// The solution of the program.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The step.
    pub step: [f64; SLOTS],
    /// The least bound.
    pub bound: f64,
    /// The constraints that hold it, each with its multiplier.
    pub basis: Vec<(Bound, f64)>,
}

/// The step within |step_k| <= `reach` that makes the largest of the linear `pieces`, or, where `both`, of their magnitudes, least.
///
/// It starts at the corner of the box that is lowest for the largest piece and exchanges the constraint that is violated most for one of
/// the basis, keeping all multipliers non-negative. `None` where rounding brings it to no end.
pub fn exchange(pieces: &[Piece], p: usize, both: bool, reach: f64) -> Option<Solution> {
    exchange_within(pieces, p, both, reach, ROUNDING)
}

/// A violation of a constraint that is rounding, over one and the bound.
const ROUNDING: f64 = 1e-14;

/// [`exchange`] where constraints may be violated by `slack`, over one and the bound.
pub fn exchange_within(
    pieces: &[Piece],
    p: usize,
    both: bool,
    reach: f64,
    slack: f64,
) -> Option<Solution> {
    let height = |v: f64| if both { v.abs() } else { v };
    let top = (0..pieces.len())
        .max_by(|&a, &b| height(pieces[a].value).total_cmp(&height(pieces[b].value)))?;
    let sign = if both && pieces[top].value < 0.0 { -1.0 } else { 1.0 };
    let mut basis = [Bound::Piece { index: top, sign }; MOST];
    for k in 0..p {
        let side = if sign * pieces[top].slope[k] > 0.0 { -1.0 } else { 1.0 };
        basis[k] = Bound::Side { place: k, sign: side };
    }
    let q = p + 1;
    basis[p] = Bound::Piece { index: top, sign };
    for _ in 0..ROUNDS {
        let mut rows = [[0.0; MOST]; MOST];
        let mut limits = [0.0; MOST];
        for j in 0..q {
            (rows[j], limits[j]) = row(&basis[j], pieces, p, reach);
        }
        let inverse = inverse(rows, q)?;
        let mut x = [0.0; MOST];
        let mut multipliers = [0.0; MOST];
        for a in 0..q {
            for j in 0..q {
                x[a] += inverse[a][j] * limits[j];
            }
            // The objective is the last unknown.
            multipliers[a] = -inverse[p][a];
        }
        let Some(entering) = most_violated(pieces, p, both, (reach, slack), &x) else {
            let step = std::array::from_fn(|k| if k < p { x[k] } else { 0.0 });
            let basis = (0..q).map(|j| (basis[j], multipliers[j].max(0.0))).collect();
            return Some(Solution { step, bound: x[p], basis });
        };
        let (new, _) = row(&entering, pieces, p, reach);
        let (mut leaving, mut least) = (None, f64::INFINITY);
        for j in 0..q {
            let y: f64 = (0..q).map(|a| inverse[a][j] * new[a]).sum();
            if y > 1e-12 {
                let ratio = multipliers[j].max(0.0) / y;
                if ratio < least {
                    (leaving, least) = (Some(j), ratio);
                }
            }
        }
        basis[leaving?] = entering;
    }
    None
}

/// Exchanges after which rounding turns in a circle.
const ROUNDS: usize = 300;

/// A constraint as a'x <= limit in the step and the bound.
fn row(bound: &Bound, pieces: &[Piece], p: usize, reach: f64) -> ([f64; MOST], f64) {
    let mut a = [0.0; MOST];
    match *bound {
        Bound::Piece { index, sign } => {
            for k in 0..p {
                a[k] = sign * pieces[index].slope[k];
            }
            a[p] = -1.0;
            (a, -sign * pieces[index].value)
        }
        Bound::Side { place, sign } => {
            a[place] = sign;
            (a, reach)
        }
    }
}

fn most_violated(
    pieces: &[Piece],
    p: usize,
    both: bool,
    (reach, slack): (f64, f64),
    x: &[f64; MOST],
) -> Option<Bound> {
    let mut worst = (slack * (1.0 + x[p].abs()), None);
    for (index, piece) in pieces.iter().enumerate() {
        let mut v = piece.value;
        for k in 0..p {
            v += piece.slope[k] * x[k];
        }
        let sign = if both && v < 0.0 { -1.0 } else { 1.0 };
        let over = sign * v - x[p];
        if over > worst.0 {
            worst = (over, Some(Bound::Piece { index, sign }));
        }
    }
    for place in 0..p {
        let over = x[place].abs() - reach;
        if over > worst.0.max(1e-12 * reach) {
            worst = (over, Some(Bound::Side { place, sign: x[place].signum() }));
        }
    }
    worst.1
}

/// Gauss and Jordan's inverse with row pivots.
fn inverse(mut a: [[f64; MOST]; MOST], q: usize) -> Option<[[f64; MOST]; MOST]> {
    let mut out = [[0.0; MOST]; MOST];
    for i in 0..q {
        out[i][i] = 1.0;
    }
    for k in 0..q {
        let pivot = (k..q).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs()))?;
        if a[pivot][k].abs() < 1e-14 {
            return None;
        }
        a.swap(k, pivot);
        out.swap(k, pivot);
        let scale = 1.0 / a[k][k];
        for j in 0..q {
            a[k][j] *= scale;
            out[k][j] *= scale;
        }
        for i in 0..q {
            let factor = a[i][k];
            if i != k && factor != 0.0 {
                for j in 0..q {
                    a[i][j] -= factor * a[k][j];
                    out[i][j] -= factor * out[k][j];
                }
            }
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;

    #[test]
    fn the_bound_is_the_least_and_its_multipliers_show_it() {
        let mut random = Random::new(3);
        for round in 0..200 {
            let (p, both) = (1 + round % 6, round % 2 == 0);
            let pieces: Vec<Piece> = (0..40)
                .map(|_| Piece {
                    value: random.normal(),
                    slope: std::array::from_fn(|_| random.normal()),
                })
                .collect();
            let found = exchange(&pieces, p, both, 0.7).unwrap();
            let height = |x: &[f64; SLOTS]| {
                pieces.iter().fold(f64::NEG_INFINITY, |m, piece| {
                    let v = piece.value + (0..p).map(|k| piece.slope[k] * x[k]).sum::<f64>();
                    m.max(if both { v.abs() } else { v })
                })
            };
            assert!((height(&found.step) - found.bound).abs() < 1e-12);
            assert!(found.basis.iter().all(|b| b.1 >= 0.0));
            // Weak duality: the multipliers bound every other step's height from below.
            let mut gradient = [0.0; SLOTS];
            let (mut sum, mut dual) = (0.0, 0.0);
            for (bound, multiplier) in &found.basis {
                match *bound {
                    Bound::Piece { index, sign } => {
                        sum += multiplier;
                        dual += multiplier * sign * pieces[index].value;
                        for k in 0..p {
                            gradient[k] += multiplier * sign * pieces[index].slope[k];
                        }
                    }
                    Bound::Side { place, sign } => {
                        dual -= multiplier * 0.7;
                        gradient[place] += multiplier * sign;
                    }
                }
            }
            assert!((sum - 1.0).abs() < 1e-10 && (dual - found.bound).abs() < 1e-10);
            assert!(gradient[..p].iter().all(|g| g.abs() < 1e-10));
        }
    }
}
