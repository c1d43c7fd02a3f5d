//! A scene on the device, ready to be rendered.

mod adaptive;
mod beams;
mod beginnings;
mod buffers;
mod glances;
mod gradients;
mod handout;
mod passes;
mod repeats;
mod schedule;
mod shares;
mod slots;
mod split;
mod survey;
mod trial;
mod tried;
mod twins;

use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::time::Instant;

use bytemuck::Zeroable;

use crate::accel::{MAX_RECORDS, TreeStatistics};
use crate::gpu::{Context, DeviceKind, Pipeline, Timeline};
use crate::scene::Scene;

use super::bindings;
use super::driver::DriverFacts;
use super::error::RenderError;
use super::features::Features;
use super::film::{Film, slot_count, slots_of_row};
use super::kernels::{self, Schedule};
use super::layout::{FilmSlot, Push, binding, constant, glance, queue};
use super::plan::{Pace, Rounds};
use super::prepared::Prepared;
use super::settings::{Adaptive, Gradients, RenderSettings, Reuse};
use super::shares::Shares;
use super::sobol;
use super::statistics::{Progress, RenderStatistics};
use super::view::{Rectangle, View};
use beams::BeamTracer;
use beginnings::Beginnings;
use buffers::{Buffers, Shape};
use gradients::{Certainties, Groups};
use handout::Handout;
use passes::Watch;
use schedule::Job;
use split::Split;
use survey::Places;
use trial::ReuseTrial;

/// What an invocation of path_turns.comp keeps where its workgroup shares memory: a slot of the film.
const KEPT_BYTES: u32 = size_of::<FilmSlot>() as u32;
/// Submissions in flight.
const IN_FLIGHT: usize = 2;

/// Renders one scene with one set of settings.
pub struct Renderer {
    settings: RenderSettings,
    features: Features,
    tree: Option<TreeStatistics>,
    hidden_lights: usize,
    push: Push,
    width: u32,
    height: u32,
    loop_budget: u32,
    /// Slots of the film that a piece of work is, and who gets it.
    slots_per_piece: u32,
    handout: Handout,
    pace: Pace,
    /// The pixels that may show the edges of lamps, where samples are to have glances.
    lamp_places: Vec<Rectangle>,
    reuse: ReuseTrial,
    /// What is asked for, where the kernel can, and for how many samples at least.
    reuses: Reuse,
    fewest_reused: u32,
    /// Whether neighbours can be compared where paths are reused.
    gradients: bool,
    /// Whether the members of a group sample lights alike for that.
    lights_alike: bool,
    /// Where groups of pixels that share paths are.
    groups: Groups,
    /// How many samples each pixel gets of those that are asked for.
    shares: Shares,
    /// What pixels show, for gradients.
    places: Places,
    /// How certain differences between pixels are, by their class.
    certainties: Certainties,
    /// Whether samples may be several paths.
    repeats: bool,
    /// The states in which the samples of each pixel begin, row by row; none if all do as one path.
    beginnings: Beginnings,
    /// Levels of the sampler's table.
    sobol_levels: u32,
    /// By how much variance must fall in the trial.
    reuse_is_worth: f64,
    stage: &'static str,
    // Dropped before the buffers they refer to; the timeline first, which waits for the device.
    timeline: Timeline,
    pipeline: Pipeline,
    beams: Option<BeamTracer>,
    buffers: Buffers,
    statistics: RenderStatistics,
}

impl Renderer {
    /// Prepares everything: builds the tree, uploads tables, specialises and compiles the shaders.
    ///
    /// # Errors
    /// The device's limits or memory are exceeded; a Vulkan call fails; the settings make no sense.
    pub fn new(context: &Context, scene: &Scene, settings: &RenderSettings) -> Result<Self, RenderError> {
        Self::with(context, Prepared::of(scene, settings)?)
    }

