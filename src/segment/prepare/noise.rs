//! The noise of a cloud, from the scatter of patches in ever thinner parts of it.
//!
//! Where points lie on rows, in steps, or closer to each other than the noise, their nearest neighbours tell of how they
//! were taken and not of the noise. Thinned at random a cloud loses that structure, until patches reach over edges
//! and curvature: in between lies the noise.

use std::sync::Arc;

use crate::fit::constant::constants;
use crate::fit::general_fit;
use crate::geometry::Vec3;
use crate::segment::Monitor;
use crate::segment::prepare::levels::Level;
use crate::segment::prepare::off_rows::{Even, SPANNED, off_rows};
use crate::segment::prepare::profiles::Profiles;
use crate::segment::prepare::steps::{coarser, steps};
use crate::segment::prepare::thinned::Thinned;

constants! {
    /// Median roughness above which points fill a volume (1/3 in an even filling).
    pub VOLUME: f64 = 0.12, Trial(0.12, 0.12);
    /// Share of the groups of patches that tell something at the first level looked at.
    USABLE: f64 = 0.6, Trial(0.6, 0.6);
    /// Thickness of patches, scatter over reach, in a filled volume: 0.45 to 0.6 there.
    FILLED: f64 = 0.4, Trial(0.4, 0.4);
    /// Thickness of patches that are a good part as thick as wide.
    THICK: f64 = 0.2, Trial(0.2, 0.2);
    /// Thickness of patches that lie within the noise.
    WITHIN: f64 = 0.44, Trial(0.44, 0.44);
    /// Thickness of thin patches.
    THIN: f64 = 0.025, Trial(0.025, 0.025);
    /// Thickness of the thinnest ones.
    THINNEST: f64 = 0.012, Trial(0.012, 0.012);
    /// Thickness up to which one large growth may be followed by an even level.
    EVEN: f64 = 0.05, Trial(0.05, 0.05);
    /// Growth of the scatter by which a thinner part of the cloud still lies within the noise.
    GROWN: f64 = 1.2, Trial(1.2, 1.2);
    /// The same of patches as thick as wide.
    GROWN_THICK: f64 = 1.25, Trial(1.25, 1.25);
    /// The same of those within the noise: that of the spacing is 1.6 for a quarter of the points.
    GROWN_WITHIN: f64 = 1.7, Trial(1.7, 1.7);
    /// The same of thin patches, which see edges and curvature only as a large growth.
    GROWN_THIN: f64 = 1.5, Trial(1.5, 1.5);
    /// The same of the thinnest.
    GROWN_THINNEST: f64 = 2.5, Trial(2.5, 2.5);
    /// Growth below which a level saw walls for noise that the next one tells apart.
    SHRUNK: f64 = 0.5, Trial(0.5, 0.5);
    /// Growth beyond which edges and walls have come in: that by curvature alone is 8.
    STEEPEST: f64 = 9.0, Derived("curvature's 8, and an eighth more for quantiles");
    /// Least share of the first level's scatter that is not put down to curvature.
    STRAIGHTENED: f64 = 0.3, Trial(0.3, 0.3);
    /// Scatter of the cleanest twentieth of the places, over the median, below which it is the noise.
    CLEAN: f64 = 0.1, Trial(0.1, 0.1);
    /// Points of a cloud so small that it may be one surface of which a patch is a good part.
    FEW: usize = 96, Derived("four patches of 24");
}

/// What is known of a cloud's noise before any surface is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Noise {
    /// Standard deviation of the points along their normals; 0 where the points are exact.
    pub sigma: f64,
    /// Whether points fill a volume: patches stay as thick as wide however few points are left.
    pub fills_volume: bool,
    /// The places of points of the cloud whose neighbourhoods span two directions, where those of all lie on rows.
    pub even: Option<Arc<[u32]>>,
    /// The profiles that these points lie on, where surfaces bend more along them than they are apart.
    pub profiles: Option<Profiles>,
    /// The even step of each coordinate, nought where it has none.
    pub steps: [f64; 3],
    /// Whether surfaces with less have been taken out.
    pub rougher: bool,
}

