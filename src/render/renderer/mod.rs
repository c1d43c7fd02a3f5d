//! A scene on the device, ready to be rendered.

pub(crate) mod create;
pub(crate) mod decision;
pub(crate) mod distribution;
pub(crate) mod gradient;
pub(crate) mod light_tracing;
pub(crate) mod pass;
pub(crate) mod pilot;
pub(crate) mod pilot_statistics;
pub(crate) mod scheduler;
pub(crate) mod surfaces;
pub(crate) mod transfer;

mod buffers;
mod dual;
mod emitter_edges;
mod launch;
mod resume;
mod reuse_policy;
mod sample_map;
mod split;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;
use std::time::Instant;

use bytemuck::Zeroable;

use crate::accel::{BvhStatistics, MAX_RECORDS};
use crate::gpu::{Context, GpuError, Pipeline, Timeline};
use crate::scene::Scene;

use crate::render::error::RenderError;
use crate::render::film::checkpoint::Checkpoint;
use crate::render::film::{Film, slot_count, slots_of_row};
use crate::render::kernel::features::Features;
use crate::render::kernel::layout::Push;
use crate::render::light_tracing::splats::Splats;
use crate::render::plan::dispatch::Pace;
use crate::render::plan::exclusions::Combination;
use crate::render::renderer::buffers::Buffers;
use crate::render::renderer::create::Parts;
use crate::render::renderer::decision::ReuseDecision;
use crate::render::renderer::gradient::{ClassWeights, Groups};
use crate::render::renderer::launch::Launch;
use crate::render::renderer::light_tracing::LightTracer;
use crate::render::renderer::pass::RenderControl;
use crate::render::renderer::resume::{Before, Checkpointer};
use crate::render::renderer::split::Split;
use crate::render::renderer::surfaces::Places;
use crate::render::sampling::sample_map::SampleMap;
use crate::render::sampling::sobol;
use crate::render::scene::Prepared;
use crate::render::settings::{Gradients, RenderSettings, Reuse};
use crate::render::space::view::View;
use crate::render::statistics::{Progress, RenderStatistics};

/// Submissions in flight, but for one that is repeated meanwhile.
const IN_FLIGHT: usize = 2;

/// Renders one scene with one set of settings.
pub struct Renderer {
    settings: RenderSettings,
    features: Features,
    tree: Option<BvhStatistics>,
    hidden_lights: usize,
    push: Push,
    width: u32,
    height: u32,
    launch: Launch,
    pace: Pace,
    reuse: ReuseDecision,
    /// What is asked for, where the kernel can, and for how many samples at least.
    reuses: Reuse,
    fewest_reused: u32,
    /// Whether neighbours can be compared where paths are reused.
    gradients: bool,
    /// The part of variance that this may leave.
    most_left: f64,
    /// Where groups of pixels that share paths are.
    groups: Groups,
    /// How many samples each pixel gets of those that are asked for.
    sample_map: SampleMap,
    /// What pixels show, for gradients.
    places: Places,
    /// How certain differences between pixels are, by their class.
    weights: ClassWeights,
    /// Samples per pixel before the part of the rendering that is being done, with groups in one place.
    phase_begin: u32,
    /// What had been done when the rendering was stopped, if it goes on.
    before: Before,
    /// What light paths have lit, with the samples that are on the device.
    light: Splats,
    /// By how much variance must fall in the pilot pass.
    reuse_is_worth: f64,
    stage: &'static str,
    // Dropped before the buffers they refer to; the timeline first, which waits for the device.
    timeline: Timeline,
    pipeline: Pipeline,
    light_paths: Option<Arc<LightTracer>>,
    buffers: Buffers,
    statistics: RenderStatistics,
}

impl Renderer {
    /// Prepares everything: builds the tree, uploads tables, specialises and compiles the shaders.
    ///
    /// # Errors
    /// The scene is not [valid](Scene::validate); the settings make no sense; the device's limits or memory are exceeded; a Vulkan
    /// call fails.
    pub fn new(context: &Context, scene: &Scene, settings: &RenderSettings) -> Result<Self, RenderError> {
        scene.validate().map_err(|error| RenderError::Scene(Box::new(error)))?;
        Self::with(context, Prepared::of(scene, settings)?)
    }

