//! All surfaces at once, under constraints.

use nalgebra::DVector;

use super::chi2::{ln_density, survival};
use super::constraint::Constraint;
use super::face::Face;
use crate::fit::Shape;

/// Step of the numeric derivatives, of lengths in units of the scene and of angles: the cube root of double precision,
/// at which rounding and the third derivative disturb a central difference about alike.
const STEP: f64 = 6e-6;
/// What is left of an equation's variance, given the equations before it, where it says nothing new: well above what
/// rounding leaves, which is some multiple of double precision, and well below any share that is new.
const IMPLIED: f64 = 1e-11;
/// The same, times the square of how far the surfaces are from where the equations hold: there, equations that follow from
/// others do so but for a share of the order of that distance.
const CURVED: f64 = 10.0;

/// One equation, linear in the steps of the faces' degrees of freedom.
struct Row {
    /// How far it is from holding.
    residual: f64,
    /// The faces with its slopes, and these times the face's covariance.
    parts: Vec<(usize, DVector<f64>, DVector<f64>)>,
}

/// Surfaces under equations that were added one by one: the factor L of A C A' = L L', where A has a row for each
/// equation and C is the covariance of all faces, and the equations' residuals z = L^-1 r.
///
/// The squares of z are what each equation adds to the chi-squared of all before it (the innovations of a Kalman filter).
/// An equation that follows from those before it has no row; it holds by itself, or contradicts them.
pub struct Joint<'a> {
    faces: &'a [Face],
    /// Steps of the faces' degrees of freedom at which the equations are linear.
    at: Vec<DVector<f64>>,
    rows: Vec<Row>,
    /// Rows of each face.
    of_face: Vec<Vec<usize>>,
    factor: Vec<Vec<f64>>,
    z: Vec<f64>,
    /// How far the surfaces beside which the equations are linear are from where these hold, in units of the scene and in
    /// radians; `None` where they are those that were fitted.
    off: Option<f64>,
}

/// What a constraint adds to those before it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Innovation {
    /// Chi-squared of its residuals, given all before it.
    pub chi2: f64,
    /// How many of its equations say something new.
    pub rank: usize,
    /// Half the logarithm of the determinant of their covariance.
    pub half_ln_det: f64,
    /// Largest residual of its equations that follow from those before it, in standard deviations it had without them.
    pub contradiction: f64,
    /// The largest residual, in standard deviations, and its standard deviation, given all before it; of equations that
    /// follow from those before, without them.
    pub largest: (f64, f64),
    /// Logarithm of the density of the residuals of all its equations, each by itself and without what was before.
    plain: f64,
}

impl Innovation {
    fn keep_largest(&mut self, residual: f64, deviation: f64) {
        let (r, d) = self.largest;
        if d == 0.0 || (residual / deviation).abs() > (r / d).abs() {
            self.largest = (residual, deviation);
        }
    }

    /// Probability of a larger deviation, if the constraint holds.
    pub fn probability(&self) -> f64 {
        survival(self.chi2, self.rank)
    }

    /// Logarithm of how much more likely its residuals are if it holds than if they may be anything in `volume`, given all
    /// before it; by themselves where they follow from that in part, so that nothing is said of the rest.
    pub fn evidence(&self, equations: usize, volume: f64) -> f64 {
        let density = if self.rank == equations {
            ln_density(self.chi2, self.rank, self.half_ln_det)
        } else {
            self.plain
        };
        density + volume.ln()
    }
}

impl<'a> Joint<'a> {
    /// Faces under no equation yet, linear beside the surfaces as fitted.
    pub fn new(faces: &'a [Face]) -> Self {
        Self::beside(faces, Self::still(faces), None)
    }

    /// The same, linear at the steps `at` of their degrees of freedom, where equations hold but for `off`.
    pub fn beside(faces: &'a [Face], at: Vec<DVector<f64>>, off: Option<f64>) -> Self {
        Self {
            off,
            faces,
            at,
            rows: Vec::new(),
            of_face: vec![Vec::new(); faces.len()],
            factor: Vec::new(),
            z: Vec::new(),
        }
    }

    /// Steps of nothing for each of `faces`.
    pub fn still(faces: &[Face]) -> Vec<DVector<f64>> {
        faces.iter().map(|f| DVector::zeros(f.shape.family.dof())).collect()
    }

    /// How many equations say something.
    pub fn rank(&self) -> usize {
        self.rows.len()
    }

    /// Chi-squared of all.
    pub fn chi2(&self) -> f64 {
        self.z.iter().map(|z| z * z).sum()
    }