    /// The same for a scene that has been prepared.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with(context: &Context, prepared: Prepared<'_>) -> Result<Self, RenderError> {
        let start = Instant::now();
        let Prepared { scene, settings, features, tables, seconds: prepared_seconds } = prepared;
        let device = &context.0;
        let facts = DriverFacts::of(context.info()).with(settings);
        let subgroup = device.info.subgroup_size;
        let needed = if settings.general || settings.unneeded.is_some() {
            Features::of(scene, &RenderSettings { general: false, unneeded: None, ..settings.clone() })
        } else {
            features.clone()
        };
        let beam_targets = beams::targets(&needed, &tables, settings);
        let reuse = trial::may_reuse(&needed, settings, &facts) && beam_targets == 0;
        let job = Job {
            features: &features,
            facts: &facts,
            keeps_kernels: device.shader_objects.is_some(),
            sah_cost: tables.tree.as_ref().map(|tree| tree.sah_cost),
            seen: View::of(scene).part_of(tables.tree_boxes()),
            samples: f64::from(scene.film.width) * f64::from(scene.film.height) * f64::from(settings.samples),
            reuse,
        };
        let schedule = job.schedule(settings.scheduler);
        let queued = schedule == Schedule::Queue;
        let sobol_levels = shares::levels_of_table(&features, settings, reuse);
        let sobol = sobol::table(sobol_levels, if reuse { sobol::MEMBERS } else { 1 });

        let (width, height) = (scene.film.width, scene.film.height);
        let slots = slot_count(width, height);
        if slots > u64::from(u32::MAX) / 2 {
            return Err(RenderError::Settings(format!("an image of {width}×{height} pixels is too large")));
        }

