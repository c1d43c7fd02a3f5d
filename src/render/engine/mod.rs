//! The device's side of a rendering: buffers, the pipeline, submissions, and the film on its way to and from the device.
//!
//! It knows no technique: who looks at a scene, or takes samples in another way, says so in the push constants.

pub(crate) mod buffers;
pub(crate) mod control;
pub(crate) mod create;
pub(crate) mod pass;
pub(crate) mod transfer;

use std::mem::take;

use crate::gpu::{Access, Pipeline, Timeline};

use crate::render::engine::buffers::{Band, Buffers};
use crate::render::error::RenderError;
use crate::render::film::tiling::{rows_of_blocks, slots_of_row};
use crate::render::kernel::layout::Push;
use crate::render::plan::dispatch::{Span, tile_spans};
use crate::render::plan::launch::Launch;
use crate::render::plan::pace::Pace;
use crate::render::statistics::RenderStatistics;

/// Takes samples of the pixels of one image.
pub(crate) struct Engine {
    pub statistics: RenderStatistics,
    /// What dispatches have in common.
    pub push: Push,
    pub launch: Launch,
    pace: Pace,
    /// The name of the kernel.
    stage: &'static str,
    // Dropped before the buffers they refer to; the timeline first, which waits for the device.
    timeline: Timeline,
    pipeline: Pipeline,
    buffers: Buffers,
}

impl Engine {
    /// Columns and rows of the image.
    pub fn size(&self) -> [u32; 2] {
        [self.push.width, self.push.height]
    }

    /// Pixels of the image.
    pub fn pixel_count(&self) -> u64 {
        self.size().map(u64::from).iter().product()
    }

    /// The name of the kernel.
    pub fn stage(&self) -> &'static str {
        self.stage
    }

    /// Buffers that a kernel of one's own may see.
    pub fn buffers(&self) -> &Buffers {
        &self.buffers
    }

    /// All slots of the film, a span for each band.
    pub fn whole_film(&self) -> Vec<Span> {
        let span = |(band, b): (usize, &Band)| Span { band, first_slot: b.first, end_slot: b.first + b.slots };
        self.buffers.bands.iter().enumerate().map(span).collect()
    }

    /// The slots of tiles, which come in increasing order.
    pub fn spans_of(&self, tiles: impl Iterator<Item = usize>) -> Vec<Span> {
        let bands: Vec<_> = self.buffers.bands.iter().map(|band| band.first).collect();
        tile_spans(tiles, &bands)
    }

    /// Rows of pixels in a band of the film, but for the last one.
    pub fn band_rows(&self) -> u32 {
        rows_of_blocks(self.buffers.bands[0].slots, self.push.width)
    }

    /// Whether bands consist of whole rows of blocks.
    pub fn has_whole_rows(&self) -> bool {
        let row_slots = slots_of_row(self.push.width);
        self.buffers.bands.iter().all(|band| u64::from(band.slots).is_multiple_of(row_slots))
    }

    /// Works with other push constants.
    ///
    /// # Errors
    /// Those of `work`.
    pub fn with_push<T>(
        &mut self,
        change: impl FnOnce(&mut Push),
        work: impl FnOnce(&mut Self) -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        let push = self.push;
        change(&mut self.push);
        let result = work(self);
        self.push = push;
        result
    }

    /// The same with samples that are not the image's: only the time that they take counts. The film is left to the caller.
    ///
    /// # Errors
    /// Those of `work`.
    pub fn look<T>(
        &mut self,
        change: impl FnOnce(&mut Push),
        work: impl FnOnce(&mut Self) -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        let (pace, statistics) = (self.pace, self.statistics.clone());
        let result = self.with_push(change, work);
        self.pace = pace;
        let RenderStatistics { compile_seconds, stages, .. } = take(&mut self.statistics);
        self.statistics = RenderStatistics { compile_seconds, stages, ..statistics };
        result
    }

    /// Compiles the pipeline for good: some drivers do so only when it first runs.
    pub fn warm_up(&mut self) -> Result<(), RenderError> {
        let push = Push { end_slot: 0, work_items: 1, work_item_stride: 1, max_new_samples: 0, ..self.push };
        let (pipeline, set) = (&self.pipeline, &self.buffers.bands[0].set);
        let ticket = self.timeline.submit(|r| r.dispatch(pipeline, set, bytemuck::bytes_of(&push), [1, 1, 1]))?;
        self.timeline.wait(&ticket)?;
        Ok(())
    }

    /// No samples in the film, nothing counted.
    pub fn clear_film(&mut self) -> Result<(), RenderError> {
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
}
