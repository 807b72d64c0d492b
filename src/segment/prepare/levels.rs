//! How patches scatter at a level of thinning, by groups of sites that lie together.

use crate::fit::constant::constants;
use crate::segment::median::median;
use crate::segment::prepare::patch::Patch;
use crate::segment::prepare::steps::rounding;

constants! {
    /// Sites of a group: enough for a quantile, few enough to lie together.
    TOGETHER: usize = 20, Trial(20.0, 20.0);
    /// Sites from the beginning of one group to that of the next.
    APART: usize = 10, Effort("groups looked at");
    /// Patches of a group that tell something.
    ENOUGH: usize = 8, Trial(8.0, 8.0);
    /// Breadth from which on a patch spans two directions: that of a row beside one more comes to 0.05.
    BROAD: f64 = 0.1, Trial(0.1, 0.1);
    /// The 25 % quantile of the scatter of patches, over sigma.
    QUARTER: f64 = 0.889, Derived("sqrt(chi2_18(0.25) / 18) = 0.8716, and 2 % as the patches of a group share points");
    /// The same quantile of the scatter of the nearest half of a patch.
    NEARER_QUARTER: f64 = 0.774, Derived("sqrt(chi2_6(0.25) / 6) = 0.7588, and 2 % as the patches of a group share points");
    /// Share of two sheets among a group's patches from which on these tell the noise.
    SHEETS: f64 = 0.3, Trial(0.3, 0.3);
}

/// What patches at one level tell.
pub struct Level {
    /// Scatter of each group, as a standard deviation; `None` where its patches tell nothing.
    pub scatter: Vec<Option<f64>>,
    /// Of each group the median breadth of the patches' nearest points.
    pub inner_breadths: Vec<f64>,
    /// Median over the groups of the same by the nearest half of each patch.
    pub nearer: Option<f64>,
    /// Median reach of the patches.
    pub reach: f64,
    /// Median thickness of the patches.
    pub thickness: f64,
    /// Median breadth of the patches' nearest points.
    pub inner_breadth: f64,
}

impl Level {
    /// `steps` of the coordinates are what noise is never below.
    pub fn of(patches: &[Option<Patch>], steps: &[f64; 3]) -> Self {
        let middle = |of: &dyn Fn(&Patch) -> f64| middle_of(patches, of);
        let starts = (0..patches.len().max(1)).step_by(APART.get());
        let nearer = |g: &[Option<Patch>]| {
            Some(quarter(g.iter().flatten().map(|p| p.nearer).collect())? / NEARER_QUARTER.get())
        };
        let groups =
            starts.map(|s| &patches[s.min(patches.len())..patches.len().min(s + TOGETHER.get())]);
        Self {
            nearer: median(&mut groups.clone().filter_map(nearer).collect::<Vec<_>>()),
            inner_breadths: groups.clone().map(|g| middle_of(g, &|p| p.inner_breadth)).collect(),
            scatter: groups.map(|g| group_scatter(g, steps)).collect(),
            reach: middle(&|p| p.reach),
            thickness: middle(&Patch::thickness),
            inner_breadth: middle(&|p| p.inner_breadth),
        }
    }

    /// Share of the groups that tell something.
    pub fn usable(&self) -> f64 {
        let usable = self.scatter.iter().flatten().count();
        usable as f64 / self.scatter.len().max(1) as f64
    }

    /// Median scatter of the groups.
    pub fn median_scatter(&self) -> Option<f64> {
        median(&mut self.scatter.iter().flatten().copied().collect::<Vec<_>>())
    }

    /// That of the cleanest twentieth of those whose patches' nearest points lie broader than `spanned`: along a row
    /// there is little to see.
    pub fn least_scatter(&self, spanned: f64) -> Option<f64> {
        let broad = self.scatter.iter().zip(&self.inner_breadths).filter(|g| *g.1 > spanned);
        let mut all: Vec<f64> = broad.filter_map(|g| *g.0).collect();
        all.sort_unstable_by(f64::total_cmp);
        all.get(all.len() / 20).copied()
    }

