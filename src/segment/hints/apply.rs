//! The hints in their order.

use crate::segment::found::Found;
use crate::segment::hints::draft::Draft;
use crate::segment::hints::{merge, place, split, surface};
use crate::segment::outcome::Outcome;
use crate::segment::{Cancelled, Hint, HintAction, Monitor, Parameters};

/// Puts what the hints of `parameters` say in place, those that crop apart. `labels` are those of the file, one for each of
/// the distinct points.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn apply(
    found: &mut Found,
    labels: Option<&[i32]>,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Vec<Draft>, Cancelled> {
    let mut drafts = Vec::new();
    for (number, hint) in parameters.hints.iter().enumerate() {
        if hint.action == HintAction::Crop {
            continue;
        }
        monitor.check()?;
        drafts.push(one(found, number, hint, labels, parameters, monitor)?);
    }
    Ok(drafts)
}

fn one(
    found: &mut Found,
    number: usize,
    hint: &Hint,
    labels: Option<&[i32]>,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Draft, Cancelled> {
    if !hint.labels.is_empty() && labels.is_none() {
        let message =
            "the file has no column 'label' of whole numbers: send the PLY file of a result";
        return Ok(Draft::new(number, Outcome::NotFound, Vec::new(), message.to_owned()));
    }
    if hint.action == HintAction::Split {
        return split::apply(found, number, hint, labels, parameters, monitor);
    }
    let members = place::of_hint(found, hint, labels);
    if hint.action == HintAction::Merge {
        return merge::apply(found, number, hint, &members, parameters, monitor);
    }
    surface::apply(found, number, hint, &members, parameters, monitor)
}

#[cfg(test)]
mod tests;
