//! A scene on the device, ready to be rendered: what is decided about it, and the order of things.

mod develop;
mod dual;
mod plan;
mod resume;
mod techniques;

use std::mem::take;
use std::ops::ControlFlow;
use std::time::Duration;
use std::time::Instant;

use crate::accel::{BvhStatistics, MAX_RECORDS};
use crate::gpu::{Context, GpuError, loop_limit};
use crate::scene::Scene;

use crate::render::engine::Engine;
use crate::render::engine::control::{Checkpointer, RenderControl};
use crate::render::engine::create::Beside;
use crate::render::engine::pass::Pass;
use crate::render::error::RenderError;
use crate::render::film::Film;
use crate::render::film::checkpoint::Checkpoint;
use crate::render::film::tiling::{BLOCK, SIDE, slot_count};
use crate::render::gradient::develop::{GradientPlan, GradientSums};
use crate::render::gradient::phases::Phases;
use crate::render::gradient::surfaces::find_first_hits;
use crate::render::gradient::weights::class_weights;
use crate::render::kernel::driver_traits::DriverTraits;
use crate::render::kernel::features::Features;
use crate::render::kernel::layout::{mode, queue};
use crate::render::kernel::sobol;
use crate::render::light_tracing::splats::Splats;
use crate::render::light_tracing::tracer;
use crate::render::light_tracing::tracer::LightTracer;
use crate::render::plan::launch::Launch;
use crate::render::plan::prepared::Prepared;
use crate::render::renderer::develop::develop;
use crate::render::renderer::plan::Plan;
use crate::render::renderer::techniques::{Decisions, Techniques};
use crate::render::reuse::decision::ReuseDecision;
use crate::render::reuse::pilot::{PilotOptions, run_pilot};
use crate::render::sampling::emitter_edges::{EdgeSearch, look_for_edges};
use crate::render::sampling::sample_map::Grid;
use crate::render::sampling::sample_map_decision::{allocate_samples, empty_film, fits_sample_map};
use crate::render::settings::RenderSettings;
use crate::render::settings::mutation::Mutation;
use crate::render::space::view::View;
use crate::render::statistics::{Progress, RenderStatistics};

/// Renders one scene with one set of settings.
pub struct Renderer {
    settings: RenderSettings,
    features: Features,
    bvh: Option<BvhStatistics>,
    hidden_lights: usize,
    techniques: Techniques,
    /// What the last rendering decided.
    decisions: Decisions,
    position: Position,
    /// What light paths have lit, with the samples that are on the device.
    splats: Splats,
    // Dropped before the tracer, since it waits for the device.
    engine: Engine,
    light_tracer: Option<LightTracer>,
}

/// Where a rendering is, and what of it was done when it was stopped.
#[derive(Debug, Clone, Copy, Default)]
struct Position {
    /// What it is decided by.
    plan: Plan,
    /// Samples per pixel before the part of the rendering that is being done, with groups of pixels in one place.
    phase_begin: u32,
    /// Samples, over all pixels, that had been done of that part when the rendering was stopped.
    samples_of_phase: u64,
    /// Seconds of rendering before it was stopped.
    seconds: f64,
}

