//! What a rendering reports, while it runs and when it is over.

use std::time::Duration;

use crate::gpu::StageTime;

use super::layout::Counters;

/// How far a rendering is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Samples done, over all pixels.
    pub done: u64,
    /// Samples to do, over all pixels.
    pub total: u64,
    /// Time since the first dispatch.
    pub elapsed: Duration,
}

/// What a rendering did.
#[derive(Debug, Clone, Default)]
pub struct RenderStatistics {
    /// Seconds from the start of [`Renderer::new`](super::Renderer::new) until it could render: tree, uploads, compilation.
    pub setup_seconds: f64,
    /// The part of `setup_seconds` that went into making and warming up the pipeline.
    pub compile_seconds: f64,
    /// Seconds from the first dispatch to the film on the host.
    pub render_seconds: f64,
    /// Samples, over all pixels.
    pub samples: u64,
    /// Fewest samples of any pixel.
    pub samples_per_pixel: u32,
    /// Closest-hit rays.
    pub rays: u64,
    /// Shadow rays.
    pub shadow_rays: u64,
    /// Steps through the tree (with [`RenderSettings::count_steps`](super::RenderSettings::count_steps)).
    pub tree_steps: u64,
    /// Samples that were NaN or infinite and count as black.
    pub bad_samples: u64,
    /// Dispatches.
    pub dispatches: u64,
    /// Device time of each stage, summed.
    pub stages: Vec<StageTime>,
    /// The rendering was stopped before all samples were done.
    pub stopped: bool,
}

impl RenderStatistics {
    /// Adds what one dispatch counted, and how long its stages took.
    pub(super) fn add(&mut self, counters: &Counters, stages: &[StageTime]) {
        self.samples += u64::from(counters.samples);
        self.rays += u64::from(counters.rays);
        self.shadow_rays += u64::from(counters.shadow_rays);
        self.tree_steps += u64::from(counters.steps);
        self.bad_samples += u64::from(counters.bad);
        for stage in stages {
            match self.stages.iter_mut().find(|s| s.stage == stage.stage) {
                Some(sum) => sum.seconds += stage.seconds,
                None => self.stages.push(*stage),
            }
        }
    }
}