/// The noise of points in Morton order, whose coordinates are known to come in steps of `known` at least, nought where they
/// are not. Half of it where `monitor` cancels.
///
/// By trial on 146 clouds within 0.7 to 1.4 of the truth but for noise that is correlated over more than the spacing
/// and larger than what is not.
pub fn estimate(points: &[Vec3], known: &[f64; 3], monitor: &dyn Monitor) -> Noise {
    let steps = coarser(&steps(points), known);
    Noise { steps, ..of_stepped(points, &steps, monitor) }
}

fn of_stepped(points: &[Vec3], steps: &[f64; 3], monitor: &dyn Monitor) -> Noise {
    let Some(first) = Thinned::of(points, monitor).level(0).map(|p| Level::of(&p, steps)) else {
        return of_few(points);
    };
    let Some(Even { places, points: even, profiles }) = off_rows(points, &first, monitor) else {
        return of_levels(points, vec![first], steps, monitor);
    };
    let seen = match profiles {
        Some(all) => even.iter().map(|p| all.drawn(p)).collect(),
        None => even,
    };
    let levels = Thinned::of(&seen, monitor).level(0).map(|p| Level::of(&p, steps));
    let noise = match levels {
        Some(first) => of_levels(&seen, vec![first], steps, monitor),
        None => of_few(&seen),
    };
    Noise { even: Some(places.into()), profiles, ..noise }
}

/// The noise of points too few for levels.
fn of_few(points: &[Vec3]) -> Noise {
    Noise { sigma: of_one_quadric(points), ..Noise::default() }
}

/// What ever thinner levels of points tell, the first of them at hand.
fn of_levels(
    points: &[Vec3],
    mut levels: Vec<Level>,
    steps: &[f64; 3],
    monitor: &dyn Monitor,
) -> Noise {
    let thinned = Thinned::of(points, monitor);
    let level = |l: u32| thinned.level(l).map(|patches| Level::of(&patches, steps));
    let spanned = first_spanned(&mut levels, level);
    // Where some places scatter far less than most, these see edges and walls.
    let least = levels[spanned].least_scatter(SPANNED.get()).zip(levels[spanned].median_scatter());
    let clean = least.filter(|(least, most)| spanned == 0 && *least < CLEAN.get() * most);
    let mut first = spanned;
    while let Some(next) = level(levels.len() as u32).filter(|_| levels.len() == first + 1) {
        levels.push(next);
        if levels[first].growth(&levels[first + 1]).is_none_or(|g| g > SHRUNK.get()) {
            break;
        }
        first += 1;
    }
    let sigma = levels[first].median_scatter().unwrap_or(0.0);
    let fills_volume = fills_volume(&mut levels, first, level);
    let thin_bodies = of_thin_bodies(&levels, first, sigma);
    let fills_volume = fills_volume && thin_bodies.is_none() && clean.is_none();
    let sigma = match thin_bodies.or(clean.map(|c| c.0)) {
        Some(least) => least,
        None if fills_volume => sigma,
        None => sigma * climb(&mut levels, first, level),
    };
    let few = points.len() < FEW.get();
    let sigma = if few { of_one_quadric(points).min(sigma) } else { sigma };
    Noise { sigma, fills_volume, ..Noise::default() }
}

/// Scatter about the quadric of any type that fits all points best.
fn of_one_quadric(points: &[Vec3]) -> f64 {
    let Some(quadric) = general_fit(points, None) else { return 0.0 };
    let sum: f64 = points.iter().map(|p| quadric.distance(p).powi(2)).sum();
    let freedom = points.len().saturating_sub(9).max(1) as f64;
    (sum / freedom).sqrt()
}

