//! Run time against error: renders, measures, interleaved.

use std::borrow::Cow;
use std::ops::ControlFlow;

use crate::Context;
use crate::image::metrics;
use crate::image::metrics::CompareOptions;
use crate::image::{Image, ImageError};
use crate::render::{Film, RenderError, RenderSettings, RenderStatistics, Renderer};
use crate::scene::Scene;

use crate::bench::configuration::Configuration;
use crate::bench::error::BenchError;
use crate::bench::reference::Reference;
use crate::bench::watched;

/// Samples per pixel of the rendering that counts steps through the BVH; it is not timed.
const COUNTED_SAMPLES: u32 = 16;
/// Where no noise is wanted of a reference, its variance is this share of the smallest mean squared error.
const REFERENCE_SHARE: f64 = 0.25;

/// Samples of a rendering that is not timed.
const UNTIMED_SAMPLES: u32 = 4;

/// What is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    /// Samples per pixel, increasing.
    pub samples: Vec<u32>,
    /// Independent renderings of each.
    pub seeds: u32,
    /// Pixels per degree, for FLIP.
    pub flip_ppd: f64,
}

/// One timed rendering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Which configuration.
    pub configuration: usize,
    /// Samples per pixel.
    pub samples: u32,
    /// Seed.
    pub seed: u32,
    /// Wall seconds from the first dispatch to the film on the host.
    pub render_seconds: f64,
    /// Device seconds by timestamps; 0 where the device has none.
    pub device_seconds: f64,
    /// Closest-hit and shadow rays.
    pub rays: u64,
    /// Mean squared error, the reference's own variance included.
    pub mse: f64,
    /// Relative mean squared error, the reference's own variance included.
    pub rel_mse: f64,
    /// Mean absolute percentage error.
    pub mape: f64,
    /// Mean FLIP.
    pub flip: f64,
    /// Mean luminance over that of the reference, minus 1 (absolute difference where the reference is black).
    pub bias: f64,
}

/// A configuration, compiled, with what is known of it before it is timed.
pub struct Contender<'a> {
    /// Its description.
    pub configuration: &'a Configuration,
    /// Device and driver.
    pub device: [String; 2],
    /// Seconds to prepare: BVH, uploads, pipeline.
    pub setup: RenderStatistics,
    /// BVH figures.
    pub bvh: Option<crate::accel::BvhStatistics>,
    /// Steps through the BVH per ray, shadow rays included; `None` without a BVH.
    pub steps_per_ray: Option<f64>,
    renderer: Renderer,
}

impl<'a> Contender<'a> {
    /// Opens, counts, compiles.
    ///
    /// # Errors
    /// The device or the renderer cannot be made.
    pub fn new(
        configuration: &'a Configuration,
        default_context: &Context,
        scene: &Scene,
        most_samples: u32,
    ) -> Result<Self, BenchError> {
        let fail = |source| BenchError::Render { what: format!("{} ({})", scene.source, configuration.label), source };
        let context = match &configuration.device {
            None => default_context.clone(),
            Some(device) => default_context
                .open_beside(device)
                .map_err(|source| BenchError::Device { device: device.clone(), source })?,
        };
        let scene = match configuration.roulette {
            None => Cow::Borrowed(scene),
            Some(first) => {
                let mut scene = scene.clone();
                scene.integrator.russian_roulette = first;
                Cow::Owned(scene)
            }
        };
        let settings = RenderSettings { samples: most_samples, ..configuration.settings.clone() };
        let mut renderer = Renderer::new(&context, &scene, &settings).map_err(fail)?;
        let bvh = renderer.bvh().copied();
        let steps_per_ray = match bvh {
            None => None,
            Some(_) => {
                let samples = settings.samples.min(COUNTED_SAMPLES);
                let counted = RenderSettings { samples, adaptive: None, ..settings.clone() };
                watched::steps_per_ray(&context, &scene, &counted, || ControlFlow::Continue(())).map_err(fail)?
            }
        };
        // One rendering that is not timed: first-use costs of the driver.
        render(&mut renderer, most_samples.min(UNTIMED_SAMPLES), 0, || ControlFlow::Continue(())).map_err(fail)?;
        Ok(Self {
            configuration,
            device: [context.info().name.clone(), context.info().driver.clone()],
            setup: renderer.statistics().clone(),
            bvh,
            steps_per_ray,
            renderer,
        })
    }

