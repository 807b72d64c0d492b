//! Leaving out what nobody asks about.

use crate::geometry::{PointCloud, Vec3};
use crate::segment::outcome::{HintOutcome, Outcome};
use crate::segment::{Extent, Hint, HintAction};

/// Which points of a cloud are looked at: those in any of the hints that crop. `None` where no hint does.
pub fn kept(cloud: &PointCloud, hints: &[Hint]) -> Option<Vec<bool>> {
    let crops: Vec<&Hint> = hints.iter().filter(|h| h.action == HintAction::Crop).collect();
    if crops.is_empty() {
        return None;
    }
    let within = |i: usize| crops.iter().any(|hint| is_meant(cloud, hint, i));
    Some((0..cloud.points.len()).map(within).collect())
}

/// What became of the hints that crop.
pub fn outcomes(cloud: &PointCloud, hints: &[Hint]) -> Vec<HintOutcome> {
    let crops = hints.iter().enumerate().filter(|(_, h)| h.action == HintAction::Crop);
    crops
        .map(|(hint, crop)| {
            let n = (0..cloud.points.len()).filter(|&i| is_meant(cloud, crop, i)).count();
            let outcome = if n > 0 { Outcome::Applied } else { Outcome::NotFound };
            let message = match (n, crop.labels.is_empty() || cloud.labels.is_some()) {
                (_, false) => {
                    "the file has no column 'label' of whole numbers: send the PLY file of a result"
                        .to_owned()
                }
                (0, _) => "no point lies there".to_owned(),
                _ => format!("{n} points lie there"),
            };
            HintOutcome { hint, outcome, regions: Vec::new(), scatter: None, misfit: None, message }
        })
        .collect()
}

/// Whether a point lies in a hint's box, or carries one of its labels.
fn is_meant(cloud: &PointCloud, hint: &Hint, i: usize) -> bool {
    hint.extent.is_some_and(|e| is_within(&e, &cloud.points[i]))
        || cloud.labels.as_ref().is_some_and(|labels| hint.labels.contains(&labels[i]))
}

/// Whether a box holds a point.
pub fn is_within(extent: &Extent, p: &Vec3) -> bool {
    (0..3).all(|k| p[k] >= extent.min[k] && p[k] <= extent.max[k])
}

#[cfg(test)]
mod tests;