/// The first level whose neighbours span two directions, or else the one at which most groups tell something.
fn first_spanned(levels: &mut Vec<Level>, level: impl Fn(u32) -> Option<Level>) -> usize {
    let tells = |l: &Level| l.spans() && l.usable() >= USABLE.get();
    while !levels.last().is_some_and(tells) {
        let Some(next) = level(levels.len() as u32) else {
            let usable = |k: &usize| levels[*k].usable();
            let all = (0..levels.len()).rev();
            return all.max_by(|a, b| usable(a).total_cmp(&usable(b))).unwrap_or(0);
        };
        levels.push(next);
    }
    levels.len() - 1
}

/// The scatter of half patches where whole ones bend around bodies as small as they: it is a good deal smaller, and that
/// of the next level larger than by any noise.
fn of_thin_bodies(levels: &[Level], first: usize, sigma: f64) -> Option<f64> {
    let growth = levels[first].growth(levels.get(first + 1)?)?;
    let Level { reach, nearer, .. } = levels[first];
    // Thinner groups than that tell of no bend.
    let thick = sigma > THINNEST.get() * reach;
    let bends = thick && levels[first].spans() && growth > GROWN_THINNEST.get();
    nearer.filter(|nearer| bends && *nearer < SHRUNK.get() * sigma)
}

/// Whether patches are as thick as wide at all levels, to the thinnest: those of a sheet get flat in the end.
fn fills_volume(
    levels: &mut Vec<Level>,
    first: usize,
    level: impl Fn(u32) -> Option<Level>,
) -> bool {
    for l in first.. {
        if l == levels.len() {
            let Some(next) = level(l as u32) else { return l > first + 1 };
            levels.push(next);
        }
        if levels[l].thickness < FILLED.get() {
            break;
        }
    }
    false
}

/// How many times the scatter grows beyond the first level's within the noise.
fn climb(levels: &mut Vec<Level>, first: usize, level: impl Fn(u32) -> Option<Level>) -> f64 {
    let mut growths: Vec<f64> = Vec::new();
    for l in first.. {
        // the growth to the next level, and that beyond
        while levels.len() < l + 3 {
            let Some(next) = level(levels.len() as u32) else { break };
            levels.push(next);
        }
        let growth = |k: usize| levels.get(k + 1).and_then(|next| levels[k].growth(next));
        let Some(g) = growth(l) else { break };
        let (own, next) = (levels[l].thickness, levels[l + 1].thickness);
        let beyond = growth(l + 1);
        let even = next < EVEN.get()
            && g < GROWN_THINNEST.get()
            && beyond.is_some_and(|h| h < GROWN_THICK.get());
        let bends = beyond.is_none() && g > GROWN_THICK.get();
        if g >= most_growth(own, next) && !even || next > THIN.get().max(2.0 * own) || bends {
            break;
        }
        growths.push((g * straightened(beyond)).max(1.0));
    }
    let growth = |k: usize| levels.get(k + 1).and_then(|next| levels[k].growth(next));
    let bend = straightened(growth(first)).max(STRAIGHTENED.get());
    let last = growths.last().map_or(1.0, |g| g.sqrt());
    bend * growths.iter().product::<f64>() / last
}

/// Share of a level's scatter that is not curvature, from the growth to the next, at twice the spacing: what a quadric
/// does not follow grows with the third power of the spacing or faster, its square 64 times; noise does not.
fn straightened(growth: Option<f64>) -> f64 {
    let curved = growth.filter(|g| *g < STEEPEST.get()).map_or(0.0, |g| (g * g - 1.0) / 63.0);
    (1.0 - curved.max(0.0)).max(0.0).sqrt()
}

/// The growth from a level of one thickness to one of another up to which both lie within the noise.
fn most_growth(own: f64, next: f64) -> f64 {
    match () {
        () if next < THINNEST.get() => GROWN_THINNEST.get(),
        () if next < THIN.get() => GROWN_THIN.get(),
        () if own > WITHIN.get() => GROWN_WITHIN.get(),
        () if own > THICK.get() => GROWN_THICK.get(),
        () => GROWN.get(),
    }
}

#[cfg(test)]
mod tests;
