//! How a region's points deviate from its surface, as inline SVG.

use std::fmt::Write;

use maud::{Markup, html};

use crate::answer::sheet::number;

/// Bars of a histogram; odd, so that one stands about zero.
const BARS: usize = 41;
/// It reaches this many root mean squares to either side; what lies beyond counts in the outermost bars.
const REACH: f64 = 4.0;
const WIDTH: f64 = 300.0;
const HEIGHT: f64 = 84.0;

/// The deviations of one region.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Half the width of the whole.
    pub reach: f64,
    /// Points in each bar.
    pub bars: [u32; BARS],
    /// Points within the whole, and the sum of their deviations.
    count: usize,
    sum: f64,
}

impl Histogram {
    /// An empty one for deviations with that root mean square.
    pub fn new(rms: f64) -> Self {
        Self { reach: REACH * rms, bars: [0; BARS], count: 0, sum: 0.0 }
    }

    /// Counts one point.
    pub fn add(&mut self, deviation: f64) {
        let place = (deviation / self.reach + 1.0) / 2.0 * BARS as f64;
        // exact points have no reach
        let bar = if place.is_nan() { BARS / 2 } else { (place.max(0.0) as usize).min(BARS - 1) };
        self.bars[bar] += 1;
        self.count += 1;
        self.sum += deviation;
    }

    /// Mean deviation.
    pub fn mean(&self) -> f64 {
        if self.count == 0 { 0.0 } else { self.sum / self.count as f64 }
    }

    /// The picture of it, with the normal curve of `noise` over it.
    pub fn svg(&self, noise: f64, label: &str) -> Markup {
        let top = self.bars.iter().copied().max().unwrap_or(0).max(1);
        let step = WIDTH / BARS as f64;
        let height = |share: f64| HEIGHT * (1.0 - 0.94 * share);
        let mut outline = format!("M0 {HEIGHT}");
        for (k, bar) in self.bars.iter().enumerate() {
            let y = height(f64::from(*bar) / f64::from(top));
            let x = k as f64 * step;
            // text takes everything
            let _ = write!(outline, "L{x:.1} {y:.1}L{:.1} {y:.1}", x + step);
        }
        let _ = write!(outline, "L{WIDTH} {HEIGHT}Z");
        html! {
            svg viewBox=(format!("0 -2 {WIDTH} {}", HEIGHT + 20.0)) role="img" aria-label=(label) {
                path class="bars" d=(outline) {}
                @if let Some(curve) = self.normal_curve(noise, f64::from(top)) {
                    path class="curve" d=(curve) {}
                }
                path class="zero" d=(format!("M{} -2V{HEIGHT}", WIDTH / 2.0)) {}
                path class="base" d=(format!("M0 {HEIGHT}H{WIDTH}")) {}
                text x="0" y=(HEIGHT + 14.0) { "−" (number(self.reach)) }
                text x=(WIDTH / 2.0) y=(HEIGHT + 14.0) text-anchor="middle" { "0" }
                text x=(WIDTH) y=(HEIGHT + 14.0) text-anchor="end" { (number(self.reach)) }
            }
        }
    }

    /// What the bars would be if the points had normal noise of that size and nothing else; `top` points are the full
    /// height.
    fn normal_curve(&self, noise: f64, top: f64) -> Option<String> {
        const PARTS: usize = 120;
        let bar = 2.0 * self.reach / BARS as f64;
        let peak = self.count as f64 * bar / (noise * (2.0 * std::f64::consts::PI).sqrt());
        // one narrower than a bar is no curve
        if !(noise >= bar / 2.0 && noise.is_finite()) {
            return None;
        }
        let mut curve = String::new();
        for k in 0..=PARTS {
            let share = k as f64 / PARTS as f64;
            let z = self.reach * (2.0 * share - 1.0) / noise;
            let y = HEIGHT * (1.0 - 0.94 * (peak / top * (-z * z / 2.0).exp()).min(1.05));
            let command = if k == 0 { 'M' } else { 'L' };
            let _ = write!(curve, "{command}{:.1} {y:.1}", WIDTH * share);
        }
        Some(curve)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_stand_in_the_bars_of_their_deviations() {
        let mut histogram = Histogram::new(0.5);
        for deviation in [-100.0, -2.0, 0.0, 0.01, 1.999, 2.0, 50.0] {
            histogram.add(deviation);
        }
        assert_eq!(
            (histogram.bars[0], histogram.bars[BARS / 2], histogram.bars[BARS - 1]),
            (2, 2, 3)
        );
        assert_eq!(histogram.bars.iter().sum::<u32>(), 7);
        let mut one = Histogram::new(1.0);
        [0.5, 1.5].into_iter().for_each(|d| one.add(d));
        assert_eq!(one.mean(), 1.0);
    }

    #[test]
    fn exact_points_stand_at_zero() {
        let mut histogram = Histogram::new(0.0);
        histogram.add(0.0);
        assert_eq!(histogram.bars[BARS / 2], 1);
        let svg = histogram.svg(0.0, "exact").into_string();
        assert!(svg.contains("bars") && !svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn the_normal_curve_has_the_area_of_the_bars() {
        let mut histogram = Histogram::new(1.0);
        // the quantiles of a normal distribution, by its own curve
        let bar = 2.0 * histogram.reach / BARS as f64;
        for k in 0..BARS {
            let middle = -histogram.reach + (k as f64 + 0.5) * bar;
            let points = (10_000.0 * bar * (-middle * middle / 2.0).exp() / 2.506_628) as usize;
            (0..points).for_each(|_| histogram.add(middle));
        }
        let top = f64::from(histogram.bars[BARS / 2]);
        let curve = histogram.normal_curve(1.0, top).unwrap();
        let heights =
            curve.split(['M', 'L']).filter_map(|p| p.split(' ').nth(1)?.parse::<f64>().ok());
        let highest = heights.fold(f64::INFINITY, f64::min);
        assert!((highest - 0.06 * HEIGHT).abs() < 0.02 * HEIGHT, "{highest}");
    }
}
