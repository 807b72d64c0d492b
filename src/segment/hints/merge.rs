//! Regions that are one surface.

use crate::segment::found::Found;
use crate::segment::hints::draft::Draft;
use crate::segment::hints::extend::extend;
use crate::segment::hints::local::{refitted, rms, sigma, within};
use crate::segment::hints::place::{self, of_region};
use crate::segment::hints::surface::{Proposal, draft, propose};
use crate::segment::objective::{ACCEPT, HALF, MOST};
use crate::segment::outcome::Outcome;
use crate::segment::{Cancelled, Hint, Monitor, Parameters};

/// Does what a hint of the action `merge` says.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn apply(
    found: &mut Found,
    number: usize,
    hint: &Hint,
    members: &[u32],
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<Draft, Cancelled> {
    let regions = place::regions(found, members);
    let about = about(found, &regions, hint);
    if about.len() < 2 {
        let message = match about.len() {
            1 => "there is one region already",
            _ => "no region lies there",
        };
        let outcome = if about.is_empty() { Outcome::NotFound } else { Outcome::Applied };
        return Ok(Draft::new(number, outcome, about, message.to_owned()));
    }
    let parts: Vec<Vec<u32>> = about.iter().map(|&l| of_region(found, l as i32)).collect();
    let mut all: Vec<u32> = parts.concat();
    all.sort_unstable();
    let sigma = sigma(found, &regions, parameters);
    let reach = ACCEPT.get() * sigma;
    let proposal = propose(found, &all, hint, sigma, parameters, monitor)?;
    let refused = |message: String, scatter| {
        let mut draft = Draft::new(number, Outcome::Contradicted, about.clone(), message);
        draft.outcome.scatter = scatter;
        draft
    };
    let Some(Proposal { shape, compared, .. }) = proposal else {
        return Ok(refused("no one surface fits the points of all of them".to_owned(), None));
    };
    let off = rms(found, &all, &shape) / sigma;
    let missed = |part: &Vec<u32>| {
        (within(found, part, &shape, reach).len() as f64) < MOST.get() * part.len() as f64
    };
    if parts.iter().any(missed) {
        let message = "no one surface comes within the tolerance of most points of each: they stay apart; a larger \
                       tolerance allows more";
        return Ok(refused(message.to_owned(), Some(off)));
    }
    let place = about[0];
    all.iter().for_each(|&i| found.labels[i as usize] = place as i32);
    found.reaches[place] = about.iter().map(|&l| found.reaches[l]).fold(reach, f64::max);
    found.told[place] = Some(compared.held);
    found.shapes[place] = refitted(found, &all, &shape, &compared.held);
    found.counters.merges += about.len() - 1;
    extend(found, place, sigma, false, parameters, monitor)?;
    Ok(draft(number, place, &format!("{} regions are one", about.len()), &shape, compared, off))
}

/// The regions that a hint is about, ascending: those that it points at; of a box, or of an earlier result's labels, those
/// of which most lie there.
fn about(found: &Found, regions: &[(usize, usize)], hint: &Hint) -> Vec<usize> {
    let whole = |l: usize| of_region(found, l as i32).len() as f64;
    let meant = |r: &&(usize, usize)| !hint.at.is_empty() || r.1 as f64 >= HALF.get() * whole(r.0);
    let mut about: Vec<usize> = regions.iter().filter(meant).map(|r| r.0).collect();
    about.sort_unstable();
    about
}
