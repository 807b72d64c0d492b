//! What a surface must be to be reported.
//!
//! Surfaces that may not be reported still compete for points while surfaces are found, so that no
//! other surface grows over them; here they are taken out and their points stay unassigned.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit};
use crate::fit::{Held, Ruler, Shape, fit_held};
use crate::geometry::Vec3;
use crate::segment::objective::ACCEPT;
use crate::segment::report::allowed::may_be_reported;
use crate::segment::report::pieces::pieces;
use crate::segment::report::reasons::Reason;
use crate::segment::{Monitor, Parameters};

/// A surface and its points.
pub struct Candidate {
    /// The surface, relative to the cloud's centre.
    pub shape: Shape,
    /// The places of its points, rising.
    pub members: Vec<u32>,
    /// Points taken from it because they lie beyond the tolerance.
    pub rejected: usize,
    /// Largest distance of a point from it.
    pub reach: f64,
    /// The place of the surface among those found.
    pub source: usize,
    /// What a person knows of it beforehand; none where nobody told of it.
    pub told: Option<Held>,
}

constants! {
    /// A region's residuals may have a root mean square of this many times the noise that the caller gave.
    MOST_NOISE: f64 = 2.0, Trial(2.0, 2.0);
}

/// Largest root mean square that the residuals of a reported region may have: twice the noise that the caller
/// gave, or half the tolerance where one was given that allows more; infinite where no noise was given.
///
/// `rounding` is that of single precision: less than that no caller can mean, and the method reckons with none.
pub fn most_rms(given: &Parameters, rounding: f64) -> f64 {
    let allowed = given.tolerance.map_or(rounding, |t| rounding.max(t / ACCEPT.get()));
    given.noise_sigma.map_or(f64::INFINITY, |noise| MOST_NOISE.get() * noise.max(allowed))
}

/// Surfaces that meet every constraint, in the given order (pieces of one surface at its place), and
/// how many points lost theirs for each reason. It is the last look at what is reported, on all points: no fit
/// follows.
pub fn enforce(
    points: &[Vec3],
    mut found: Vec<Candidate>,
    parameters: &Parameters,
    most_rms: f64,
    monitor: &dyn Monitor,
) -> (Vec<Candidate>, BTreeMap<Reason, usize>) {
    let mut lost = BTreeMap::new();
    let mut lose = |reason, n: usize| *lost.entry(reason).or_insert(0) += n;
    let mut kept = Vec::new();
    let trimmed =
        found.par_iter_mut().map(|c| if monitor.cancelled() { 0 } else { trim(points, c) });
    lose(Reason::Outlier, trimmed.sum());
    for candidate in found {
        if monitor.cancelled() {
            break;
        }
        for piece in split(points, candidate, parameters) {
            lose(Reason::Outlier, piece.lost);
            let piece = piece.candidate;
            if piece.members.len() < parameters.min_points {
                lose(Reason::TooSmall, piece.members.len());
            } else if (piece.told.is_none() && !may_be_reported(&piece.shape, parameters))
                || rms(points, &piece) > most_rms
            {
                lose(Reason::NoQuadric, piece.members.len());
            } else {
                kept.push(piece);
            }
        }
    }
    for candidate in drop_smallest(&mut kept, parameters.max_regions) {
        lose(Reason::OverMaxRegions, candidate.members.len());
    }
    lost.retain(|_, n| *n > 0);
    (kept, lost)
}

/// Root mean square distance of a candidate's points from its surface.
fn rms(points: &[Vec3], candidate: &Candidate) -> f64 {
    let mut sum = 0.0;
    measure(points, candidate, |_, d| sum += d * d);
    (sum / candidate.members.len().max(1) as f64).sqrt()
}

/// Points measured at once.
const CHUNK: usize = 512;

/// Gives each of a candidate's points and its distance to `each`.
fn measure(points: &[Vec3], candidate: &Candidate, mut each: impl FnMut(u32, f64)) {
    let ruler = Ruler::of(&candidate.shape);
    let (mut at, mut distances) = (Vec::with_capacity(CHUNK), [0.0; CHUNK]);
    for members in candidate.members.chunks(CHUNK) {
        at.clear();
        at.extend(members.iter().map(|&i| points[i as usize]));
        ruler.distances(&at, &mut distances);
        members.iter().zip(&distances).for_each(|(i, d)| each(*i, *d));
    }
}

