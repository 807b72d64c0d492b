use crate::segment::outcome::{HintOutcome, Outcome};

/// What became of a hint, while its regions have no ids yet.
#[derive(Clone, Debug)]
pub struct Draft {
    /// What is known by now.
    pub outcome: HintOutcome,
    /// The surfaces that it made or is about: places among those found.
    pub shapes: Vec<usize>,
}

impl Draft {
    /// The outcome of hint number `hint`, about these surfaces.
    pub fn new(hint: usize, outcome: Outcome, shapes: Vec<usize>, message: String) -> Self {
        let outcome = HintOutcome {
            hint,
            outcome,
            regions: Vec::new(),
            scatter: None,
            misfit: None,
            message,
        };
        Self { outcome, shapes }
    }

    /// The outcome with the ids of the regions that are reported; `sources` holds each one's surface.
    pub fn told(self, sources: &[usize]) -> HintOutcome {
        let mut outcome = self.outcome;
        let shapes = &self.shapes;
        outcome.regions = (0..sources.len()).filter(|&id| shapes.contains(&sources[id])).collect();
        if outcome.regions.is_empty() && outcome.outcome == Outcome::Applied {
            outcome.outcome = Outcome::Contradicted;
            outcome.message += "; no region of it is reported, for its points are fewer than min_points or do not meet the parameters";
        }
        outcome
    }
}
