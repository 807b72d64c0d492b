//! One run: on threads of its own pool, while the caller's thread minds signals and tells of the progress.

use std::{
    num::NonZeroUsize,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    time::{Duration, Instant},
};

use conicoid::{
    answer::{self, AnswerError, Request, StageClock, Timing, sha256_of_points},
    formats::{self, Hints, Limits, Watched},
    segment::{Monitor, Stage},
};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::{
    answer::Answer,
    cloud::{Cloud, Source},
    error::{of_panic, of_system, raised},
};

/// How often signals are looked at, and how often progress is told at most: what people see as at once.
const LOOK: Duration = Duration::from_millis(50);

/// The handle on a run: stops it, ends it at its deadline, tells how far it is, and times its stages.
pub struct Watch {
    cancelled: AtomicBool,
    deadline: Option<Instant>,
    clock: Mutex<StageClock>,
    progress: Mutex<Option<(Stage, f64)>>,
}

impl Watch {
    /// A run that may take no longer than `limit`.
    pub fn new(limit: Option<Duration>) -> Arc<Self> {
        Arc::new(Self {
            cancelled: AtomicBool::new(false),
            deadline: limit.map(|limit| Instant::now() + limit),
            clock: Mutex::default(),
            progress: Mutex::default(),
        })
    }