/// Takes the points beyond its reach from a candidate. Returns how many.
fn trim(points: &[Vec3], candidate: &mut Candidate) -> usize {
    let reach = candidate.reach;
    let mut kept = Vec::with_capacity(candidate.members.len());
    measure(points, candidate, |i, d| {
        if d.abs() <= reach {
            kept.push(i);
        }
    });
    let lost = candidate.members.len() - kept.len();
    candidate.members = kept;
    candidate.rejected += lost;
    lost
}

/// A piece of a candidate, and how many points beyond the tolerance its own fit cost it.
struct Piece {
    candidate: Candidate,
    lost: usize,
}

/// The pieces of a candidate that gaps wider than `connectivity` part, each fitted anew to its own
/// points; the candidate itself where no such length was given or it is in one piece.
fn split(points: &[Vec3], candidate: Candidate, parameters: &Parameters) -> Vec<Piece> {
    let whole = |candidate| vec![Piece { candidate, lost: 0 }];
    let Some(gap) = parameters.connectivity else { return whole(candidate) };
    let own: Vec<Vec3> = candidate.members.iter().map(|&i| points[i as usize]).collect();
    let sets = pieces(&own, gap);
    if sets.len() < 2 {
        return whole(candidate);
    }
    let options = Options { cauchy: None, steps: 15, tolerance: 1e-7 };
    let piece = |set: &Vec<u32>| {
        let part: Vec<Vec3> = set.iter().map(|&k| own[k as usize]).collect();
        let fitted = match candidate.told {
            Some(held) if !held.is_nothing() => fit_held(&candidate.shape, &part, &held),
            _ => fit(&candidate.shape, &part, None, &options),
        };
        let shape = fitted.map(|f| f.shape);
        let mut piece = Candidate {
            shape: shape.unwrap_or(candidate.shape),
            members: set.iter().map(|&k| candidate.members[k as usize]).collect(),
            rejected: 0,
            reach: candidate.reach,
            source: candidate.source,
            told: candidate.told,
        };
        let lost = trim(points, &mut piece);
        Piece { candidate: piece, lost }
    };
    sets.iter().map(piece).collect()
}