impl Renderer {
    /// Prepares everything: builds the BVH, uploads tables, specialises and compiles the shaders.
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
        let device = &context.0;
        let settings = prepared.settings;
        let traits = DriverTraits::of(&device.info, loop_limit(device)?).with(settings);
        let (mut techniques, options) = Techniques::new(&prepared, &traits);
        let launch = Launch::new(device, traits, &prepared, options)?;
        let ray_query = prepared.features.ray_query;
        let light_layout = (options.casters > 0).then(|| LightTracer::layout(device, ray_query)).transpose()?;
        let light_specialization = tracer::specialization(&launch, &prepared);
        let light_pipeline = light_layout
            .as_ref()
            .map(|layout| || LightTracer::pipeline(device, layout, &light_specialization, settings));
        let beside = light_pipeline.as_ref().map(|make| make as &Beside<'_, _>);
        let (mut engine, light_pipeline, pipeline_seconds) = Engine::new(device, launch, &prepared, beside)?;
        let light_tracer = light_layout.as_ref().zip(light_pipeline);
        let light_tracer =
            light_tracer.map(|(layout, pipeline)| LightTracer::new(device, &engine, layout, pipeline, settings));
        let light_tracer = light_tracer.transpose()?;
        if light_tracer.is_some() {
            engine.push.light_path_scale = tracer::scale(&View::of(prepared.scene, 1.0));
        }
        techniques.gradients &= engine.has_whole_rows();
        check_host_memory(&prepared.scene.film)?;
        let warm_up_start = Instant::now();
        engine.warm_up()?;
        if let Some(tracer) = &light_tracer {
            tracer.warm_up(&mut engine)?;
        }
        engine.statistics.compile_seconds = pipeline_seconds + warm_up_start.elapsed().as_secs_f64();
        engine.statistics.setup_seconds = prepared.seconds + start.elapsed().as_secs_f64();
        Ok(Self {
            settings: settings.clone(),
            hidden_lights: prepared.tables.hidden_lights(),
            features: prepared.features,
            bvh: prepared.tables.bvh,
            techniques,
            decisions: Decisions::default(),
            position: Position::default(),
            splats: Splats::default(),
            engine,
            light_tracer,
        })
    }

    /// What the pipeline is specialised for.
    pub fn features(&self) -> &Features {
        &self.features
    }

    /// What it renders with.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// Figures of the BVH, if there is one.
    pub fn bvh(&self) -> Option<&BvhStatistics> {
        self.bvh.as_ref()
    }

    /// Point lights that were left out because no path can see them.
    pub fn hidden_lights(&self) -> usize {
        self.hidden_lights
    }

    /// Renders with other random numbers from now on.
    pub fn set_seed(&mut self, seed: u32) {
        self.settings.seed = seed;
        self.engine.push.seed = seed;
    }

