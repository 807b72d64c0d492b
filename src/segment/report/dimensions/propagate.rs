//! How exactly a length is known that several surfaces tell.

use crate::fit::Shape;
use crate::fit::constant::constants;
use crate::segment::report::known::Known;

constants! {
    /// Step of a derivative, in standard deviations of the freedom: small against its scatter, large against rounding.
    STEP: f64 = 1e-2, Derived("small against the scatter, so that a slope is one, and large against rounding");
}

/// Variance of `value`, a function of some surfaces' shapes, from the covariance of each one's degrees of freedom;
/// the surfaces are known independently of each other. `None` where a surface's covariance is not known or the value
/// does not exist beside the shapes as they are.
pub fn variance(surfaces: &[&Known], value: impl Fn(&[Shape]) -> Option<f64>) -> Option<f64> {
    let shapes: Vec<Shape> = surfaces.iter().map(|k| k.shape).collect();
    let mut sum = 0.0;
    for (i, known) in surfaces.iter().enumerate() {
        let covariance = &known.uncertainty.as_ref()?.of_freedoms;
        let dof = known.shape.family.dof();
        let mut slopes = vec![0.0; dof];
        for (k, slope) in slopes.iter_mut().enumerate() {
            let step = STEP.get() * covariance[(k, k)].max(0.0).sqrt();
            if step == 0.0 {
                continue;
            }
            let at = |h: f64| {
                let mut delta = vec![0.0; dof];
                delta[k] = h;
                let mut moved = shapes.clone();
                moved[i] = shapes[i].stepped(&delta)?;
                value(&moved)
            };
            *slope = (at(step)? - at(-step)?) / (2.0 * step);
        }
        for a in 0..dof {
            for b in 0..dof {
                sum += slopes[a] * covariance[(a, b)] * slopes[b];
            }
        }
    }
    sum.is_finite().then_some(sum.max(0.0))
}