    /// The same for a scene that has been prepared, and is not looked at again.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with(context: &Context, prepared: Prepared<'_>) -> Result<Self, RenderError> {
        let start = Instant::now();
        check_size(&prepared)?;
        let launch = Launch::of(&context.0, &prepared)?;
        let Parts { timeline, pipeline, light_paths, buffers, stage, pipeline_seconds } =
            Parts::of(&context.0, &launch, &prepared)?;
        check_host_memory(&prepared.scene.film)?;
        let Prepared { scene, settings, features, tables, seconds: prepared_seconds } = prepared;
        let Launch { traits, needed, reuse, .. } = &launch;
        let (width, height) = (scene.film.width, scene.film.height);
        let gradients = *reuse && settings.gradients == Gradients::Auto && buffers.has_whole_rows(slots_of_row(width));
        let combination = Combination {
            schedule: launch.schedule,
            brute_force: features.brute_force,
            split: launch.split != Split::NONE,
            reuse: *reuse,
            gradients,
            light_samples: launch.light_samples,
            light_tracing: light_paths.is_some(),
            glass: launch.glass,
        };
        combination.check()?;
        let light_path_scale = if light_paths.is_some() { light_tracing::scale(&View::of(scene)) } else { 0.0 };
        let push = Push { light_path_scale, ..push_constants(scene, settings) };
        let mut renderer = Self {
            settings: settings.clone(),
            features,
            hidden_lights: tables.hidden_lights(),
            most_left: decision::most_left(tables.samples_lights()),
            tree: tables.tree,
            push,
            width,
            height,
            pace: launch.pace(settings),
            gradients,
            groups: Groups::default(),
            sample_map: SampleMap::default(),
            places: Places::default(),
            weights: ClassWeights::default(),
            phase_begin: 0,
            before: Before::default(),
            light: Splats::default(),
            reuse: ReuseDecision::Never,
            reuses: if *reuse { settings.reuse } else { Reuse::Off },
            fewest_reused: reuse_policy::fewest_samples(needed, settings.reuse, traits),
            reuse_is_worth: reuse_policy::worth(needed, traits),
            launch,
            stage,
            timeline,
            pipeline,
            light_paths: light_paths.map(Arc::new),
            buffers,
            statistics: RenderStatistics::default(),
        };
        let warm_up_start = Instant::now();
        renderer.warm_up()?;
        renderer.warm_up_light_tracing()?;
        renderer.statistics.compile_seconds = pipeline_seconds + warm_up_start.elapsed().as_secs_f64();
        renderer.statistics.setup_seconds = prepared_seconds + start.elapsed().as_secs_f64();
        Ok(renderer)
    }

    /// What the pipeline is specialised for.
    pub fn features(&self) -> &Features {
        &self.features
    }

    /// What it renders with.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// Figures of the tree, if there is one.
    pub fn tree(&self) -> Option<&BvhStatistics> {
        self.tree.as_ref()
    }

    /// Point lights that were left out because no path can see them.
    pub fn hidden_lights(&self) -> usize {
        self.hidden_lights
    }

    /// Renders with other random numbers from now on.
    pub fn set_seed(&mut self, seed: u32) {
        self.settings.seed = seed;
        self.push.seed = seed;
    }

    /// Renders another number of samples per pixel from now on.
    ///
    /// # Errors
    /// It is 0, more than the pipeline's sampler table was made for, or too small for an estimate of the noise to stop at.
    pub fn set_samples(&mut self, samples: u32) -> Result<(), RenderError> {
        if samples == 0 || samples > sobol::MAX_SAMPLES || sobol::levels(samples) > self.features.sobol_levels {
            return Err(RenderError::Settings(format!(
                "{samples} samples per pixel, expected at least 1 and not many more than the {} that the renderer \
                 was made for",
                self.settings.samples
            )));
        }
        if let Some(adaptive) = &self.settings.adaptive {
            adaptive.check(samples)?;
        }
        self.settings.samples = samples;
        Ok(())
    }

    /// What the last rendering did.
    pub fn statistics(&self) -> &RenderStatistics {
        &self.statistics
    }

    /// Renders until all samples are done, the noise is reached, the time limit is over, or `on_progress` breaks; then
    /// reads the film.
    ///
    /// `on_progress` is called after every dispatch of samples of the image. What is looked at before (where emitters are, whether paths
    /// should be reused: some hundredths of a long rendering) is not interrupted.
    ///
    /// # Errors
    /// The device fails, or the driver cuts loops short.
    pub fn render(&mut self, mut on_progress: impl FnMut(&Progress) -> ControlFlow<()>) -> Result<Film, RenderError> {
        self.render_from(None, None, &mut on_progress)
    }

    /// From the beginning, or from where another rendering was stopped.
    fn render_from<'a>(
        &mut self,
        checkpoint: Option<&Checkpoint>,
        keeping: Option<Checkpointer<'a>>,
        on_progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Film, RenderError> {
        let RenderStatistics { setup_seconds, compile_seconds, .. } = self.statistics;
        self.statistics = RenderStatistics { setup_seconds, compile_seconds, ..RenderStatistics::default() };
        // Light paths come last.
        let before_light_tracing =
            |limit: Duration| if self.light_paths.is_some() { limit - limit / 10 } else { limit };
        let limit = self.settings.time_limit.map(before_light_tracing);
        let mut watch = RenderControl::new(limit, on_progress);
        watch.keeping = keeping;
        self.clear_film()?;
        let long = self.settings.samples >= self.fewest_reused;
        self.reuse = if long { ReuseDecision::of(self.reuses) } else { ReuseDecision::Never };
        self.sample_map = SampleMap::default();
        self.places = Places::default();
        self.before = Before { seconds: checkpoint.map_or(0.0, Checkpoint::seconds), ..Before::default() };
        self.light = self.no_light_paths();
        self.plan_samples()?;
        let done = checkpoint.map_or(Ok(0), |checkpoint| self.restore(checkpoint))?;
        watch.redone = checkpoint.map_or(0, Checkpoint::samples);
        let film = match self.settings.adaptive {
            None => self.render_uniform(done, &mut watch)?,
            Some(adaptive) => self.render_dual(&adaptive, &mut watch)?,
        };
        self.statistics.count_pixels(&film);
        self.statistics.reuse_gain = self.reuse.gain();
        self.statistics.render_seconds = self.before.seconds + watch.elapsed().as_secs_f64();
        Ok(film)
    }

    /// Before a rendering, the film being empty: decides whether paths are reused, and how many samples each pixel gets. It depends on no
    /// random number of the image.
    fn plan_samples(&mut self) -> Result<(), RenderError> {
        let wanted = self.look_for_edges()?.unwrap_or_default();
        self.run_pilot(&wanted)?;
        // Adaptive sampling tile by tile goes by the number of samples that are asked for.
        if self.settings.adaptive.is_none() || self.makes_gradients() {
            self.map_at_least(&wanted);
        }
        self.empty_film()
    }

    /// The samples that are asked for, but for so many per pixel that are done.
    fn render_uniform(&mut self, begin: u32, watch: &mut RenderControl<'_>) -> Result<Film, RenderError> {
        watch.total = self.samples_of_image(self.settings.samples);
        let mut done = begin;
        for samples in self.samples_between_light_tracing().skip_while(|&samples| samples < begin) {
            self.pass(&self.whole_film(), done, samples, watch)?;
            if watch.stop {
                break;
            }
            self.keep_up_with_light_paths(self.even_samples(), watch)?;
            done = samples;
        }
        self.statistics.stopped = self.statistics.samples < watch.total;
        let mut film = self.develop()?;
        self.statistics.stopped |= !self.add_light_paths(&mut film, self.even_samples(), watch)?;
        self.statistics.light_paths = self.light.light_paths;
        Ok(film)
    }
}

