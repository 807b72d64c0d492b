use super::DirectSurface;
use crate::grow::Pool;

/// After so many cycles a region that still moves is taken as it is.
const MAX_CYCLES: usize = 50;

/// The points extracted for one surface.
pub struct Extracted {
    /// The surface of these points.
    pub surface: DirectSurface,
    /// Indices into the pool, ascending.
    pub members: Vec<u32>,
    /// How many points joined in each cycle.
    pub cycles: Vec<usize>,
}

/// The seed's extraction (section 3.2): all points within `threshold` of the surface, |x.a| <= t,
/// join; the surface is fitted anew; and again, until no point joins.
///
/// Points that the new surface no longer accepts leave. `None` where too few points remain for a fit.
pub fn extract(
    pool: &Pool,
    start: &DirectSurface,
    grown: &[u32],
    threshold: f64,
) -> Option<Extracted> {
    let mut inside = vec![false; pool.len()];
    grown.iter().for_each(|&i| inside[i as usize] = true);
    let (mut surface, mut cycles) = (*start, Vec::new());
    loop {
        let members: Vec<u32> = accepted(pool, &surface, threshold).collect();
        let joined = members.iter().filter(|&&i| !inside[i as usize]).count();
        if joined == 0 || cycles.len() == MAX_CYCLES {
            return Some(Extracted { surface, members, cycles });
        }
        cycles.push(joined);
        inside.fill(false);
        members.iter().for_each(|&i| inside[i as usize] = true);
        surface = DirectSurface::fit(members.iter().map(|&i| *pool.point(i)), surface.first_two)?;
    }
}

fn accepted(pool: &Pool, surface: &DirectSurface, threshold: f64) -> impl Iterator<Item = u32> {
    let near = move |i: &u32| surface.residual(pool.point(*i)) <= threshold;
    pool.available().iter().copied().filter(near)
}