    /// Adds the equations of a constraint and says what they add.
    pub fn add(&mut self, constraint: &Constraint) -> Innovation {
        let mut told = Innovation::default();
        for row in self.linear(constraint) {
            let own: f64 = row.parts.iter().map(|(_, a, b)| a.dot(b)).sum();
            let (line, left) = self.line(&row, own);
            let rest = row.residual - line.iter().zip(&self.z).map(|(l, z)| l * z).sum::<f64>();
            let plain = own.sqrt().max(1e-300);
            told.plain += ln_density((row.residual / plain).powi(2), 1, plain.ln());
            // beside the surfaces as fitted each equation is off by about its own deviation
            let off = self.off.unwrap_or(own.sqrt());
            let says_something = left > (IMPLIED + CURVED * off * off) * own;
            if !says_something {
                told.contradiction = told.contradiction.max(rest.abs() / plain);
                told.keep_largest(row.residual, plain);
                continue;
            }
            let deviation = left.sqrt();
            told.rank += 1;
            told.chi2 += rest * rest / left;
            told.half_ln_det += deviation.ln();
            told.keep_largest(rest, deviation);
            self.z.push(rest / deviation);
            self.factor.push([line, vec![deviation]].concat());
            row.parts.iter().for_each(|(face, ..)| self.of_face[*face].push(self.rows.len()));
            self.rows.push(row);
        }
        told
    }

    /// Takes away the equations that were added after there were `rank`.
    pub fn truncate(&mut self, rank: usize) {
        self.rows.truncate(rank);
        self.factor.truncate(rank);
        self.z.truncate(rank);
        self.of_face.iter_mut().for_each(|rows| {
            while rows.last().is_some_and(|&r| r >= rank) {
                rows.pop();
            }
        });
    }

    /// The row of L of a further equation, but for its diagonal, and the square of that.
    fn line(&self, row: &Row, own: f64) -> (Vec<f64>, f64) {
        let mut line = vec![0.0; self.rows.len()];
        for (face, slopes, _) in &row.parts {
            for &k in &self.of_face[*face] {
                let other = self.rows[k].parts.iter().find(|p| p.0 == *face);
                line[k] += other.map_or(0.0, |p| slopes.dot(&p.2));
            }
        }
        let first = line.iter().position(|v| *v != 0.0).unwrap_or(line.len());
        let mut left = own;
        for k in first..line.len() {
            let factor = &self.factor[k];
            let sum: f64 = line[first..k].iter().zip(&factor[first..k]).map(|(a, b)| a * b).sum();
            line[k] = (line[k] - sum) / factor[k];
            left -= line[k] * line[k];
        }
        (line, left)
    }

    /// The equations of a constraint, linear about where the faces are.
    fn linear(&self, constraint: &Constraint) -> Vec<Row> {
        let names = constraint.faces();
        let here = |k: usize| moved(&self.faces[k], &self.at[k]);
        let residuals = constraint.residuals(&here);
        let mut rows: Vec<Row> =
            residuals.iter().map(|&residual| Row { residual, parts: Vec::new() }).collect();
        for &face in &names {
            let dof = self.at[face].len();
            let mut slopes = vec![DVector::zeros(dof); rows.len()];
            for d in 0..dof {
                let beside = |h: f64| {
                    let mut at = self.at[face].clone();
                    at[d] += h;
                    let shape = moved(&self.faces[face], &at);
                    constraint.residuals(&|k| if k == face { shape } else { here(k) })
                };
                let (after, before) = (beside(STEP), beside(-STEP));
                for (k, slopes) in slopes.iter_mut().enumerate() {
                    slopes[d] = (after[k] - before[k]) / (2.0 * STEP);
                }
            }
            for (row, slopes) in rows.iter_mut().zip(slopes) {
                // the steps are told from where the fits are
                row.residual -= slopes.dot(&self.at[face]);
                let product = &self.faces[face].covariance * &slopes;
                row.parts.push((face, slopes, product));
            }
        }
        rows
    }

    /// The steps of all faces of least chi-squared at which the equations hold, and the chi-squared of each face's.
    pub fn solved(&self) -> (Vec<DVector<f64>>, Vec<f64>) {
        let mut multipliers = self.z.clone();
        for k in (0..multipliers.len()).rev() {
            let factor = &self.factor[k];
            multipliers[k] /= factor[k];
            let m = multipliers[k];
            multipliers[..k].iter_mut().zip(factor).for_each(|(v, f)| *v -= f * m);
        }
        let mut steps = Self::still(self.faces);
        let mut pulls = Self::still(self.faces);
        for (row, m) in self.rows.iter().zip(&multipliers) {
            for (face, slopes, product) in &row.parts {
                steps[*face] -= product * *m;
                pulls[*face] -= slopes * *m;
            }
        }
        // the step is the covariance times the pull, so its chi-squared needs no inverse
        let chi2 = steps.iter().zip(&pulls).map(|(s, p)| s.dot(p).max(0.0)).collect();
        (steps, chi2)
    }
}

/// How far the equations of some constraints are from holding at most after steps of the faces.
pub fn farthest<'c>(
    faces: &[Face],
    steps: &[DVector<f64>],
    constraints: impl Iterator<Item = &'c Constraint>,
) -> f64 {
    let shape = |k: usize| moved(&faces[k], &steps[k]);
    let all = constraints.flat_map(|c| c.residuals(&shape));
    all.fold(0.0, |most, r| if r.abs() <= most { most } else { r.abs() })
}

/// The shape of a face after a step of its degrees of freedom; as it was where a size would leave its range.
pub fn moved(face: &Face, step: &DVector<f64>) -> Shape {
    face.shape.stepped(step.as_slice()).unwrap_or(face.shape)
}

#[cfg(test)]
mod tests;