    /// [`BenchError::Interrupted`] if `on_progress` breaks.
    fn image(
        &mut self,
        samples: u32,
        seed: u32,
        mut on_progress: impl FnMut() -> ControlFlow<()>,
    ) -> Result<Image, BenchError> {
        let what = || format!("configuration {}", self.configuration.label);
        if on_progress().is_break() {
            return Err(BenchError::Interrupted);
        }
        let film = render(&mut self.renderer, samples, seed, on_progress)
            .map_err(|source| BenchError::Render { what: what(), source })?
            .ok_or(BenchError::Interrupted)?;
        Image::from_pixels(film.width(), film.height(), film.mean())
            .map_err(|source| BenchError::Image { what: what(), source })
    }
}

fn render(
    renderer: &mut Renderer,
    samples: u32,
    seed: u32,
    on_progress: impl FnMut() -> ControlFlow<()>,
) -> Result<Option<Film>, RenderError> {
    renderer.set_samples(samples)?;
    renderer.set_seed(seed);
    watched::render(renderer, on_progress)
}

/// The noise that a reference should not exceed: half the smallest error that will be met, found from two renderings
/// of each configuration. `on_progress` is asked between and during renderings whether to go on.
///
/// # Errors
/// A rendering fails, or [`BenchError::Interrupted`] if `on_progress` breaks.
pub fn wanted_noise(
    contenders: &mut [Contender<'_>],
    most_samples: u32,
    mut on_progress: impl FnMut() -> ControlFlow<()>,
) -> Result<f64, BenchError> {
    let mut smallest = f64::INFINITY;
    for contender in contenders {
        let a = contender.image(most_samples, 1, &mut on_progress)?;
        let b = contender.image(most_samples, 2, &mut on_progress)?;
        // Var(a − b) is twice the variance of each.
        let mse = metrics::compare(&a, &b, &CompareOptions::default()).map_err(image_error)?.pointwise.mse / 2.0;
        smallest = smallest.min(mse);
    }
    Ok((REFERENCE_SHARE * smallest).sqrt().max(f64::MIN_POSITIVE))
}

/// Times every configuration at every number of samples with every seed: configurations alternate innermost and seeds
/// outermost, so that a drift of the machine's speed meets all configurations and all numbers of samples alike.
///
/// `on_progress` is told, between and during renderings, how many are done, and of how many. If it breaks, the seeds that are
/// complete are returned.
///
/// # Errors
/// A rendering fails, the reference has another size, or [`BenchError::Interrupted`] if `on_progress` breaks before a seed is
/// complete.
pub fn measure(
    contenders: &mut [Contender<'_>],
    schedule: &Schedule,
    reference: &Reference,
    mut on_progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Vec<Measurement>, BenchError> {
    if contenders.is_empty() || schedule.samples.is_empty() || schedule.seeds == 0 {
        return Err(BenchError::Settings("nothing to measure: expected configurations, samples and seeds".to_owned()));
    }
    let of_a_seed = contenders.len() * schedule.samples.len();
    let total = of_a_seed * schedule.seeds as usize;
    let options = CompareOptions { flip_ppd: schedule.flip_ppd, ..CompareOptions::default() };
    let mut done = Vec::with_capacity(total);
    for seed in 1..=schedule.seeds {
        for &samples in &schedule.samples {
            for (configuration, contender) in contenders.iter_mut().enumerate() {
                let image = match contender.image(samples, seed, || on_progress(done.len(), total)) {
                    Err(BenchError::Interrupted) if done.len() >= of_a_seed => {
                        done.truncate(done.len() / of_a_seed * of_a_seed);
                        return Ok(done);
                    }
                    image => image?,
                };
                let found = metrics::compare(&image, &reference.image, &options).map_err(image_error)?;
                let s = contender.renderer.statistics();
                let luminance = found.bias.luminance;
                done.push(Measurement {
                    configuration,
                    samples,
                    seed,
                    render_seconds: s.render_seconds,
                    device_seconds: s.stages.iter().map(|t| t.seconds).sum(),
                    rays: s.rays + s.shadow_rays,
                    mse: found.pointwise.mse,
                    rel_mse: found.pointwise.rel_mse,
                    mape: found.pointwise.mape,
                    flip: found.flip,
                    bias: luminance.relative.unwrap_or(luminance.mean),
                });
            }
        }
    }
    Ok(done)
}

fn image_error(source: ImageError) -> BenchError {
    BenchError::Image { what: "comparison with the reference".to_owned(), source }
}
