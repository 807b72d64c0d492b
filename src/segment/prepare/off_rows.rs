//! Points of a cloud on rows, as far apart along these as across.

use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::Monitor;
use crate::segment::median::median;
use crate::segment::prepare::closest::MANY;
use crate::segment::prepare::even::even as apart;
use crate::segment::prepare::levels::Level;
use crate::segment::prepare::nearest::Runs;
use crate::segment::prepare::patch::inner_breadth;
use crate::segment::prepare::place::place;
use crate::segment::prepare::profiles::Profiles;

constants! {
    /// Breadth of the nearest points from which on they span two directions: less, and they lie on one row.
    pub SPANNED: f64 = 0.1, Trial(0.1, 0.1);
    /// Spacing of the points of a row over the reach of a patch on it.
    ROW_SPACING: f64 = 0.144, Derived("root mean square distance of 24 points in a row from their middle: sqrt(12) / 24");
    /// Sites whose neighbourhoods are looked at for their breadth.
    SITES: usize = 500, Effort("sites looked at");
    /// Spacing at which profiles bend over that at which they are looked at: of a round one 20 points come to about 80.
    DENSER: f64 = 4.0, Trial(2.0, 8.0);
    /// Spacing of profiles drawn together over the least along them, so that patches take in few of them: points are 1 to 2
    /// of the least apart.
    APART: f64 = 2.0, Trial(2.0, 4.0);
    /// Thickness of patches from which on what spans two directions may be the noise of points on rows.
    ROUGH_ROWS: f64 = 0.1, Trial(0.1, 0.1);
    /// Points among which profiles are looked for where all lie within the noise.
    LOOKED_AT: usize = 25_000, Effort("points looked at");
}

/// Points of a cloud no two of which are close together.
pub struct Even {
    pub places: Vec<u32>,
    pub points: Vec<Vec3>,
    /// The profiles that they lie on, where their neighbourhoods span two directions only by these.
    pub profiles: Option<Profiles>,
}

/// The densest even part of a cloud whose neighbourhoods span two directions, where those of all its points, which
/// `first` tells of, do not. None where there is none of enough points.
///
/// Neighbourhoods that span two directions along a curve do so because it bends: these lie on profiles further apart than
/// that, and are taken denser. Where those of all points span two directions within the noise, profiles alone are looked for.
pub fn off_rows(points: &[Vec3], first: &Level, monitor: &dyn Monitor) -> Option<Even> {
    let on_rows = !first.spans();
    if !on_rows && first.thickness < ROUGH_ROWS.get() {
        return None;
    }
    // Neighbours of a row are about a seventh of a patch's reach apart, and other rows are farther off than that.
    let mut radius = first.reach * ROW_SPACING.get();
    let mut even = Even::of(points, if on_rows { points.len() } else { LOOKED_AT.get() });
    let mut bent = None;
    // No radius grows from nothing.
    while radius > 0.0 && !monitor.cancelled() {
        radius *= 2.0_f64.sqrt();
        even = even.thinner(radius);
        if even.points.len() < MANY {
            break;
        }
        let profiles = Profiles::of(&even.points, radius);
        let spans = spans(&even.points);
        if spans && profiles.is_none() && on_rows {
            return Some(even);
        }
        bent = profiles.map(|all| (all, radius / DENSER.get())).or(bent);
        if spans && bent.is_some() {
            break;
        }
    }
    let (profiles, radius) = bent?;
    let all = Even::of(points, points.len()).thinner(radius);
    Some(Even { profiles: Some(profiles.drawn_to(APART.get() * radius)), ..all })
}

impl Even {
    /// At most so many of some points, evenly along their order.
    fn of(points: &[Vec3], most: usize) -> Self {
        let m = points.len().min(most);
        let places: Vec<u32> = (0..m).map(|k| place(k, m, points.len()) as u32).collect();
        let points = places.iter().map(|&i| points[i as usize]).collect();
        Self { places, points, profiles: None }
    }

    /// Those of them no two of which are nearer to each other than `radius`.
    fn thinner(&self, radius: f64) -> Self {
        let some = apart(&self.points, radius);
        let places = some.iter().map(|&k| self.places[k as usize]).collect();
        let points = some.iter().map(|&k| self.points[k as usize]).collect();
        Self { places, points, profiles: None }
    }
}

/// Whether neighbourhoods of points in Morton order span two directions.
fn spans(points: &[Vec3]) -> bool {
    let (runs, sites) = (Runs::of(points), points.len().min(SITES.get()));
    let breadth = |k: usize| {
        let site = place(k, sites, points.len());
        let near = runs.closest(&points[site], site);
        inner_breadth(&near.places().iter().map(|&j| points[j as usize]).collect::<Vec<_>>())
    };
    median(&mut (0..sites).map(breadth).collect::<Vec<_>>()).is_some_and(|b| b > SPANNED.get())
}

impl Level {
    /// Whether neighbours span two directions.
    pub fn spans(&self) -> bool {
        self.inner_breadth > SPANNED.get()
    }
}