    /// Stops by another limit of time from now on; whether there is one was decided when it was made.
    pub fn set_time_limit(&mut self, limit: Option<Duration>) {
        self.settings.time_limit = self.settings.time_limit.and(limit);
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
        &self.engine.statistics
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
        checkpointer: Option<Checkpointer<'a>>,
        on_progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Film, RenderError> {
        let RenderStatistics { setup_seconds, compile_seconds, .. } = self.engine.statistics;
        self.engine.statistics = RenderStatistics { setup_seconds, compile_seconds, ..RenderStatistics::default() };
        // Light paths come last.
        let before_light_tracing =
            |limit: Duration| if self.light_tracer.is_some() { limit - limit / 10 } else { limit };
        let limit = self.settings.time_limit.map(before_light_tracing);
        let mut control = RenderControl::new(limit, checkpointer, on_progress);
        let plan = Plan::of(&self.settings, checkpoint)?;
        self.position = Position { plan, seconds: checkpoint.map_or(0.0, Checkpoint::seconds), ..Position::default() };
        self.splats = self.no_splats();
        self.engine.push.modes = 0;
        self.decisions = self.decide(plan)?;
        self.engine.push.modes = self.decisions.modes();
        self.engine.statistics.multiplied_pixels = self.decisions.sample_map.multiplied_pixels();
        empty_film(&mut self.engine, &self.decisions.sample_map)?;
        let done = checkpoint.map_or(Ok(0), |checkpoint| self.restore(checkpoint))?;
        control.redone = checkpoint.map_or(0, Checkpoint::samples);
        let film = match self.settings.adaptive {
            None => self.render_uniform(done, &mut control)?,
            Some(adaptive) => self.render_dual(&adaptive, &mut control)?,
        };
        let statistics = &mut self.engine.statistics;
        statistics.count_pixels(film.counts());
        statistics.reuse_gain = self.decisions.reuse_gain;
        statistics.render_seconds = self.position.seconds + control.elapsed().as_secs_f64();
        Ok(film)
    }

    /// Before a rendering: whether paths are reused, whether the image is made from gradients, and how many samples
    /// each pixel gets. It depends on no random number of the image. The film is left to the caller.
    fn decide(&mut self, Plan { samples, limited }: Plan) -> Result<Decisions, RenderError> {
        let Self { settings, techniques, engine, .. } = self;
        let may_map = techniques.sample_map
            && fits_sample_map(settings, engine.launch.kernel.sobol_levels)
            && (!engine.launch.kernel.reuse || engine.has_whole_rows());
        let may_allocate = may_map && settings.adaptive.is_none() && samples >= queue::PILOT_SAMPLES;
        let [width, height] = engine.size();
        let grid = Grid { width, height, band_rows: engine.band_rows() };

        let search = EdgeSearch {
            emitter_bounds: &techniques.emitter_bounds,
            glass: techniques.glass,
            samples,
            own_seed: settings.mutation == Some(Mutation::OwnSampleMap),
        };
        let wanted = if may_map { look_for_edges(engine, &search)?.unwrap_or_default() } else { Vec::new() };

        let mut reuse = techniques.reuse.before(samples);
        let mut decisions = Decisions::default();
        let gradients = techniques.makes_gradients(reuse, samples, settings);
        let due = reuse == ReuseDecision::Pending || (reuse == ReuseDecision::Always && gradients);
        if due && samples >= queue::PILOT_SAMPLES {
            let tells_tiles = may_allocate && !limited;
            let pilot = run_pilot(engine, PilotOptions::new(samples, tells_tiles, gradients), &wanted)?;
            if reuse == ReuseDecision::Pending {
                reuse = pilot.reuse;
            }
            let reuses = reuse.pays(techniques.reuse.worth);
            log::debug!("reuse of paths: {reuse:?}, {reuses}");
            if techniques.makes_gradients(reuse, samples, settings) {
                let first_hits = find_first_hits(engine)?;
                let weights = class_weights(&pilot.pairs, &first_hits);
                log::debug!("weights of differences: {weights:?}");
                let phases = match settings.adaptive {
                    None => Phases::new(samples, limited),
                    Some(_) => Phases::OfDoublings,
                };
                let band_rows = grid.band_rows as usize;
                decisions.gradients = Some(GradientPlan { phases, first_hits, weights, band_rows });
            }
            if may_allocate {
                let made = [reuses, decisions.gradients.is_some()];
                decisions.sample_map = allocate_samples(&pilot, made, grid, samples);
            }
        }
        decisions.reuse = reuse.pays(techniques.reuse.worth);
        decisions.reuse_gain = reuse.gain();
        // To a noise, pixels get different numbers of samples only where the image is made from gradients.
        if settings.adaptive.is_none() || decisions.gradients.is_some() {
            let grid = if decisions.reuse { grid } else { Grid { band_rows: BLOCK[1], ..grid } };
            decisions.sample_map = take(&mut decisions.sample_map).with_at_least(&wanted, decisions.reuse, grid);
        }
        Ok(decisions)
    }

    /// The samples that are asked for, but for so many per pixel that are done.
    fn render_uniform(&mut self, begin: u32, control: &mut RenderControl<'_>) -> Result<Film, RenderError> {
        let samples = self.settings.samples;
        control.total = self.decisions.samples_of_image(samples, self.engine.pixel_count());
        let traced_after: Vec<_> = match &self.light_tracer {
            Some(_) => LightTracer::samples_between(samples).collect(),
            None => vec![samples],
        };
        let mut done = begin;
        for samples in traced_after.into_iter().skip_while(|&samples| samples < begin) {
            self.pass(done, samples, control)?;
            if control.stop {
                break;
            }
            self.trace_light(self.even_samples(), control)?;
            done = samples;
        }
        let is_complete = self.engine.statistics.samples >= control.total;
        let has_all_light = self.trace_last_light(self.even_samples(), control)?;
        self.engine.statistics.stopped = !is_complete || !has_all_light;
        self.engine.statistics.light_paths = self.splats.light_paths;
        self.develop()
    }

    /// Brings all pixels from so many samples that are asked for to so many, or less far if the control says stop, with groups of
    /// pixels as the samples want them. Returns whether it came so far.
    fn pass(&mut self, from: u32, to: u32, control: &mut RenderControl<'_>) -> Result<bool, RenderError> {
        let Self { engine, decisions, position, splats, .. } = self;
        let decisions = &*decisions;
        let spans = engine.whole_film();
        let pixels = engine.pixel_count();
        for phase in decisions.phases().between(from, to) {
            if control.stop {
                return Ok(false);
            }
            position.phase_begin = phase.from;
            let kind = usize::from(phase.shifted);
            let samples = |count: u32| decisions.sample_map.samples(kind, count - phase.other_samples, pixels);
            let begin = engine.statistics.samples - take(&mut position.samples_of_phase);
            let end = begin + samples(phase.to) - samples(phase.from);
            let most_factor = decisions.sample_map.most_factor();
            let pass = Pass { spans: &spans, from: phase.from, to: phase.to, end, most_factor };
            let position = *position;
            let mut save = |engine: &mut Engine, control: &mut RenderControl<'_>| {
                let seconds = position.seconds + control.elapsed().as_secs_f64();
                control.keep(resume::checkpoint(engine, decisions, splats, position, seconds)?);
                Ok(())
            };
            let shifted = if phase.shifted { mode::SHIFTED } else { 0 };
            let is_complete = engine.with_push(
                |push| {
                    push.modes |= shifted;
                    push.other_samples = phase.other_samples;
                },
                |engine| engine.pass(&pass, control, &mut save),
            )?;
            if !is_complete {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The samples that are done, as many as they would be if each pixel got as many as are asked for.
    fn even_samples(&self) -> u64 {
        let done = self.engine.statistics.samples;
        if self.decisions.sample_map.is_even() {
            return done;
        }
        let (samples, pixels) = (self.settings.samples, self.engine.pixel_count());
        let even = u128::from(pixels) * u128::from(samples);
        (u128::from(done) * even / u128::from(self.decisions.samples_of_image(samples, pixels).max(1))) as u64
    }

    /// The light of no light path yet.
    fn no_splats(&self) -> Splats {
        Splats::new(if self.light_tracer.is_some() { self.engine.pixel_count() as usize } else { 0 })
    }

    /// Traces as many light paths as go with so many samples, over all pixels, or fewer if the control says stop. Returns whether all are
    /// traced.
    fn trace_light(&mut self, samples: u64, control: &mut RenderControl<'_>) -> Result<bool, RenderError> {
        match &self.light_tracer {
            Some(tracer) => tracer.keep_up(&mut self.engine, &mut self.splats, samples, control),
            None => Ok(true),
        }
    }

    /// The same when paths are over, for which there is a limit of its own.
    fn trace_last_light(&mut self, samples: u64, control: &mut RenderControl<'_>) -> Result<bool, RenderError> {
        if self.light_tracer.is_some() {
            control.set_limit(self.settings.time_limit);
        }
        self.trace_light(samples, control)
    }

    /// The image of what is on the device, and of the light paths.
    fn develop(&mut self) -> Result<Film, RenderError> {
        let film = self.engine.read_film()?;
        self.develop_film(film)
    }

    /// The same of a film that has been read.
    fn develop_film(&mut self, film: Film) -> Result<Film, RenderError> {
        let gradients = match &self.decisions.gradients {
            Some(plan) => {
                let mut sums = GradientSums::new(self.engine.size());
                let spans = self.engine.whole_film();
                self.engine.read_gradients(&spans, |first, slots| sums.read_slots(first, slots))?;
                Some((plan, sums))
            }
            None => None,
        };
        let developed = develop(film, gradients, &self.decisions.sample_map, &self.splats);
        self.engine.statistics.gradients = developed.from_gradients;
        Ok(developed.film)
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
            "an image of {width}×{height} pixels is too large: there may be {most} pixels in all, counted in whole tiles of {SIDE}×{SIDE}"
        )));
    }
    if tables.bvh_records() > MAX_RECORDS {
        let (records, triangles) = (tables.bvh_records(), scene.triangle_count());
        return Err(RenderError::Settings(format!(
            "a BVH of {records} records for {triangles} triangles is too large: there may be {MAX_RECORDS}"
        )));
    }
    Ok(())
}
