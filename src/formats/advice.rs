use super::{FormatError, Hints, Limits, read::each_point, sink::Sink, thin::thinned};
use crate::geometry::{PointCloud, Vec3};

/// Points that the advice is worked out from.
const SAMPLE: usize = 200_000;
/// Kept points of the sample, of each of which it has ten: then they are about as many as of all points.
const DENSE: usize = SAMPLE / 10;

/// A length that keeps no more than about `most` points of a cloud, rounded up; `None` where it cannot be told.
///
/// Goes through the file once. Kept points lie on surfaces, so they are a quarter as many at twice the length.
pub fn thin_for(bytes: &[u8], hints: Hints, most: u64) -> Option<f64> {
    let (cloud, _) = Some(sample(bytes, hints)?).filter(|_| most > 0)?;
    let none = || (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let bounds = |(low, high): (Vec3, Vec3), p: &Vec3| (low.inf(p), high.sup(p));
    let (low, high) = cloud.points.iter().fold(none(), bounds);
    let extent = (high - low).max();
    if !(extent > 0.0 && extent.is_finite()) {
        return None;
    }
    /// Halvings of the extent: to a part in a million.
    const STEPS: i32 = 20;
    let kept = |length| kept(&cloud, length);
    let enough =
        |length: &f64| kept(*length).is_some_and(|n| n > DENSE.min(cloud.points.len() / 10));
    let length = (1..STEPS).map(|k| extent * 0.5_f64.powi(k)).find(enough)?;
    // the sample is dense at twice that
    let at = 2.0 * length;
    let wanted = at * (kept(at)? as f64 / most as f64).sqrt();
    // a fifth more, for what is thin in the sample
    let wanted = 1.2 * wanted;
    let digit = 10f64.powf(wanted.log10().floor() - 1.0);
    let rounded = (wanted / digit).ceil() * digit;
    format!("{rounded:.1e}").parse().ok()
}

/// About how many points of a cloud of at most `points` a length keeps, rather more than less; all of them where that
/// cannot be told.
///
/// Goes through the file once.
pub(super) fn most_kept(bytes: &[u8], hints: Hints, length: f64, points: u64) -> u64 {
    let Some((cloud, is_all)) = sample(bytes, hints) else { return points };
    let some = cloud.points.len().max(1) as f64;
    let Some(kept) = kept(&cloud, length).map(|kept| kept as f64) else { return points };
    let most = if is_all {
        kept
    } else if kept <= some / 10.0 {
        // a fifth more, for what is thin in the sample
        1.2 * kept
    } else {
        // at the worst each of the sample stands for as many as it was taken from
        kept / some * points as f64
    };
    points.min(most.ceil() as u64)
}

/// Some of the points of a file, evenly, and whether they are all; `None` where it cannot be read.
fn sample(bytes: &[u8], hints: Hints) -> Option<(PointCloud, bool)> {
    let mut some = Thinly::default();
    each_point(bytes, hints, &Limits::of(usize::MAX), &mut some).ok()?;
    Some((PointCloud::from_points(some.points), some.apart == 0))
}

/// How many points of a cloud a length keeps.
fn kept(cloud: &PointCloud, length: f64) -> Option<usize> {
    Some(thinned(cloud, length, &Limits::of(usize::MAX)).ok()?.points.len())
}

/// Keeps every so many points: twice as many are passed over whenever there are enough.
#[derive(Default)]
struct Thinly {
    points: Vec<Vec3>,
    /// Powers of two.
    apart: u32,
    passed: usize,
}

impl Sink for Thinly {
    fn expect(&mut self, _: u64) -> Result<(), FormatError> {
        Ok(())
    }

    fn take(&mut self, points: &[Vec3]) -> Result<(), FormatError> {
        for p in points {
            if self.passed.is_multiple_of(1 << self.apart) && p.iter().all(|x| x.is_finite()) {
                if self.points.len() >= 2 * SAMPLE {
                    let mut k = 0;
                    self.points.retain(|_| {
                        k += 1;
                        k % 2 == 1
                    });
                    self.apart += 1;
                }
                self.points.push(*p);
            }
            self.passed += 1;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::read;

    #[test]
    fn what_a_length_keeps_is_told_rather_too_high() {
        let n = 1_000_000;
        let point = |k: u32| {
            let (turn, z) = (f64::from(k) * 2.399_963, f64::from(k) * 20.0 / f64::from(n));
            [5.0 * turn.cos(), 5.0 * turn.sin(), z]
        };
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty double x\nproperty double y\n\
             property double z\nend_header\n"
        )
        .into_bytes();
        (0..n).for_each(|k| point(k).iter().for_each(|x| bytes.extend(x.to_le_bytes())));
        for (length, most) in [(1.0, 1.3), (0.2, 1.3), (0.06, 4.0), (0.001, 1.0)] {
            let hints = Hints { thin: Some(length), ..Hints::default() };
            let kept = read(&bytes, hints, &Limits::default()).unwrap().points.len() as f64;
            let told = most_kept(&bytes, hints, length, n.into()) as f64;
            assert!((1.0..=most).contains(&(told / kept)), "{length}: {told} for {kept}");
        }
        let few = b"0 0 0\n1 0 0\n1.1 0 0\n";
        assert_eq!(most_kept(few, Hints::default(), 0.5, 3), 2);
        assert_eq!(most_kept(b"ply\n", Hints::default(), 0.5, 7), 7);
    }

    #[test]
    fn a_length_is_told_that_keeps_about_as_many_points_as_may_be() {
        // a tube of radius 5 and length 20
        let point = |k: u32| {
            let (turn, z) = (f64::from(k) * 2.399_963, f64::from(k) * 20.0 / 600_000.0);
            format!("{} {} {z}\n", 5.0 * turn.cos(), 5.0 * turn.sin())
        };
        let bytes = (0..600_000).map(point).collect::<String>().into_bytes();
        for most in [500, 5000, 40_000] {
            let length = thin_for(&bytes, Hints::default(), most).unwrap();
            let hints = Hints { thin: Some(length), ..Hints::default() };
            let kept = read(&bytes, hints, &Limits::default()).unwrap().points.len() as u64;
            assert!((most / 4..=most).contains(&kept), "{kept} of {most} by {length}");
        }
        assert_eq!(thin_for(&bytes, Hints::default(), 0), None);
        assert_eq!(thin_for(b"1 2 3\n1 2 3\n", Hints::default(), 9), None);
        assert_eq!(thin_for(b"ply\n", Hints::default(), 9), None);
    }
}
