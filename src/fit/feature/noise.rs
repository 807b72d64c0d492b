//! How far the points' noise reaches along the normals of a feature.

use super::pose::Pose;
use super::rows::Gauge;
use super::student::{coverage_factor, planar_factor};
use crate::geometry::Vec3;

/// The noise of points about a feature, lengths in the points' unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Its standard deviation.
    pub deviation: f64,
    /// The degrees of freedom that it is known by.
    pub freedom: f64,
    /// What the noise of no point goes beyond, with the probability asked for.
    ///
    /// Of a line, whose points have noise two ways, the length of both together.
    pub reach: f64,
}

impl Noise {
    /// That of `points` about their least-squares pose with `p` degrees of freedom left open; `None` where they are no more rows
    /// than these.
    ///
    /// There are two estimates: the scatter of all distances, which counts form error as noise, and that among two or three
    /// neighbours, which counts of it what changes from one point to the next. Either is too large, if anything, so the
    /// one that reaches less far is taken. By Šidák's inequality (*J. Am. Stat. Assoc.* 62 (1967)) no noise is beyond
    /// `reach` with at least the probability asked for, whether the points' noise is independent or not.
    pub fn of(pose: &Pose, points: &[Vec3], p: usize, coverage: f64) -> Option<Self> {
        let rows = pose.kind.rows();
        let all = rows * points.len();
        if all <= p {
            return None;
        }
        let spare = (all - p) as f64;
        let mut feet: Vec<Foot> = points.iter().map(|x| Foot::of(pose, x)).collect();
        let squares: f64 = feet.iter().map(|f| f.squares(&[0.0; 2])).sum();
        let (among, freedom) = among_neighbours(&mut feet);
        // What the fit takes of the noise it takes of both.
        let share = spare / all as f64;
        let near = (among / share, rows as f64 * freedom * share);
        let estimates = [(squares / spare, spare), near];
        let is_planar = rows == 2 && pose.kind.slots().last() != Some(&6);
        let reached =
            estimates.into_iter().filter(|(_, freedom)| *freedom > 0.0).map(|(sq, freedom)| {
                let one = 1.0 - (1.0 - coverage) / points.len() as f64;
                let factor = if is_planar {
                    planar_factor(one, freedom)
                } else {
                    coverage_factor(one, freedom)
                };
                Self { deviation: sq.sqrt(), freedom, reach: factor * sq.sqrt() }
            });
        reached.min_by(|a, b| a.reach.total_cmp(&b.reach))
    }

    /// The same where lengths are `scale` times as long.
    pub fn scaled(&self, scale: f64) -> Self {
        Self { deviation: self.deviation * scale, reach: self.reach * scale, ..*self }
    }
}

/// The nearest place of the feature to a point, and the distances along its normals.
pub struct Foot {
    /// The place.
    pub at: Vec3,
    /// The distances, of a surface one.
    pub distances: [f64; 2],
}

impl Foot {
    /// Beside `x`.
    pub fn of(pose: &Pose, x: &Vec3) -> Self {
        let (mut at, mut distances, mut row) = (*x, [0.0; 2], 0);
        Gauge::of(pose).rows(x, |d, slopes| {
            // moving the feature along its normal brings it nearer by as much
            at += pose.frame * Vec3::new(slopes[0], slopes[1], slopes[2]) * d;
            distances[row] = d;
            row += 1;
        });
        Self { at, distances }
    }

    fn squares(&self, about: &[f64; 2]) -> f64 {
        self.distances.iter().zip(about).map(|(d, m)| (d - m).powi(2)).sum()
    }
}

/// Mean square of a distance about the mean of two or three neighbours, and how many degrees of freedom it has for each row of a point.
fn among_neighbours(feet: &mut [Foot]) -> (f64, f64) {
    let (mut squares, mut freedom) = (0.0, 0.0);
    let rows = if feet.iter().all(|f| f.distances[1] == 0.0) { 1.0 } else { 2.0 };
    let mut pieces = vec![feet];
    while let Some(piece) = pieces.pop() {
        let n = piece.len();
        if n <= NEIGHBOURS {
            let mean = [0, 1].map(|k| piece.iter().map(|f| f.distances[k]).sum::<f64>() / n as f64);
            squares += piece.iter().map(|f| f.squares(&mean)).sum::<f64>();
            freedom += n as f64 - 1.0;
            continue;
        }
        let mut low = piece[0].at;
        let mut high = low;
        for foot in piece.iter() {
            (low, high) = (low.inf(&foot.at), high.sup(&foot.at));
        }
        let axis = (high - low).imax();
        piece.select_nth_unstable_by(n / 2, |a, b| a.at[axis].total_cmp(&b.at[axis]));
        let (left, right) = piece.split_at_mut(n / 2);
        pieces.extend([left, right]);
    }
    (squares / (rows * freedom).max(1.0), freedom)
}

/// Most neighbours that are compared: halves of more are no smaller than two.
const NEIGHBOURS: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::feature::FeatureType;
    use crate::fit::fits::Random;

    fn circle(n: usize, lobes: f64, noise: f64, random: &mut Random) -> Vec<Vec3> {
        let point = |k: usize| {
            let angle = k as f64 / n as f64 * std::f64::consts::TAU;
            let r = 10.0 + lobes * (3.0 * angle).cos() + noise * random.normal();
            Vec3::new(r * angle.cos(), r * angle.sin(), random.uniform(0.0, 5.0))
        };
        (0..n).map(point).collect()
    }

    fn tube() -> Pose {
        Pose::with_axis(FeatureType::Cylinder, Vec3::zeros(), Vec3::z(), [10.0, 0.0, 0.0])
    }

    #[test]
    fn noise_is_told_from_form_and_its_reach_holds_as_often_as_asked() {
        // all distances together have a deviation of 0.07 where there are lobes; neighbours of few points lie apart on them
        for (n, lobes, most) in [(200, 0.0, 1.05), (200, 0.1, 2.2), (2000, 0.1, 1.2)] {
            let (rounds, mut held, mut mean) = (300, 0, 0.0);
            for seed in 0..rounds {
                let noise = 0.01;
                let (mut other, mut random) = (Random::new(seed), Random::new(seed));
                let exact = circle(n, lobes, 0.0, &mut other);
                let points = circle(n, lobes, noise, &mut random);
                let found = Noise::of(&tube(), &points, 5, 0.9).unwrap();
                mean += found.deviation / noise / rounds as f64;
                let furthest = points
                    .iter()
                    .zip(exact)
                    .map(|(a, b)| (a.xy().norm() - b.xy().norm()).abs())
                    .fold(0.0, f64::max);
                held += usize::from(furthest <= found.reach);
            }
            assert!((0.95..most).contains(&mean), "{n} {lobes}: {mean}");
            let share = held as f64 / rounds as f64;
            // four standard deviations of a binomial below what is asked
            assert!(share > 0.83, "{n} {lobes}: {share}");
        }
    }

    #[test]
    fn as_many_points_as_unknowns_have_no_noise() {
        let points = circle(5, 0.0, 0.01, &mut Random::new(1));
        assert_eq!(Noise::of(&tube(), &points, 5, 0.95), None);
        assert!(Noise::of(&tube(), &circle(6, 0.0, 0.01, &mut Random::new(1)), 5, 0.95).is_some());
    }
}
