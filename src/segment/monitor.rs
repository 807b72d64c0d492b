/// The steps a segmentation goes through, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Sorting the points and estimating their noise.
    Prepare,
    /// Growing hypotheses from seeds.
    Grow,
    /// Choosing among hypotheses and extracting their points.
    Extract,
    /// Joining pieces of one surface.
    Merge,
    /// Placing boundaries and fitting the final surfaces.
    Refine,
    /// Writing down the regions.
    Report,
}

impl Stage {
    /// Every stage in order.
    pub const ALL: [Self; 6] =
        [Self::Prepare, Self::Grow, Self::Extract, Self::Merge, Self::Refine, Self::Report];

    /// The name used in progress reports and timings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Prepare => "prepare",
            Self::Grow => "grow",
            Self::Extract => "extract",
            Self::Merge => "merge",
            Self::Refine => "refine",
            Self::Report => "report",
        }
    }
}

/// The work was cancelled; no result exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the segmentation was cancelled")]
pub struct Cancelled;

/// How the method tells its caller what it is doing, and asks whether to go on.
///
/// The method has no clock: a caller that wants timings notes the time of each call.
pub trait Monitor: Sync {
    /// `stage` has begun or gone on; `fraction` in 0..=1 is how much of the whole work is done.
    fn progress(&self, stage: Stage, fraction: f64);
    /// Whether to stop. Asked often (every few milliseconds of work), so it must be cheap.
    fn cancelled(&self) -> bool;
    /// `Err(Cancelled)` where `cancelled` says so, for use with `?`.
    fn check(&self) -> Result<(), Cancelled> {
        if self.cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

/// A monitor that listens to nothing and never cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Monitor for Silent {
    fn progress(&self, _: Stage, _: f64) {}
    fn cancelled(&self) -> bool {
        false
    }
}
