//! Values known to a covariance, and which of them may be one.

use nalgebra::{Matrix2, Matrix3x2, SMatrix, SVector, Vector2};

use super::chi2::ln_density;
use crate::geometry::{Vec3, perpendicular_frame};

/// Something known to a covariance of `D` components that may be the same as another.
pub trait Estimate<const D: usize>: Clone {
    /// The difference from another and its covariance; `None` where the two are too far apart to be one.
    fn gap(&self, other: &Self) -> Option<Gap<D>>;
    /// What both together tell if they are one.
    fn joined(&self, other: &Self) -> Option<Self>;
    /// How far apart two that have nothing to do with each other may be: the volume of values over which they spread.
    fn volume(&self) -> f64;
}

/// A difference and its covariance.
#[derive(Clone, Copy, Debug)]
pub struct Gap<const D: usize> {
    /// The difference.
    pub value: SVector<f64, D>,
    /// Its covariance.
    pub covariance: SMatrix<f64, D, D>,
}

impl<const D: usize> Gap<D> {
    /// Its square in units of its covariance.
    pub fn chi2(&self) -> Option<f64> {
        Some(self.value.dot(&self.covariance.cholesky()?.solve(&self.value)))
    }

    /// Logarithm of how much more likely the gap is if the two are one than if they may be anything in `volume`.
    pub fn evidence(&self, volume: f64) -> Option<f64> {
        let half_ln_det: f64 =
            self.covariance.cholesky()?.l().diagonal().iter().map(|d| d.ln()).sum();
        Some(ln_density(self.chi2()?, D, half_ln_det) + volume.ln())
    }

    /// Its length and the standard deviation of that.
    pub fn length(&self) -> (f64, f64) {
        let length = self.value.norm();
        let variance = if length > 0.0 {
            self.value.dot(&(self.covariance * self.value)) / (length * length)
        } else {
            self.covariance.trace() / D as f64
        };
        (length, variance.max(0.0).sqrt())
    }
}

/// A direction that has no sign.
#[derive(Clone, Copy, Debug)]
pub struct Direction {
    /// It.
    pub w: Vec3,
    /// Two directions across it.
    pub across: Matrix3x2<f64>,
    /// Covariance of its components along these, in radians.
    pub covariance: Matrix2<f64>,
}

/// Beyond this tangent of the angle between them two directions are not compared: far beyond what rounding the sphere to
/// its tangent plane allows, and no measured direction is that uncertain.
const FAR: f64 = 0.3;

impl Direction {
    /// The other direction across this one, its sign turned to this side, and its covariance.
    fn seen(&self, other: &Self) -> (Vector2<f64>, Matrix2<f64>) {
        let sign = if self.w.dot(&other.w) < 0.0 { -1.0 } else { 1.0 };
        let basis = self.across.transpose() * other.across * sign;
        (self.across.transpose() * other.w * sign, basis * other.covariance * basis.transpose())
    }

    /// Variance of its component along a unit direction across it.
    pub fn variance_along(&self, d: &Vec3) -> f64 {
        let part = self.across.transpose() * d;
        part.dot(&(self.covariance * part))
    }
}

impl Estimate<2> for Direction {
    fn gap(&self, other: &Self) -> Option<Gap<2>> {
        let (value, covariance) = self.seen(other);
        let near = value.norm() < FAR && self.w.dot(&other.w).abs() > FAR;
        near.then_some(Gap { value, covariance: covariance + self.covariance })
    }

    fn joined(&self, other: &Self) -> Option<Self> {
        let (value, covariance) = self.seen(other);
        let gain = self.covariance * (self.covariance + covariance).try_inverse()?;
        let w = (self.w + self.across * (gain * value)).normalize();
        let (u, v) = perpendicular_frame(&w);
        let across = Matrix3x2::from_columns(&[u, v]);
        let basis = across.transpose() * self.across;
        let left = self.covariance - gain * self.covariance;
        let covariance = basis * ((left + left.transpose()) / 2.0) * basis.transpose();
        Some(Self { w, across, covariance })
    }

    fn volume(&self) -> f64 {
        // directions without a sign: half the sphere
        std::f64::consts::TAU
    }
}

/// A place in `D` dimensions, where something lies that is drawn along a direction known to a covariance: `drift` is how
/// the place moves with each of the direction's two components.
#[derive(Clone, Copy, Debug)]
pub struct Place<const D: usize> {
    /// It.
    pub x: SVector<f64, D>,
    /// Its covariance if the direction were known.
    pub covariance: SMatrix<f64, D, D>,
    /// By the direction's components.
    pub drift: SMatrix<f64, D, 2>,
    /// Covariance of these.
    pub direction: Matrix2<f64>,
    /// See [`Estimate::volume`].
    pub volume: f64,
}

impl<const D: usize> Estimate<D> for Place<D> {
    fn gap(&self, other: &Self) -> Option<Gap<D>> {
        let drift = self.drift - other.drift;
        let covariance =
            self.covariance + other.covariance + drift * self.direction * drift.transpose();
        Some(Gap { value: other.x - self.x, covariance })
    }

    fn joined(&self, other: &Self) -> Option<Self> {
        let gain = self.covariance * (self.covariance + other.covariance).try_inverse()?;
        let left = self.covariance - gain * self.covariance;
        Some(Self {
            x: self.x + gain * (other.x - self.x),
            covariance: (left + left.transpose()) / 2.0,
            drift: self.drift + gain * (other.drift - self.drift),
            ..*self
        })
    }

    fn volume(&self) -> f64 {
        self.volume
    }
}
