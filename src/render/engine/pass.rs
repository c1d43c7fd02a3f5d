//! What the device does for a rendering: passes over the film. (Reading and filling it: slots.rs.)

use std::collections::VecDeque;
use std::mem::{offset_of, take};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::gpu::{Access, Buffer, Ticket};
use crate::render::error::RenderError;
use crate::render::film::{TILE, pixels_in, rows_of_blocks};
use crate::render::kernel::layout::{Counters, Push, mode};
use crate::render::plan::dispatch::{Plan, Span, Work, tile_spans};
use crate::render::renderer::buffers::Band;
use crate::render::renderer::resume::Checkpointer;
use crate::render::renderer::{IN_FLIGHT, Renderer};
use crate::render::statistics::{Progress, RenderStatistics};

/// When a rendering has to end, and who wants to know how far it is.
pub(crate) struct RenderControl<'a> {
    start: Instant,
    last_finished: Instant,
    limit: Option<Duration>,
    on_progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
    /// Samples to do, over all pixels: for the reports of progress only.
    pub total: u64,
    /// Samples that were done when the rendering was stopped before: no limit of time is over before there are more, so that it gets
    /// further each time.
    pub redone: u64,
    /// Who keeps what is done.
    pub keeping: Option<Checkpointer<'a>>,
    /// No further dispatch may begin.
    pub stop: bool,
    /// Because who watches said so.
    interrupted: bool,
}

