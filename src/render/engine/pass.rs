//! Passes over the film: dispatches until its pixels have as many samples as they are to have.

use std::collections::VecDeque;
use std::mem::offset_of;
use std::time::Instant;

use crate::gpu::{Access, BindingSet, Buffer, Pipeline, Recorder, Ticket, Timeline};
use crate::render::engine::Engine;
use crate::render::engine::buffers::{IN_FLIGHT, mapped};
use crate::render::engine::control::RenderControl;
use crate::render::error::RenderError;
use crate::render::film::tiling::{TILE, rows_of_blocks};
use crate::render::kernel::layout::{Counters, Push};
use crate::render::plan::dispatch::{Plan, Span, Work};

/// Brings pixels from one number of samples to another.
pub(crate) struct Pass<'a> {
    /// Of the film.
    pub spans: &'a [Span],
    /// Samples of each pixel that are asked for: those done, and those wanted. What pixels get of them their slots say
    /// (shaders/lib/sample_map.glsl).
    pub from: u32,
    pub to: u32,
    /// Samples of the rendering, over all pixels, when the pass is over.
    pub end: u64,
    /// How many times as many samples as are asked for a pixel gets at most.
    pub most_factor: u32,
}

/// Hands out what is done.
pub(crate) type Save<'a> = dyn FnMut(&mut Engine, &mut RenderControl<'_>) -> Result<(), RenderError> + 'a;

impl Engine {
    /// Does a pass, or less if the control says stop. Returns whether it came to its end. `save` is called where a checkpoint is due, when
    /// no submission is in flight.
    pub fn pass(
        &mut self,
        pass: &Pass<'_>,
        control: &mut RenderControl<'_>,
        save: &mut Save<'_>,
    ) -> Result<bool, RenderError> {
        let mut plan = Plan::new(pass.spans.to_vec(), pass.from, pass.to, &self.pace);
        let mut in_flight: VecDeque<(Ticket, Instant, usize, bool)> = VecDeque::new();
        let mut done_before_repeat = None;
        loop {
            // What fits into a dispatch is not known before the first has ended.
            let most = if self.pace.is_known() { IN_FLIGHT } else { 1 };
            let keeps = control.checkpoint_is_due(self.statistics.samples);
            while !control.stop && !keeps && in_flight.len() < most {
                let Some(work) = plan.next(&self.pace) else { break };
                let alone = in_flight.is_empty();
                let (ticket, readback) = self.submit(&work, pass.most_factor)?;
                in_flight.push_back((ticket, Instant::now(), readback, alone));
            }
            let Some((ticket, submitted, readback, alone)) = in_flight.pop_front() else {
                if keeps && !control.stop {
                    save(self, control)?;
                    continue;
                }
                return Ok(self.statistics.samples >= pass.end);
            };
            let before = self.statistics.samples;
            self.finish(&ticket, readback)?;
            let seconds = control.finished_since(submitted);
            let done = self.statistics.samples;
            // Some drivers (lavapipe 22) tell only that all submissions are done: then the last took no time.
            if !plan.is_repeating() && (alone || !in_flight.is_empty()) {
                self.pace.measured(done - before, seconds);
            }
            if in_flight.is_empty() && plan.is_over() && done < pass.end && !control.stop {
                // Samples that ran out of loop budget are done again, as long as that gets any further.
                let in_vain = done_before_repeat.replace(done) == Some(done);
                if in_vain && plan.is_finest() {
                    return Err(RenderError::Stuck { budget: self.launch.loop_budget });
                }
                plan.repeat(&self.pace, in_vain);
            }
            let uneven = pass.from == 0 && plan.in_first_round();
            control.report(done, seconds, uneven || done <= control.redone);
        }
    }

    /// Does some work until there are `end` samples of all pixels together: again, sample by sample, if the budget of loops does not suffice.
    /// Returns whether it did not.
    pub fn work_until(&mut self, mut work: Work, end: u64) -> Result<bool, RenderError> {
        let mut repeated = false;
        while self.statistics.samples < end {
            let so_far = self.statistics.samples;
            let (ticket, readback) = self.submit(&work, 1)?;
            self.finish(&ticket, readback)?;
            if self.statistics.samples == so_far && work.new_samples == 1 {
                return Err(RenderError::Stuck { budget: self.launch.loop_budget });
            }
            work.new_samples = 1;
            repeated |= self.statistics.samples < end;
        }
        Ok(repeated)
    }

