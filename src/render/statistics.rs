//! What a rendering reports, while it runs and when it is over.

use std::time::Duration;

use rayon::prelude::*;

use crate::gpu::StageTime;

use crate::render::kernel::layout::Counters;

/// How far a rendering is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Samples done, over all pixels.
    pub done: u64,
    /// Samples to do, over all pixels; to a noise, as many as are expected.
    pub total: u64,
    /// Time since the first dispatch.
    pub elapsed: Duration,
}

/// The noise that was reached, which is defined at [`Adaptive`](crate::render::Adaptive).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveStatistics {
    /// Estimated noise of the image.
    pub noise: f64,
    /// Estimated noise of the tile of 64 pixels that has the most.
    pub noisiest_tile: f64,
    /// Times that the noise of a half was looked at, at most.
    pub rounds: u32,
    /// Samples, over all pixels, that served decisions only and are not in the film.
    pub unused_samples: u64,
}

/// What a rendering did.
#[derive(Debug, Clone, Default)]
pub struct RenderStatistics {
    /// Seconds that [`Renderer::new`](crate::render::Renderer::new) took until it could render: BVH, uploads, compilation. With
    /// [`Renderer::with`](crate::render::Renderer::with) those of [`Prepared::of`](crate::render::Prepared::of) are among them.
    pub setup_seconds: f64,
    /// The part of `setup_seconds` that went into making and warming up the pipeline: little if the context has had one of the kind
    /// lately.
    pub compile_seconds: f64,
    /// Seconds from the first dispatch to the film on the host.
    pub render_seconds: f64,
    /// Samples, over all pixels.
    pub samples: u64,
    /// Fewest samples of any pixel.
    pub samples_per_pixel: u32,
    /// Mean of the samples in the pixels' means.
    pub mean_samples_per_pixel: f64,
    /// Most samples of any pixel.
    pub most_samples_per_pixel: u32,
    /// The noise that was reached, if it came as far as an estimate.
    pub adaptive: Option<AdaptiveStatistics>,
    /// Samples, over all pixels, made with paths that serve several pixels (see [`Reuse`](crate::render::Reuse)).
    pub reused_samples: u64,
    /// By how much reuse lowered the variance in the pilot pass that decided about it; `None`: there was none.
    pub reuse_gain: Option<f64>,
    /// The image was made from differences between neighbouring pixels (see [`Gradients`](crate::render::Gradients)). The first
    /// hits for that are in no other number but the times.
    pub gradients: bool,
    /// Pixels that get more samples than are asked for (see [`SampleMap`](crate::render::SampleMap)). How they were found is in no other number but
    /// the times.
    pub multiplied_pixels: u64,
    /// Light paths of light traced from emitters (see [`LightTracing`](crate::render::LightTracing)).
    pub light_paths: u64,
    /// Closest-hit rays.
    pub rays: u64,
    /// Shadow rays.
    pub shadow_rays: u64,
    /// Steps through the BVH (with [`RenderSettings::count_steps`](crate::render::RenderSettings::count_steps)).
    pub bvh_steps: u64,
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
    /// Fewest, mean and most samples of pixels that have so many.
    pub(super) fn count_pixels(&mut self, counts: &[u32]) {
        self.samples_per_pixel = counts.par_iter().copied().min().unwrap_or(0);
        self.most_samples_per_pixel = counts.par_iter().copied().max().unwrap_or(0);
        self.mean_samples_per_pixel =
            counts.par_iter().map(|&n| u64::from(n)).sum::<u64>() as f64 / counts.len() as f64;
    }

    /// Adds what one dispatch counted, and how long its stages took.
    pub(super) fn add(&mut self, counters: &Counters, stages: &[StageTime]) {
        self.samples += counters.samples;
        self.reused_samples += counters.reused;
        self.rays += counters.rays;
        self.shadow_rays += counters.shadow_rays;
        self.bvh_steps += counters.steps;
        self.bad_samples += counters.bad;
        for stage in stages {
            match self.stages.iter_mut().find(|s| s.stage == stage.stage) {
                Some(sum) => sum.seconds += stage.seconds,
                None => self.stages.push(*stage),
            }
        }
    }
}