impl<'a> RenderControl<'a> {
    /// Begins now.
    pub fn new(limit: Option<Duration>, on_progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>) -> Self {
        let start = Instant::now();
        Self {
            start,
            last_finished: start,
            limit,
            on_progress,
            total: 0,
            redone: 0,
            keeping: None,
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

    /// A submission has finished just now: the seconds that it took, with what the host did about it. The device works on one at a
    /// time, so that it began when its predecessor ended.
    pub(crate) fn finished_since(&mut self, submitted: Instant) -> f64 {
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

impl Renderer {
    /// All slots of the film, a span for each band.
    pub(crate) fn whole_film(&self) -> Vec<Span> {
        let span = |(band, b): (usize, &Band)| Span { band, first_slot: b.first, end_slot: b.first + b.slots };
        self.buffers.bands.iter().enumerate().map(span).collect()
    }

    /// The slots of tiles, which come in increasing order.
    pub(crate) fn spans_of(&self, tiles: impl Iterator<Item = usize>) -> Vec<Span> {
        let bands: Vec<_> = self.buffers.bands.iter().map(|band| band.first).collect();
        tile_spans(tiles, &bands)
    }

    /// Pixels in `spans`.
    pub(crate) fn pixels(&self, spans: &[Span]) -> u64 {
        spans.iter().map(|s| pixels_in(s.first_slot, s.end_slot, self.width, self.height)).sum()
    }

    /// Samples, over all pixels, that bring those of `spans` from `done` samples to `samples` with the groups of pixels where they
    /// are. Where numbers of samples differ between pixels, `spans` are the whole film.
    fn samples_between(&self, spans: &[Span], done: u32, samples: u32) -> u64 {
        let (kind, other) = (usize::from(self.groups.shifted), self.groups.other_samples);
        let pixels = self.pixels(spans);
        let of = |count: u32| self.sample_map.samples(kind, count - other, pixels);
        of(samples) - of(done)
    }

    /// Brings the pixels of `spans` from `done` samples to `samples`, or less far if the watch says stop, with the groups of
    /// pixels where they are. Returns whether it came so far.
    pub(crate) fn steady_pass(
        &mut self,
        spans: &[Span],
        done: u32,
        samples: u32,
        watch: &mut RenderControl<'_>,
    ) -> Result<bool, RenderError> {
        let begin = self.statistics.samples - take(&mut self.before.samples_of_phase);
        let end = begin + self.samples_between(spans, done, samples);
        let mut plan = Plan::new(spans.to_vec(), done, samples, &self.pace);
        let mut in_flight: VecDeque<(Ticket, Instant, usize, bool)> = VecDeque::new();
        let mut done_before_repeat = None;
        loop {
            // What fits into a dispatch is not known before the first has ended.
            let most = if self.pace.is_known() { IN_FLIGHT } else { 1 };
            let keeps = watch.keeping.as_ref().is_some_and(|keeping| keeping.is_due(self.statistics.samples));
            while !watch.stop && !keeps && in_flight.len() < most {
                let Some(work) = plan.next(&self.pace) else { break };
                let alone = in_flight.is_empty();
                let (ticket, readback) = self.submit(&work)?;
                in_flight.push_back((ticket, Instant::now(), readback, alone));
            }
            let Some((ticket, submitted, readback, alone)) = in_flight.pop_front() else {
                if keeps && !watch.stop {
                    self.keep(watch)?;
                    continue;
                }
                return Ok(self.statistics.samples >= end);
            };
            let before = self.statistics.samples;
            self.finish(&ticket, readback)?;
            let seconds = watch.finished_since(submitted);
            let done = self.statistics.samples;
            // Some drivers (lavapipe 22) tell only that all submissions are done: then the last took no time.
            if !plan.is_repeating() && (alone || !in_flight.is_empty()) {
                self.pace.measured(done - before, seconds);
            }
            if in_flight.is_empty() && plan.is_over() && done < end && !watch.stop {
                // Samples that ran out of loop budget are done again, as long as that gets any further.
                let in_vain = done_before_repeat.replace(done) == Some(done);
                if in_vain && plan.is_finest() {
                    return Err(RenderError::Stuck { budget: self.launch.loop_budget });
                }
                plan.repeat(&self.pace, in_vain);
            }
            let uneven = done == 0 && plan.in_first_round();
            watch.report(done, seconds, uneven || done <= watch.redone);
        }
    }

    /// Waits for a submission and adds what it counted.
    pub(crate) fn finish(&mut self, ticket: &Ticket, readback: usize) -> Result<(), RenderError> {
        let stages = self.timeline.wait(ticket)?;
        let counters = self.read_counters(readback)?;
        if counters.truncated > 0 {
            return Err(RenderError::Truncated { count: counters.truncated });
        }
        if counters.subgroup_mismatches > 0 {
            let problem = format!("{} subgroups are not as large as was asked for", counters.subgroup_mismatches);
            return Err(RenderError::Driver(problem));
        }
        self.statistics.add(&counters, &stages);
        Ok(())
    }

    /// Looks at the scene before a rendering. Of these samples only the time counts; the film is left to the caller.
    pub(crate) fn beforehand<T>(
        &mut self,
        look: impl FnOnce(&mut Self) -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        let (pace, push, reuse, statistics) = (self.pace, self.push, self.reuse, self.statistics.clone());
        let found = look(self);
        (self.pace, self.push, self.reuse) = (pace, push, reuse);
        self.statistics = RenderStatistics { stages: take(&mut self.statistics.stages), ..statistics };
        found
    }

    /// Does some work until there are `end` samples of all pixels together: again, sample by sample, if the budget of loops does not suffice.
    /// Returns whether it did not.
    pub(crate) fn work_until(&mut self, mut work: Work, end: u64) -> Result<bool, RenderError> {
        let mut repeated = false;
        while self.statistics.samples < end {
            let so_far = self.statistics.samples;
            let (ticket, readback) = self.submit(&work)?;
            self.finish(&ticket, readback)?;
            if self.statistics.samples == so_far && work.new_samples == 1 {
                return Err(RenderError::Stuck { budget: self.launch.loop_budget });
            }
            work.new_samples = 1;
            repeated |= self.statistics.samples < end;
        }
        Ok(repeated)
    }

    /// Takes so many samples of each pixel of some spans. Not to be stopped: what is stopped should have samples of the image.
    pub(crate) fn take_samples(&mut self, spans: &[Span], samples: u32) -> Result<(), RenderError> {
        self.steady_pass(spans, 0, samples, &mut RenderControl::new(None, &mut |_| ControlFlow::Continue(())))?;
        Ok(())
    }

    /// Compiles the pipeline for good: some drivers do so only when it first runs.
    pub(crate) fn warm_up(&mut self) -> Result<(), RenderError> {
        let push = Push { end_slot: 0, work_items: 1, work_item_stride: 1, max_new_samples: 0, ..self.push };
        let (pipeline, set) = (&self.pipeline, &self.buffers.bands[0].set);
        let ticket = self.timeline.submit(|r| r.dispatch(pipeline, set, bytemuck::bytes_of(&push), [1, 1, 1]))?;
        self.timeline.wait(&ticket)?;
        Ok(())
    }

    /// Begins a rendering: no samples, nothing counted.
    pub(crate) fn clear_film(&mut self) -> Result<(), RenderError> {
        let (bands, counters, queue_pool) = (&self.buffers.bands, &self.buffers.counters, &self.buffers.queue_pool);
        let ticket = self.timeline.submit(|r| {
            for band in bands {
                r.clear(&band.film);
                r.clear(&band.gradients);
            }
            r.clear(queue_pool);
            r.clear(counters);
            r.barrier(Access::Transfer, Access::Compute);
            // Where the film is mapped, the host may write to it next.
            r.barrier(Access::Transfer, Access::Host);
        })?;
        self.timeline.wait(&ticket)?;
        Ok(())
    }

    /// Submits work. Returns what to wait for, and the number of the buffer that its counters will be read from.
    pub(crate) fn submit(&mut self, work: &Work) -> Result<(Ticket, usize), RenderError> {
        let number = (self.statistics.dispatches % IN_FLIGHT as u64) as usize;
        self.statistics.dispatches += 1;
        let (bands, slots_per_work_item, stage) = (&self.buffers.bands, self.launch.slots_per_work_item, self.stage);
        let (pipeline, counters, readback) = (&self.pipeline, &self.buffers.counters, &self.buffers.readbacks[number]);
        let shifted = if self.groups.shifted { mode::SHIFTED } else { 0 };
        let correlated = if self.makes_gradients() { mode::CORRELATED } else { 0 };
        let reused = if self.reuses_paths() { mode::REUSED } else { 0 };
        let common = Push {
            target_samples: work.target_samples,
            // As many as for the largest multiplier, if that is possible at once; if not, the pass is repeated. Where loops have a
            // budget it is: work that exceeds it is done for nothing.
            max_new_samples: if self.launch.loop_budget > 0 {
                work.new_samples
            } else {
                self.sample_map.most().of(work.new_samples).min(self.pace.most_samples()).max(work.new_samples)
            },
            tile_step: work.tile_step,
            modes: self.push.modes | shifted | correlated | reused,
            other_samples: self.groups.other_samples,
            ..self.push
        };
        let ticket = self.timeline.submit(|r| {
            r.timed(stage, |r| {
                for (i, span) in work.spans.iter().enumerate() {
                    if i > 0 {
                        // Spans share counters and queue regions.
                        r.barrier(Access::Compute, Access::Compute);
                        if self.launch.distribution.is_drawn() {
                            r.barrier(Access::Compute, Access::Transfer);
                            r.clear_word(counters, offset_of!(Counters, drawn) as u64);
                            r.barrier(Access::Transfer, Access::Compute);
                        }
                    }
                    let band = &bands[span.band];
                    let tiles = (span.slots() / TILE as u32).div_ceil(work.tile_step);
                    let first_tile = span.first_slot / TILE as u32;
                    let tile_bits =
                        self.launch.distribution.tile_bits(first_tile, tiles, work.tile_step, common.max_new_samples);
                    let work_items = (tiles * TILE as u32).div_ceil(slots_per_work_item << tile_bits);
                    let push = Push {
                        first_slot: span.first_slot,
                        end_slot: span.end_slot,
                        band_first: band.first,
                        band_rows: rows_of_blocks(band.slots, self.width),
                        work_items,
                        work_item_stride: stride(work_items),
                        tile_bits,
                        ..common
                    };
                    r.dispatch(
                        pipeline,
                        &band.set,
                        bytemuck::bytes_of(&push),
                        [self.launch.distribution.workgroups(work_items), 1, 1],
                    );
                }
            });
            // Counters: read what this dispatch counted, then start the next one from zero. The film needs the
            // same order: the next dispatch may go on with the same pixels.
            r.barrier(Access::Compute, Access::Transfer);
            r.copy(counters, 0, readback, 0, size_of::<Counters>() as u64);
            r.barrier(Access::Transfer, Access::Transfer);
            r.clear(counters);
            r.barrier(Access::Transfer, Access::Compute);
            r.barrier(Access::Compute, Access::Compute);
            r.barrier(Access::Transfer, Access::Host);
        })?;
        Ok((ticket, number))
    }

    fn read_counters(&self, readback: usize) -> Result<Counters, RenderError> {
        let bytes = mapped(&self.buffers.readbacks[readback])?;
        Ok(*bytemuck::from_bytes(&bytes[..size_of::<Counters>()]))
    }
}

/// The bytes of a buffer that the host reads.
pub(crate) fn mapped(buffer: &Buffer) -> Result<&[u8], RenderError> {
    buffer.mapped().ok_or_else(unmapped)
}

pub(crate) fn unmapped() -> RenderError {
    RenderError::Driver("it does not map memory that the host reads or writes".to_owned())
}

/// A number without a common divisor with `groups`, such that its multiples, modulo `groups`, are spread evenly: near
/// the golden section, unless products with numbers below `groups` would not fit into 32 bits.
fn stride(groups: u32) -> u32 {
    let coprime = |n: u32| {
        let (mut a, mut b) = (groups, n);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a == 1
    };
    let most = (u32::MAX / groups.max(1)).min((f64::from(groups) * 0.618_034) as u32);
    (1..=most).rev().find(|&n| coprime(n)).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::stride;

    #[test]
    fn multiples_of_the_stride_meet_every_group_once() {
        for groups in (1..200).chain([1024, 65_536, 524_288, 1_000_003]) {
            let stride = stride(groups);
            let mut met = vec![false; groups as usize];
            for i in 0..groups {
                let group = i.checked_mul(stride).expect("32 bits") % groups;
                assert!(!std::mem::replace(&mut met[group as usize], true), "{groups} groups, stride {stride}");
            }
        }
        // No thread's share is a part of the image: of two halves each has half of either.
        let (groups, stride) = (1024, stride(1024));
        let upper = (0..groups / 2).filter(|i| i * stride % groups < groups / 2).count();
        assert!((246..=266).contains(&upper), "{upper}");
    }
}