        if tables.tree_records() > MAX_RECORDS {
            let (records, triangles) = (tables.tree_records(), scene.triangle_count());
            return Err(RenderError::Settings(format!(
                "a tree of {records} records for {triangles} triangles is too large: there may be {MAX_RECORDS}"
            )));
        }
        let regions = if queued { facts.queue_regions } else { 0 };
        let loop_budget = settings.loop_budget.unwrap_or(facts.loop_budget);
        let cpu_threads = (device.info.kind == DeviceKind::Cpu).then(threads);
        let limits = &device.limits;
        // Of invocations in a workgroup: what they keep there has to fit too.
        let room = match schedule {
            Schedule::Turns => limits.max_compute_shared_memory_size / KEPT_BYTES,
            Schedule::Inline | Schedule::Queue => u32::MAX,
        };
        let most_invocations = limits.max_compute_work_group_invocations.min(room);
        let bounds = split::Bounds {
            uneven: features.tree && !features.dielectric,
            invocations: most_invocations / subgroup,
            noted: device.info.max_texel_elements.min(device.info.max_storage_range / 16),
        };
        let split = match schedule {
            Schedule::Inline | Schedule::Turns if !reuse => {
                // Who wants workgroups of some size gets them.
                let wanted = settings.split.or(settings.workgroup_size.map(|_| 1));
                Split::of(wanted, facts.invocations, slots, settings.samples, &bounds)
            }
            _ => Split::NONE,
        };
        let workgroup = match settings.workgroup_size {
            // The queue's workgroup is one subgroup.
            _ if queued => subgroup,
            // Lanes of a subgroup are neighbours in the image.
            _ if split != Split::NONE => subgroup * split.invocations,
            size => {
                let size = size.unwrap_or(facts.workgroup_of(slots));
                if reuse { size.next_multiple_of(subgroup) } else { size }
            }
        };
        if workgroup == 0 || workgroup > most_invocations {
            return Err(RenderError::Settings(format!(
                "a workgroup of {workgroup} invocations is not possible, expected 1 to {most_invocations}"
            )));
        }
        let most_groups = limits.max_compute_work_group_count[0];
        // Where a branch that no lane takes is executed, to draw takes longer than what threads wait for each other (22.3.6: 1.05 to
        // 1.1 times the time; 25.0.7 .88 to 1.0), and so it does for paths of one hit.
        let may_draw =
            schedule == Schedule::Inline && split == Split::NONE && facts.skips_branches && features.has_long_paths();
        let handout = match cpu_threads {
            Some(threads) if queued => Handout::of_queue(loop_budget, threads, &facts),
            Some(2..) if may_draw && workgroup.is_multiple_of(subgroup) => Handout::DrawnOnce { most: most_groups },
            _ => Handout::ToWorkgroups,
        };
        let slots_per_piece = if queued { queue::TILE } else { workgroup / split.invocations };
        let mut specialization = tables.specialization(&features, settings, facts);
        specialization.uint(constant::SOBOL_LEVELS, sobol_levels).uint(constant::SPLIT, split.invocations);
        specialization.uint(constant::WORKGROUP, workgroup).uint(constant::LOOP_BUDGET, loop_budget);
        // Lanes that must be at work for a subgroup to go on as it does. (Seven of eight instead of five, and paths counted every
        // second step instead of every fourth: .95 to 1.0 of the time, lavapipe 25.0.7 and 22.3.6.)
        let enough = match schedule {
            // That wait to be shaded. (A quarter and three quarters of them: 1.05 and 1.03 of the time, H100.)
            Schedule::Turns => (subgroup / 2).max(1),
            Schedule::Inline | Schedule::Queue => (workgroup * 7 / 8).max(1),
        };
        specialization.uint(constant::REGIONS, regions).uint(constant::ENOUGH_LANES, enough);
        let lamp_places = glances::places(&needed, &tables, settings, [width, height]);
        specialization.uint(constant::GLANCES, if lamp_places.is_empty() { 0 } else { glance::GLANCES });
        let light_samples = if reuse { tables.light_samples(settings.light_samples) } else { 1 };
        specialization.bool(constant::DRAWS_WORK, handout.is_drawn());
        specialization.bool(constant::SKIPS_BRANCHES, facts.skips_branches);
        specialization.bool(constant::REUSE, reuse).uint(constant::SUBGROUP_LANES, subgroup);
        specialization.uint(constant::LIGHT_SAMPLES, light_samples);
        // With further samples of lights, which lanes take side by side, lavapipe 22.3.6 takes .6 to .87 of the time by lanes too.
        let by_lanes = settings.share_by_lanes.unwrap_or(facts.skips_branches || light_samples > 1);
        specialization.bool(constant::SHARED_BY_LANES, facts.groups_fit && by_lanes);
        specialization.uint(constant::BEAM_TARGETS, beam_targets);
        let repeats = repeats::may_repeat(&needed, beam_targets, settings);
        specialization.bool(constant::REPEATS, repeats);
        let built_in = kernels::built_in(schedule);
        let stage = built_in.name;
        let spirv = kernels::spirv(&built_in, settings)?;
        // A dispatch has few invocations of many beams each: many small workgroups.
        let beam_workgroup = if facts.threads { subgroup.clamp(32, 128) } else { facts.workgroup_size };
        let layout = bindings::layout(device, &buffers::BINDINGS)?;
        let beam_layout = (beam_targets > 0).then(|| BeamTracer::layout(device)).transpose()?;
        let mut timeline = Timeline::new(device, IN_FLIGHT)?;
        let row_slots = slots_of_row(width);
        let covered = u64::from(handout.most_pieces(most_groups)) * u64::from(slots_per_piece);
        let split_samples = split.noted(slots.min(covered));
        let shape = Shape { slots, row_slots, covered, regions, split_samples, reuse, notes: queued && reuse };
        // Each time that lavapipe begins to make machine code, as it does for the buffers' formats, it sets the width of its vectors to 256
        // bits, and then to what was asked for: a shader that another thread works on meanwhile may take a subgroup's lanes for eight
        // (lp_build_init_native_width of Mesa 25.0; up to one start of 500 on a busy machine).
        let one_by_one = device.info.kind == DeviceKind::Cpu && subgroup != 8;
        // The driver works on the shader while buffers are made and filled. (On the main thread the former, which
        // allocates much more: the heaps of other threads grow in small steps.)
        let (pipeline, beams, pipeline_seconds, buffers) = std::thread::scope(|scope| {
            let mut fill = || Buffers::new(device, &layout, &mut timeline, &tables, &sobol, &shape);
            let buffers: Box<dyn FnOnce() -> Result<Buffers, RenderError> + '_> = if one_by_one {
                let buffers = fill();
                Box::new(|| buffers)
            } else {
                let filling = std::thread::Builder::new().spawn_scoped(scope, fill).map_err(RenderError::Thread)?;
                Box::new(|| filling.join().unwrap_or_else(|panic| resume_unwind(panic)))
            };
            let start = Instant::now();
            let of_beams = |layout| BeamTracer::pipeline(device, layout, &specialization, beam_workgroup, settings);
            let of_beams = match &beam_layout {
                Some(layout) => Some(
                    std::thread::Builder::new()
                        .spawn_scoped(scope, move || of_beams(layout).map(|pipeline| (layout, pipeline)))
                        .map_err(RenderError::Thread)?,
                ),
                None => None,
            };
            let pipeline = Pipeline::new(device, stage, &spirv, &specialization, &layout);
            let beams = of_beams.map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)));
            let seconds = start.elapsed().as_secs_f64();
            let buffers = buffers()?;
            Ok::<_, RenderError>((pipeline?, beams.transpose()?, seconds, buffers))
        })?;
        let beams = beams.map(|(layout, pipeline)| {
            let film = &buffers.bands[0].film;
            let own = [(binding::FILM, film), (binding::FILM_ROWS, film), (binding::COUNTERS, &buffers.counters)];
            BeamTracer::new(device, layout, pipeline, beam_workgroup, &buffers.tables.and(&own))
        });

        let beam_scale = if beams.is_some() { beams::scale(&View::of(scene)) } else { 0.0 };
        let push = Push { beam_scale, ..push_constants(scene, settings) };
        let mut renderer = Self {
            settings: settings.clone(),
            features,
            tree: tables.tree,
            hidden_lights: tables.hidden_lights(),
            push,
            width,
            height,
            loop_budget,
            slots_per_piece,
            handout,
            pace: Pace::new(
                settings.samples_per_dispatch,
                if queued { queue::PATHS / queue::TILE } else { split.most_samples },
                match device.info.kind {
                    DeviceKind::Cpu => Rounds::on_cpu(threads(), settings.time_limit),
                    _ => Rounds::on_gpu(),
                },
            ),
            lamp_places,
            gradients: reuse && settings.gradients == Gradients::Auto && buffers.has_whole_rows(row_slots),
            lights_alike: tables.samples_lights(),
            groups: Groups::default(),
            shares: Shares::default(),
            places: Places::default(),
            certainties: Certainties::default(),
            repeats,
            beginnings: Beginnings::default(),
            reuse: ReuseTrial::Never,
            sobol_levels,
            reuses: if reuse { settings.reuse } else { Reuse::Off },
            fewest_reused: trial::fewest_samples(&needed, settings.reuse, &facts),
            reuse_is_worth: trial::worth(&needed, &facts),
            stage,
            timeline,
            pipeline,
            beams: beams.transpose()?,
            buffers,
            statistics: RenderStatistics::default(),
        };
        let warm_up_start = Instant::now();
        renderer.warm_up()?;
        renderer.warm_up_beams()?;
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
    pub fn tree(&self) -> Option<&TreeStatistics> {
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
    /// It is 0, or more than the pipeline's sampler table was made for.
    pub fn set_samples(&mut self, samples: u32) -> Result<(), RenderError> {
        if samples == 0 || sobol::levels(samples) > self.features.sobol_levels {
            return Err(RenderError::Settings(format!(
                "{samples} samples per pixel, expected at least 1 and not many more than the {} that the renderer \
                 was made for",
                self.settings.samples
            )));
        }
        self.settings.samples = samples;
        Ok(())
    }

    /// Samples adaptively, or no longer so, from now on.
    ///
    /// # Errors
    /// The goal makes no sense, or the image or the number of samples is too small for an estimate.
    pub fn set_adaptive(&mut self, adaptive: Option<Adaptive>) -> Result<(), RenderError> {
        if let Some(adaptive) = &adaptive {
            adaptive.check(u64::from(self.width) * u64::from(self.height), self.settings.samples)?;
        }
        self.settings.adaptive = adaptive;
        Ok(())
    }

    /// What the last rendering did.
    pub fn statistics(&self) -> &RenderStatistics {
        &self.statistics
    }

    /// Renders until all samples are done, the noise is reached, the time limit is over, or `on_progress` breaks; then
    /// reads the film.
    ///
    /// `on_progress` is called after every dispatch.
    ///
    /// # Errors
    /// The device fails, or the driver cuts loops short.
    pub fn render(&mut self, mut on_progress: impl FnMut(&Progress) -> ControlFlow<()>) -> Result<Film, RenderError> {
        let RenderStatistics { setup_seconds, compile_seconds, .. } = self.statistics;
        self.statistics = RenderStatistics { setup_seconds, compile_seconds, ..RenderStatistics::default() };
        // Beams come last.
        let for_paths = if self.beams.is_some() { 0.9 } else { 1.0 };
        let limit = self.settings.time_limit.map(|limit| limit.mul_f64(for_paths));
        let mut watch = Watch::new(limit, &mut on_progress);
        self.clear_film()?;
        let long = self.settings.samples >= self.fewest_reused;
        self.reuse = if long { ReuseTrial::of(self.reuses) } else { ReuseTrial::Never };
        self.shares = Shares::default();
        self.survey()?;
        self.find_beginnings()?;
        self.try_reuse()?;
        let film = match self.settings.adaptive {
            None => self.render_uniform(&mut watch)?,
            Some(adaptive) if self.makes_gradients() => self.render_twins(&adaptive, &mut watch)?,
            Some(adaptive) => self.render_adaptive(&adaptive, &mut watch)?,
        };
        self.statistics.count_pixels(&film);
        self.statistics.reuse_gain = self.reuse.gain();
        self.statistics.render_seconds = watch.elapsed().as_secs_f64();
        Ok(film)
    }

    /// The samples that are asked for.
    fn render_uniform(&mut self, watch: &mut Watch<'_>) -> Result<Film, RenderError> {
        watch.total = self.samples_of_image(self.settings.samples);
        let (mut done, mut light) = (0, self.no_beams());
        for samples in self.samples_between_beams() {
            self.pass(&self.whole_film(), done, samples, watch)?;
            if watch.stop {
                break;
            }
            self.keep_up_with_beams(&mut light, watch)?;
            done = samples;
        }
        self.statistics.stopped = self.statistics.samples < watch.total;
        let mut film = self.develop()?;
        self.add_beams(&mut film, light, f64::INFINITY, watch)?;
        Ok(film)
    }
}

/// Threads that a driver on the CPU has.
fn threads() -> u32 {
    std::thread::available_parallelism().map_or(1, |n| u32::try_from(n.get()).unwrap_or(u32::MAX / 4))
}

pub(crate) fn push_constants(scene: &Scene, settings: &RenderSettings) -> Push {
    let view = View::of(scene);
    let vector = |v: glam::DVec3| {
        let v = v.as_vec3();
        [v.x, v.y, v.z, 0.0]
    };
    Push {
        camera_right: view.right.as_vec3().to_array(),
        camera_up: vector(view.up),
        camera_forward: vector(view.forward),
        background: [scene.background[0] as f32, scene.background[1] as f32, scene.background[2] as f32, 0.0],
        width: scene.film.width,
        height: scene.film.height,
        seed: settings.seed,
        ..Push::zeroed()
    }
}
