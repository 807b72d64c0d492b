//! A run that is told to stop does so in whatever stage it is.

use std::sync::{
    Mutex,
    atomic::{AtomicUsize, Ordering},
};

use conicoid::{
    geometry::{PointCloud, Vec3},
    segment::{Method, Monitor, Parameters, SegmentError, Stage, segment},
};

use super::support::truth::Random;

/// Says that the run is cancelled from some stage or some look on, and counts.
struct Watch {
    from: Option<Stage>,
    look: usize,
    looks: AtomicUsize,
    stages: Mutex<Vec<(Stage, usize)>>,
}

impl Watch {
    fn new(from: Option<Stage>, look: usize) -> Self {
        Self { from, look, looks: AtomicUsize::new(0), stages: Mutex::default() }
    }

    /// The stages that have begun, each with the looks before it.
    fn stages(&self) -> Vec<(Stage, usize)> {
        self.stages.lock().unwrap().clone()
    }
}

impl Monitor for Watch {
    fn progress(&self, stage: Stage, _: f64) {
        self.stages.lock().unwrap().push((stage, self.looks.load(Ordering::Relaxed)));
    }
    fn cancelled(&self) -> bool {
        let look = self.looks.fetch_add(1, Ordering::Relaxed);
        let begun = || self.stages.lock().unwrap().iter().any(|s| Some(s.0) == self.from);
        look >= self.look || self.from.is_some() && begun()
    }
}

/// Forty tubes, half of them in two pieces each.
fn tubes() -> PointCloud {
    let random = &mut Random::new(9);
    let at = |k: usize, random: &mut Random| {
        let tube = k % 40;
        let foot = Vec3::new(9.0 * (tube % 8) as f64, 9.0 * (tube / 8) as f64, 0.0);
        let gap = if tube.is_multiple_of(2) && k.is_multiple_of(3) { 30.0 } else { 0.0 };
        let (turn, height) = (random.uniform(0.0, 6.3), random.uniform(0.0, 20.0) + gap);
        let r = 2.0 + 0.1 * (tube % 5) as f64 + 0.01 * random.normal();
        foot + Vec3::new(r * turn.cos(), r * turn.sin(), height)
    };
    PointCloud::from_points((0..8000).map(|k| at(k, random)).collect())
}

/// Both methods, as they find the tubes.
fn methods() -> [Parameters; 2] {
    let rcond = [("method", "rcond"), ("rcond_threshold", "1"), ("algebraic_threshold", "0.01")];
    [&[][..], &rcond].map(|settings| {
        let mut parameters = Parameters { min_points: 20, ..Parameters::default() };
        settings.iter().for_each(|(name, value)| parameters.set(name, value).unwrap());
        parameters
    })
}

#[test]
fn no_stage_begins_after_the_one_in_which_a_run_is_cancelled() {
    let cloud = tubes();
    for parameters in methods() {
        for stage in Stage::ALL {
            let watch = Watch::new(Some(stage), usize::MAX);
            let result = segment(&cloud, &parameters, &watch);
            let stages = watch.stages();
            let Some(first) = stages.iter().position(|s| s.0 == stage) else { continue };
            assert!(matches!(result, Err(SegmentError::Cancelled(_))), "{stage:?}");
            assert_eq!(stages.len(), first + 1, "{stage:?}: {stages:?}");
        }
    }
}

#[test]
fn a_run_cancelled_at_any_look_ends_without_another_stage() {
    let cloud = tubes();
    for parameters in methods() {
        let whole = Watch::new(None, usize::MAX);
        assert!(segment(&cloud, &parameters, &whole).is_ok());
        let looks = whole.looks.into_inner();
        for k in 0..24 {
            let watch = Watch::new(None, k * looks / 25);
            let result = segment(&cloud, &parameters, &watch);
            assert!(matches!(result, Err(SegmentError::Cancelled(_))), "look {k} of 25");
            let after = watch.stages().iter().filter(|s| s.1 > watch.look + 1).count();
            assert_eq!(after, 0, "look {k} of 25: {:?}", watch.stages());
        }
    }
}

#[test]
fn every_stage_of_either_method_asks_whether_to_go_on_for_each_region_at_least() {
    let cloud = tubes();
    for parameters in methods() {
        let watch = Watch::new(None, usize::MAX);
        let found = segment(&cloud, &parameters, &watch).unwrap();
        let least = if parameters.method == Method::Distance { 20 } else { 1 };
        assert!(found.regions.len() >= least, "{} regions", found.regions.len());
        let mut stages = watch.stages();
        stages.push((Stage::Report, watch.looks.load(Ordering::Relaxed)));
        for stage in [Stage::Grow, Stage::Merge, Stage::Refine, Stage::Report] {
            let spans = stages.windows(2).filter(|w| w[0].0 == stage);
            let looks: usize = spans.map(|w| w[1].1 - w[0].1).sum();
            assert!(looks >= found.regions.len(), "{stage:?}: {looks} looks, {parameters:?}");
        }
    }
}