    /// Waits for a submission and adds what it counted.
    pub fn finish(&mut self, ticket: &Ticket, readback: usize) -> Result<(), RenderError> {
        let stages = self.timeline.wait(ticket)?;
        let bytes = mapped(&self.buffers.readbacks[readback])?;
        let counters: Counters = *bytemuck::from_bytes(&bytes[..size_of::<Counters>()]);
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

    /// Submits work, of which pixels may take up to `most_factor` times as many samples. Returns what to wait for, and the number of the
    /// buffer that its counters will be read from.
    fn submit(&mut self, work: &Work, most_factor: u32) -> Result<(Ticket, usize), RenderError> {
        let number = (self.statistics.dispatches % IN_FLIGHT as u64) as usize;
        self.statistics.dispatches += 1;
        let (bands, slots_per_work_item, stage) = (&self.buffers.bands, self.launch.slots_per_work_item, self.stage);
        let (pipeline, counters) = (&self.pipeline, &self.buffers.counters);
        let (distribution, width) = (self.launch.distribution, self.push.width);
        let common = Push {
            target_samples: work.target_samples,
            // As many as for the largest multiplier, if that is possible at once; if not, the pass is repeated. Where loops have a
            // budget it is: work that exceeds it is done for nothing.
            max_new_samples: if self.launch.loop_budget > 0 {
                work.new_samples
            } else {
                let most = work.new_samples.saturating_mul(most_factor);
                most.min(self.pace.most_samples()).max(work.new_samples)
            },
            tile_step: work.tile_step,
            ..self.push
        };
        let record = |r: &mut Recorder<'_>| {
            r.timed(stage, |r| {
                for (i, span) in work.spans.iter().enumerate() {
                    if i > 0 {
                        // Spans share counters and queue regions.
                        r.barrier(Access::Compute, Access::Compute);
                        if distribution.is_drawn() {
                            r.barrier(Access::Compute, Access::Transfer);
                            r.clear_word(counters, offset_of!(Counters, drawn) as u64);
                            r.barrier(Access::Transfer, Access::Compute);
                        }
                    }
                    let band = &bands[span.band];
                    let tiles = (span.slots() / TILE as u32).div_ceil(work.tile_step);
                    let first_tile = span.first_slot / TILE as u32;
                    let tile_bits = distribution.tile_bits(first_tile, tiles, work.tile_step, common.max_new_samples);
                    let work_items = (tiles * TILE as u32).div_ceil(slots_per_work_item << tile_bits);
                    let push = Push {
                        first_slot: span.first_slot,
                        end_slot: span.end_slot,
                        band_first: band.first,
                        band_rows: rows_of_blocks(band.slots, width),
                        work_items,
                        work_item_stride: stride(work_items),
                        tile_bits,
                        ..common
                    };
                    let workgroups = distribution.workgroups(work_items);
                    r.dispatch(pipeline, &band.set, bytemuck::bytes_of(&push), [workgroups, 1, 1]);
                }
            });
        };
        let readback = &self.buffers.readbacks[number];
        Ok((submit_counted(&mut self.timeline, counters, readback, record)?, number))
    }

    /// Submits so many workgroups of another kernel, whose counters will be read from the buffer of that number.
    pub fn submit_kernel(
        &mut self,
        (pipeline, set): (&Pipeline, &BindingSet),
        stage: &'static str,
        push: &Push,
        workgroups: u32,
        number: usize,
    ) -> Result<Ticket, RenderError> {
        let record = |r: &mut Recorder<'_>| {
            r.timed(stage, |r| r.dispatch(pipeline, set, bytemuck::bytes_of(push), [workgroups, 1, 1]));
            // The host reads what it has written.
            r.barrier(Access::Compute, Access::Host);
        };
        submit_counted(&mut self.timeline, &self.buffers.counters, &self.buffers.readbacks[number], record)
    }

    /// Compiles another kernel for good.
    pub fn warm_up_kernel(&mut self, (pipeline, set): (&Pipeline, &BindingSet)) -> Result<(), RenderError> {
        let push = Push { end_slot: 0, ..self.push };
        let ticket = self.timeline.submit(|r| r.dispatch(pipeline, set, bytemuck::bytes_of(&push), [1, 1, 1]))?;
        self.timeline.wait(&ticket)?;
        Ok(())
    }
}

/// Submits dispatches, and a copy of what they count.
fn submit_counted(
    timeline: &mut Timeline,
    counters: &Buffer,
    readback: &Buffer,
    record: impl FnOnce(&mut Recorder<'_>),
) -> Result<Ticket, RenderError> {
    let ticket = timeline.submit(|r| {
        record(r);
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
    Ok(ticket)
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
