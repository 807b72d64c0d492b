use super::{candidate::Candidate, surface::FittedSurface, watched::watched};
use crate::fit::constant::constants;
use crate::segment::Monitor;
use crate::segment::rcond::grow::Pool;

constants! {
    /// After so many cycles a region that still moves is taken as it is.
    MAX_CYCLES: usize = 50, Effort("cycles");
}

/// The points extracted for one surface.
pub struct Extracted {
    /// The surface of these points.
    pub surface: FittedSurface,
    /// Indices into the pool, ascending.
    pub members: Vec<u32>,
    /// How many points joined in each cycle.
    pub cycles: Vec<usize>,
    /// How often each strategy led its growth on.
    pub strategies: [usize; 3],
}

/// The seed's extraction (section 3.2): all points within `threshold` of the surface, |x.a| <= t,
/// join; the surface is fitted anew; and again, until no point joins.
///
/// Points that the new surface no longer accepts leave: a few of a neighbour's in the grown region
/// must not hold its surface off. `None` where too few points remain for a fit.
pub fn extract(
    pool: &Pool,
    candidate: &Candidate,
    threshold: f64,
    monitor: &dyn Monitor,
) -> Option<Extracted> {
    let mut extracted = Extracted {
        surface: candidate.surface,
        members: candidate.grown.region.members().to_vec(),
        cycles: Vec::new(),
        strategies: candidate.grown.strategies,
    };
    extracted.members.sort_unstable();
    let mut inside = vec![false; pool.len()];
    while extracted.cycles.len() < MAX_CYCLES.get() && !monitor.cancelled() {
        let surface = &extracted.surface;
        let members: Vec<u32> = accepted(pool, surface, threshold, monitor).collect();
        if members == extracted.members {
            break;
        }
        inside.fill(false);
        extracted.members.iter().for_each(|&i| inside[i as usize] = true);
        extracted.cycles.push(members.iter().filter(|&&i| !inside[i as usize]).count());
        let points = watched(members.iter().map(|&i| *pool.point(i)), monitor);
        extracted.surface = FittedSurface::fit(points, surface.first_two)?;
        extracted.members = members;
    }
    Some(extracted)
}

fn accepted<'a>(
    pool: &'a Pool,
    surface: &'a FittedSurface,
    threshold: f64,
    monitor: &'a dyn Monitor,
) -> impl Iterator<Item = u32> + 'a {
    let near = move |i: &u32| surface.residual_within(pool.point(*i), threshold).is_some();
    watched(pool.available().iter().copied(), monitor).filter(near)
}