/// Takes the smallest candidates out until `most` are left; of equal ones the later. Returns them.
fn drop_smallest(kept: &mut Vec<Candidate>, most: usize) -> Vec<Candidate> {
    let mut order: Vec<usize> = (0..kept.len()).collect();
    order.sort_by_key(|&k| std::cmp::Reverse(kept[k].members.len()));
    let mut dropped = order.split_off(most.min(order.len()));
    dropped.sort_unstable_by(|a, b| b.cmp(a));
    dropped.into_iter().map(|k| kept.remove(k)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::segment::Silent;

    fn candidate(shape: Shape, members: Vec<u32>, reach: f64) -> Candidate {
        Candidate { shape, members, rejected: 0, reach, source: 0, told: None }
    }

    /// Two strips of the plane z = 0, 30 and 20 points wide, two apart, and a far point off it.
    fn strips() -> (Vec<Vec3>, Candidate) {
        let strip = |x: f64, n: usize| {
            (0..n * 3).map(move |k| Vec3::new(x + (k / 3) as f64 * 0.5, (k % 3) as f64 * 0.5, 0.0))
        };
        let mut points: Vec<Vec3> = strip(0.0, 30).chain(strip(16.5, 20)).collect();
        points.push(Vec3::new(1.0, 1.0, 0.3));
        let members = (0..points.len() as u32).collect();
        let shape = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
        (points, candidate(shape, members, f64::INFINITY))
    }

    fn sizes(parameters: &Parameters) -> (Vec<usize>, BTreeMap<Reason, usize>) {
        let (points, candidate) = strips();
        let (kept, lost) = enforce(&points, vec![candidate], parameters, f64::INFINITY, &Silent);
        (kept.iter().map(|c| c.members.len()).collect(), lost)
    }

    #[test]
    fn pieces_further_apart_than_the_connectivity_are_regions_of_their_own() {
        let default = Parameters::default();
        assert_eq!(sizes(&default), (vec![151], [].into()));
        let near = Parameters { connectivity: Some(1.9), ..default.clone() };
        assert_eq!(sizes(&near), (vec![91, 60], [].into()));
        let far = Parameters { connectivity: Some(2.1), ..default.clone() };
        assert_eq!(sizes(&far), (vec![151], [].into()));
        let large = Parameters { min_points: 70, ..near };
        assert_eq!(sizes(&large), (vec![91], [(Reason::TooSmall, 60)].into()));
    }

    #[test]
    fn points_beyond_the_tolerance_are_taken_from_their_surface() {
        let (points, strips) = strips();
        let candidate = Candidate { reach: 0.2, ..strips };
        let parameters = Parameters::default();
        let (kept, lost) = enforce(&points, vec![candidate], &parameters, f64::INFINITY, &Silent);
        assert_eq!((kept[0].members.len(), kept[0].rejected), (150, 1));
        assert_eq!(lost, [(Reason::Outlier, 1)].into());
    }

    #[test]
    fn a_piece_that_its_own_fit_moves_loses_what_then_lies_beyond_the_tolerance() {
        // A strip that is level but for its last row, and one far away that holds their common plane down there.
        let at = |x: f64, z: f64| (0..4).map(move |k| Vec3::new(x, 0.5 * f64::from(k), z));
        let near = (0..30).flat_map(|k| at(0.5 * f64::from(k), if k == 29 { 0.19 } else { 0.0 }));
        let points: Vec<Vec3> =
            near.chain((0..30).flat_map(|k| at(40.0 + 0.5 * f64::from(k), 0.0))).collect();
        let shape = Shape::with_axis(Family::Plane, Vec3::new(0.0, 0.0, 0.05), Vec3::z(), [0.0; 3]);
        let members = (0..points.len() as u32).collect();
        let candidate = candidate(shape, members, 0.15);
        let parameters = Parameters { connectivity: Some(2.0), ..Parameters::default() };
        let (kept, lost) = enforce(&points, vec![candidate], &parameters, f64::INFINITY, &Silent);
        for c in &kept {
            measure(&points, c, |i, d| assert!(d.abs() <= 0.15, "{i} {d}"));
        }
        assert_eq!(kept.iter().map(|c| c.rejected).collect::<Vec<_>>(), [4, 0]);
        assert_eq!(lost, [(Reason::Outlier, 4)].into());
    }

    #[test]
    fn a_region_of_more_than_twice_the_noise_given_is_none() {
        let given =
            |noise_sigma, tolerance| Parameters { noise_sigma, tolerance, ..Parameters::default() };
        assert_eq!(most_rms(&given(None, Some(0.1)), 0.0), f64::INFINITY);
        assert_eq!(most_rms(&given(Some(0.1), None), 0.01), 0.2);
        assert_eq!(most_rms(&given(Some(0.1), Some(0.1)), 0.01), 0.2);
        assert_eq!(most_rms(&given(Some(0.1), Some(0.8)), 0.01), 0.4);
        assert_eq!(most_rms(&given(Some(1e-9), None), 0.01), 0.02);
        // All points lie 0.1 off the plane, half of them on either side.
        let points: Vec<Vec3> = (0..100)
            .map(|k| {
                Vec3::new(f64::from(k / 10), f64::from(k % 10), if k % 2 == 0 { 0.1 } else { -0.1 })
            })
            .collect();
        let regions = |most| {
            let shape = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
            let (members, reach) = ((0..100).collect(), f64::INFINITY);
            let candidate = candidate(shape, members, reach);
            enforce(&points, vec![candidate], &Parameters::default(), most, &Silent)
        };
        assert_eq!(regions(0.1001).0.len(), 1);
        let (kept, lost) = regions(0.0999);
        assert_eq!((kept.len(), lost), (0, [(Reason::NoQuadric, 100)].into()));
    }

    #[test]
    fn the_largest_regions_stay_in_their_order() {
        let parameters = Parameters {
            connectivity: Some(1.9),
            max_regions: 1,
            min_points: 10,
            ..Parameters::default()
        };
        assert_eq!(sizes(&parameters), (vec![91], [(Reason::OverMaxRegions, 60)].into()));
        let two = Parameters { max_regions: 2, ..parameters };
        assert_eq!(sizes(&two).0, [91, 60]);
    }
}