/// Bytes of the host's memory that a pixel takes when all samples are done: sums and a count in the film, the image, and what
/// it is made into to be written.
const HOST_BYTES: usize = 28 + 12 + 12;

/// Whether the host could have memory for the image, which is told before hours of rendering and not after.
fn check_host_memory(film: &crate::scene::Film) -> Result<(), RenderError> {
    let bytes = HOST_BYTES * film.width as usize * film.height as usize;
    Vec::<u8>::new().try_reserve_exact(bytes).map_err(|error| {
        let what = format!("the image ({bytes} bytes)");
        RenderError::Gpu(GpuError::OutOfMemory { what, reason: error.to_string() })
    })
}

/// Whether numbers of slots and of records fit into the shaders' integers.
fn check_size(prepared: &Prepared<'_>) -> Result<(), RenderError> {
    let Prepared { scene, tables, .. } = prepared;
    let (width, height) = (scene.film.width, scene.film.height);
    let most = u64::from(u32::MAX) / 2;
    if slot_count(width, height) > most {
        return Err(RenderError::Settings(format!(
            "an image of {width}×{height} pixels is too large: there may be {most} pixels in all, counted in whole tiles of 8×8"
        )));
    }
    if tables.bvh_records() > MAX_RECORDS {
        let (records, triangles) = (tables.bvh_records(), scene.triangle_count());
        return Err(RenderError::Settings(format!(
            "a tree of {records} records for {triangles} triangles is too large: there may be {MAX_RECORDS}"
        )));
    }
    Ok(())
}

pub(crate) fn push_constants(scene: &Scene, settings: &RenderSettings) -> Push {
    Push { width: scene.film.width, height: scene.film.height, seed: settings.seed, ..Push::zeroed() }
}
