//! When a rendering has to end, who wants to know how far it is, and who keeps what is done.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::render::film::checkpoint::Checkpoint;
use crate::render::statistics::Progress;

/// Who is told about progress.
type OnProgress<'a> = &'a mut dyn FnMut(&Progress) -> ControlFlow<()>;

/// When a rendering has to end, and who wants to know how far it is.
pub(crate) struct RenderControl<'a> {
    start: Instant,
    last_finished: Instant,
    limit: Option<Duration>,
    on_progress: OnProgress<'a>,
    checkpointer: Option<Checkpointer<'a>>,
    /// Samples to do, over all pixels: for the reports of progress only.
    pub total: u64,
    /// Samples that were done when the rendering was stopped before: no limit of time is over before there are more, so that it gets
    /// further each time.
    pub redone: u64,
    /// No further dispatch may begin.
    pub stop: bool,
    /// Because who watches said so.
    interrupted: bool,
}

/// Who keeps what is done of a rendering from time to time.
pub(crate) struct Checkpointer<'a> {
    every: Duration,
    last: Instant,
    /// Samples, over all pixels, that have been kept.
    kept: u64,
    keep: &'a mut dyn FnMut(Checkpoint),
}

impl<'a> Checkpointer<'a> {
    /// Hands checkpoints to `keep` about `every` so often, if there are more than the `kept` samples.
    pub fn new(every: Duration, kept: u64, keep: &'a mut dyn FnMut(Checkpoint)) -> Self {
        Self { every, last: Instant::now(), kept, keep }
    }
}

impl<'a> RenderControl<'a> {
    /// Begins now.
    pub fn new(limit: Option<Duration>, checkpointer: Option<Checkpointer<'a>>, on_progress: OnProgress<'a>) -> Self {
        let start = Instant::now();
        Self {
            start,
            last_finished: start,
            limit,
            on_progress,
            checkpointer,
            total: 0,
            redone: 0,
            stop: false,
            interrupted: false,
        }
    }

    /// Time since the beginning.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Another limit from now on: what had to stop for the former may go on.
    pub fn set_limit(&mut self, limit: Option<Duration>) {
        (self.limit, self.stop) = (limit, self.interrupted);
    }

    /// Whether it is time for a checkpoint, if there are so many samples.
    pub fn checkpoint_is_due(&self, samples: u64) -> bool {
        self.checkpointer.as_ref().is_some_and(|c| samples > c.kept && c.last.elapsed() >= c.every)
    }

    /// Hands out a checkpoint.
    pub fn keep(&mut self, checkpoint: Checkpoint) {
        if let Some(checkpointer) = &mut self.checkpointer {
            checkpointer.kept = checkpoint.samples();
            (checkpointer.keep)(checkpoint);
            checkpointer.last = Instant::now();
        }
    }

    /// A submission has finished just now: the seconds that it took, with what the host did about it. The device works on one at a
    /// time, so that it began when its predecessor ended.
    pub fn finished_since(&mut self, submitted: Instant) -> f64 {
        let now = Instant::now();
        let seconds = now.duration_since(submitted.max(self.last_finished)).as_secs_f64();
        self.last_finished = now;
        seconds
    }

    /// So many samples are done, and the last dispatch took so many seconds. Stops if that is wanted, or if another would not end in
    /// time, unless `uneven`: some pixels have no sample yet.
    pub fn report(&mut self, done: u64, seconds: f64, uneven: bool) {
        let progress = Progress { done, total: self.total.max(done), elapsed: self.elapsed() };
        self.interrupted |= (self.on_progress)(&progress).is_break();
        self.stop |= self.interrupted;
        let late = self.limit.is_some_and(|limit| self.elapsed() + Duration::from_secs_f64(seconds) > limit);
        self.stop |= late && !uneven;
    }
}