    /// How the scatter grows to that of a thinner level: the lower quartile over groups.
    pub fn growth(&self, next: &Self) -> Option<f64> {
        let both = self.scatter.iter().zip(&next.scatter);
        let of = |(a, b): (&Option<f64>, &Option<f64>)| Some(b.as_ref()? / a.as_ref()?);
        quarter(both.filter_map(of).filter(|g| g.is_finite()).collect())
    }
}

/// The median of what is finite of something of the patches; nought of none.
fn middle_of(patches: &[Option<Patch>], of: &dyn Fn(&Patch) -> f64) -> f64 {
    let all = patches.iter().flatten().map(of);
    median(&mut all.filter(|x| x.is_finite()).collect::<Vec<_>>()).unwrap_or(0.0)
}

/// The scatter that a group's broad patches tell of.
fn group_scatter(group: &[Option<Patch>], steps: &[f64; 3]) -> Option<f64> {
    let broad: Vec<&Patch> = group.iter().flatten().filter(|p| p.breadth > BROAD.get()).collect();
    if broad.len() < ENOUGH.get() {
        return None;
    }
    let sheets: Vec<f64> = broad.iter().filter_map(|p| p.of_sheets).collect();
    let told = if sheets.len() as f64 >= SHEETS.get() * broad.len() as f64 {
        sheets
    } else {
        broad.iter().map(|p| p.scatter).collect()
    };
    let floor = quarter(broad.iter().map(|p| rounding(steps, &p.normal)).collect())?;
    Some((quarter(told)? / QUARTER.get()).max(floor))
}

/// The 25 % quantile of some values, between two in proportion.
fn quarter(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let at = 0.25 * (values.len().checked_sub(1)? as f64);
    let (low, high) = (values[at.floor() as usize], values[at.ceil() as usize]);
    Some(low + (high - low) * at.fract())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn a_quarter_of_the_values_lies_below_the_quarter() {
        assert_eq!(quarter(vec![4.0, 0.0, 1.0, 2.0, 3.0]), Some(1.0));
        assert_eq!(quarter(vec![2.0, 1.0, 3.0]), Some(1.5));
        assert_eq!(quarter(Vec::new()), None);
    }

    #[test]
    fn the_cleanest_groups_are_none_whose_points_lie_on_a_row() {
        let patch = |scatter: f64, inner_breadth: f64| Patch {
            scatter,
            of_sheets: None,
            nearer: scatter,
            reach: 10.0,
            breadth: 0.8,
            inner_breadth,
            normal: Vec3::z(),
        };
        let groups = |row: f64| {
            let of = |k: usize| if k < 40 { patch(0.01, row) } else { patch(1.0, 0.6) };
            let patches: Vec<Option<Patch>> = (0..400).map(|k| Some(of(k))).collect();
            Level::of(&patches, &[0.0; 3]).least_scatter(0.1).map(|s| s * QUARTER.get())
        };
        assert_eq!((groups(0.001), groups(0.3)), (Some(1.0), Some(0.01)));
    }

    #[test]
    fn patches_on_a_line_tell_nothing_and_sheets_tell_the_noise_of_each() {
        let patch = Patch {
            scatter: 1.0,
            of_sheets: None,
            nearer: 1.0,
            reach: 10.0,
            breadth: 0.8,
            inner_breadth: 0.8,
            normal: Vec3::z(),
        };
        let none = [0.0; 3];
        let on_a_line = Patch { breadth: 0.01, ..patch };
        assert_eq!(group_scatter(&[Some(on_a_line); 20], &none), None);
        let one = group_scatter(&[Some(patch); 20], &none);
        assert_eq!(one, Some(1.0 / QUARTER.get()));
        let two = group_scatter(&[Some(Patch { of_sheets: Some(0.1), ..patch }); 20], &none);
        assert_eq!(two, Some(0.1 / QUARTER.get()));
        let stepped = group_scatter(&[Some(patch); 20], &[0.0, 0.0, 12.0]);
        assert_eq!(stepped, Some(12_f64.sqrt()));
    }
}