    /// Why the run must stop, if it must.
    pub fn stop(&self) -> Option<AnswerError> {
        if self.cancelled.load(Ordering::Relaxed) {
            Some(AnswerError::cancelled())
        } else if self.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            Some(AnswerError::deadline_exceeded())
        } else {
            None
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Monitor for Watch {
    fn progress(&self, stage: Stage, fraction: f64) {
        locked(&self.clock).enter(stage);
        let mut last = locked(&self.progress);
        // a stage that is entered again, on more points, takes nothing back
        *last = Some((stage, last.map_or(fraction, |(_, before)| before.max(fraction))));
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
            || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// The pool of this process, kept for the next run with as many threads.
fn pool(threads: Option<NonZeroUsize>) -> PyResult<Arc<ThreadPool>> {
    struct Kept {
        process: u32,
        threads: Option<NonZeroUsize>,
        pool: Arc<ThreadPool>,
    }
    static KEPT: Mutex<Option<Kept>> = Mutex::new(None);
    let process = std::process::id();
    let mut kept = locked(&KEPT);
    match &*kept {
        Some(kept) if kept.process == process && kept.threads == threads => {
            return Ok(Arc::clone(&kept.pool));
        }
        _ => {}
    }
    let builder = ThreadPoolBuilder::new().num_threads(threads.map_or(0, NonZeroUsize::get));
    let builder = builder.thread_name(|k| format!("conicoid-{k}"));
    let pool = Arc::new(builder.build().map_err(|error| of_system(&error))?);
    let before = kept.replace(Kept { process, threads, pool: Arc::clone(&pool) });
    // a forked process has none of the threads that the pool of its parent would wait for
    if let Some(before) = before.filter(|before| before.process != process) {
        std::mem::forget(before);
    }
    Ok(pool)
}

/// Runs `work` on the pool while this thread, without the GIL, waits for it: now and then it looks at signals and calls
/// `told` with the stage and the fraction done. What either raises stops the work and is raised here.
///
/// # Errors
/// The work fails, or a signal or `told` raises.
pub fn attended<T: Send + 'static>(
    py: Python<'_>,
    watch: &Arc<Watch>,
    told: Option<&Bound<'_, PyAny>>,
    threads: Option<NonZeroUsize>,
    work: impl FnOnce() -> Result<T, AnswerError> + Send + 'static,
) -> PyResult<T> {
    let (send, mut receive) = channel();
    pool(threads)?.spawn(move || {
        let done = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err(of_panic()));
        // nobody waits any more where the interpreter ends
        let _ = send.send(done);
    });
    let mut last = None;
    loop {
        let waited = py.detach(move || (receive.recv_timeout(LOOK), receive));
        receive = waited.1;
        match waited.0 {
            Ok(done) => {
                let done = done.map_err(|error| raised(py, &error))?;
                tell(watch, told, &mut last, true)?;
                return Ok(done);
            }
            Err(RecvTimeoutError::Disconnected) => return Err(raised(py, &of_panic())),
            Err(RecvTimeoutError::Timeout) => {
                let minded = py.check_signals().and_then(|()| tell(watch, told, &mut last, false));
                if let Err(error) = minded {
                    watch.cancelled.store(true, Ordering::Relaxed);
                    // it ends within milliseconds; until then it holds the cloud
                    let _ = py.detach(move || receive.recv());
                    return Err(error);
                }
            }
        }
    }
}

/// Tells of progress that is new.
fn tell(
    watch: &Watch,
    told: Option<&Bound<'_, PyAny>>,
    last: &mut Option<(Stage, f64)>,
    is_done: bool,
) -> PyResult<()> {
    let Some(told) = told else { return Ok(()) };
    let now = if is_done { Some((Stage::Report, 1.0)) } else { *locked(&watch.progress) };
    if let Some((stage, fraction)) = now.filter(|_| now != *last) {
        *last = now;
        told.call1((stage.name(), fraction))?;
    }
    Ok(())
}

/// Refuses what tells how a file is read where there is none.
///
/// # Errors
/// The points are an array, and `request` says such a thing.
pub fn check_hints(source: &Source, request: &Request) -> Result<(), AnswerError> {
    if matches!(source, Source::File(_)) || request.hints().whole() == Hints::default() {
        return Ok(());
    }
    let detail = "'format', 'columns', 'skip_lines' and what begins with 'mesh' tell how a file is read, and the points are an array";
    Err(AnswerError::new(answer::ErrorKind::InvalidParameter, detail))
}

/// Finds the surfaces in `cloud`; `given` are parameters and options as names and text.
///
/// # Errors
/// A parameter is not one, the cloud cannot be worked with, or the caller stopped the work.
#[pyfunction]
#[pyo3(signature = (cloud, given, progress=None, threads=None))]
pub fn segment(
    py: Python<'_>,
    cloud: &Bound<'_, Cloud>,
    given: Vec<(String, String)>,
    progress: Option<&Bound<'_, PyAny>>,
    threads: Option<NonZeroUsize>,
) -> PyResult<Answer> {
    let pairs = given.iter().map(|(name, value)| (name.as_str(), value.as_str()));
    let request = Request::from_pairs(pairs).map_err(|error| raised(py, &error))?;
    let cloud = cloud.get();
    check_hints(&cloud.source, &request).map_err(|error| raised(py, &error))?;
    let watch = Watch::new(request.deadline);
    let (stop, points, source) =
        (Arc::clone(&watch), Arc::clone(&cloud.points), cloud.source.clone());
    let has_labels = request.labels;
    let work = move || answered(points, &source, request, &stop);
    let answer = attended(py, &watch, progress, threads, work)?;
    Ok(Answer::new(answer, cloud.source.clone(), has_labels))
}

fn answered(
    points: Arc<conicoid::geometry::PointCloud>,
    source: &Source,
    mut request: Request,
    watch: &Watch,
) -> Result<answer::Answer, AnswerError> {
    if let Some(stop) = watch.stop() {
        return Err(stop);
    }
    let begin = Instant::now();
    let stopped = || watch.cancelled();
    let told = |error: AnswerError| watch.stop().unwrap_or(error);
    let run = || {
        let cloud = match request.thin {
            Some(length) => {
                let watched = Watched { limits: Limits::of(usize::MAX), stopped: &stopped };
                let thinned = formats::thinned(&points, length, &watched);
                Arc::new(thinned.map_err(|error| told(error.into()))?)
            }
            None => Arc::clone(&points),
        };
        let found = conicoid::segment::segment(&cloud, &request.parameters, watch);
        let found = found.map_err(|error| told(answer::error_of_thinned(error, &cloud)))?;
        Ok::<_, AnswerError>((cloud, found))
    };
    // the digest takes as long as a good part of the run, and one thread
    let (done, sha256) = rayon::join(run, || match source {
        Source::Array => sha256_of_points(&points, stopped),
        Source::File(file) => file.sha256.clone(),
    });
    let (cloud, found) = done?;
    let (format, parse) = match source {
        Source::Array => ("array", 0.0),
        Source::File(file) => {
            request.name = request.name.or_else(|| file.name.clone());
            (file.format, file.parse)
        }
    };
    let stages = locked(&watch.clock).finish();
    let timing = Timing { parse, stages, total: parse + begin.elapsed().as_secs_f64() };
    let whole = cloud.thinned.is_some().then_some(points);
    let answer = answer::Answer::new(cloud, found, &request, (sha256, format), timing);
    Ok(answer::Answer { whole, ..answer })
}
