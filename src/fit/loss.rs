//! How residuals are weighed, and what they cost, for a chunk of points at once.

use super::columns::LANES;

/// Points whose distances and derivatives are kept at once: they fit in the first cache.
pub(super) const CHUNK: usize = 64;

/// How residuals are weighed.
#[derive(Clone, Copy, Debug)]
pub enum Loss {
    /// Their squares.
    Squares,
    /// Cauchy's loss c2 ln(1 + r2/c2), of this 1/c2.
    Cauchy(f64),
}

/// The cost, and the weights of a chunk by residual.
pub(super) struct Robust {
    loss: Loss,
    uneven: bool,
    squares: [f64; LANES],
    /// Of Cauchy's loss the product of 1 + r2/c2 over many points, and the logs of earlier products: one
    /// logarithm a point would take longer than all the rest.
    product: [f64; LANES],
    logs: f64,
    /// Of Cauchy's loss the sum of the squares over c2, none counted as more than [`TRUNCATED`].
    truncated: [f64; LANES],
    weight: [f64; CHUNK],
}

/// Square over Cauchy's constant squared beyond which a point counts as no worse: four sigmas where the constant is
/// two and a half.
const TRUNCATED: f64 = 2.56;

/// Products beyond this are put away as their logs: the next factor must not make them overflow.
const LARGE: f64 = 1e100;

impl Robust {
    /// Of nothing yet; `uneven` where weights are others than 0 and 1.
    pub(super) fn new(loss: Loss, uneven: bool) -> Self {
        let (squares, product) = ([0.0; LANES], [1.0; LANES]);
        let truncated = [0.0; LANES];
        Self { loss, uneven, squares, product, logs: 0.0, truncated, weight: [0.0; CHUNK] }
    }

    /// Adds the losses of a chunk; its points' weights.
    #[inline(always)]
    pub(super) fn add<'a>(&'a mut self, d: &[f64], given: &'a [f64]) -> &'a [f64] {
        match self.loss {
            Loss::Squares => {
                for (d, w) in d.chunks_exact(LANES).zip(given.chunks_exact(LANES)) {
                    for l in 0..LANES {
                        self.squares[l] += w[l] * d[l] * d[l];
                    }
                }
                given
            }
            Loss::Cauchy(inverse) => {
                let own = &mut self.weight[..d.len()];
                for ((own, d), w) in own.iter_mut().zip(d).zip(given) {
                    *own = *w / (1.0 + d * d * inverse);
                }
                for (d, w) in d.chunks_exact(LANES).zip(given.chunks_exact(LANES)) {
                    for l in 0..LANES {
                        self.truncated[l] += w[l] * (d[l] * d[l] * inverse).min(TRUNCATED);
                    }
                }
                if self.uneven {
                    for (d, w) in d.iter().zip(given) {
                        self.logs += w * (d * d * inverse).ln_1p();
                    }
                } else {
                    self.multiply(d, given, inverse);
                }
                &self.weight[..d.len()]
            }
        }
    }

    /// Weights are 0 or 1 here.
    #[inline(always)]
    fn multiply(&mut self, d: &[f64], given: &[f64], inverse: f64) {
        for (d, w) in d.chunks_exact(LANES).zip(given.chunks_exact(LANES)) {
            let mut large = false;
            for l in 0..LANES {
                self.product[l] *= 1.0 + d[l] * d[l] * inverse * w[l];
                large |= self.product[l] > LARGE;
            }
            if large {
                self.put_away();
            }
        }
    }

    fn put_away(&mut self) {
        for p in &mut self.product {
            self.logs += p.ln();
            *p = 1.0;
        }
    }

    /// Sum of the squares, of Cauchy's loss none beyond four sigmas.
    pub(super) fn truncated(&self) -> f64 {
        match self.loss {
            Loss::Squares => sum(&self.squares),
            Loss::Cauchy(inverse) => sum(&self.truncated) / inverse,
        }
    }

    /// The cost of all chunks.
    pub(super) fn total(mut self) -> f64 {
        match self.loss {
            Loss::Squares => sum(&self.squares),
            Loss::Cauchy(inverse) => {
                self.put_away();
                self.logs / inverse
            }
        }
    }
}

/// The parts of a sum together.
#[inline(always)]
pub(super) fn sum(s: &[f64; LANES]) -> f64 {
    ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]))
}
