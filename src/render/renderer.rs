//! The loop that renders: upload, compile, dispatch, wait, read back. Every wait of the host is in this file.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytemuck::Zeroable;

use crate::accel::TreeStatistics;
use crate::gpu::{Access, Binding, BindingSet, Buffer, Context, Device, Pipeline, Ticket, Timeline, Usage};
use crate::scene::Scene;

use super::driver::DriverFacts;
use super::error::RenderError;
use super::features::{Feature, Features};
use super::film::{Film, slot_count};
use super::kernels;
use super::layout::{Counters, FilmSlot, Push, binding, constant, queue};
use super::plan::{Plan, Work};
use super::settings::{RenderSettings, Scheduler};
use super::sobol;
use super::space::RenderSpace;
use super::statistics::{Progress, RenderStatistics};
use super::tables::Tables;
use super::upload::upload;

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
    /// Slots of the film that a workgroup serves.
    slots_per_group: u32,
    most_samples: u32,
    stage: &'static str,
    bands: Vec<Band>,
    // Dropped before the buffers they refer to; the timeline first, which waits for the device.
    timeline: Timeline,
    pipeline: Pipeline,
    counters: Buffer,
    readbacks: Vec<Buffer>,
    _tables: Vec<Buffer>,
    /// The queue's regions, and which of them are taken.
    queue: [Buffer; 2],
    device: Arc<Device>,
    statistics: RenderStatistics,
}

/// A part of the film that fits into one storage buffer.
struct Band {
    first: u32,
    slots: u32,
    set: BindingSet,
    film: Buffer,
}

impl Renderer {
    /// Prepares everything: builds the tree, uploads tables, specialises and compiles the shaders.
    ///
    /// # Errors
    /// The device's limits or memory are exceeded; a Vulkan call fails; the settings make no sense.
    pub fn new(context: &Context, scene: &Scene, settings: &RenderSettings) -> Result<Self, RenderError> {
        let start = Instant::now();
        if settings.samples == 0 {
            return Err(RenderError::Settings("the number of samples is 0, expected at least 1".to_owned()));
        }
        if settings.samples > 1 << 30 {
            return Err(RenderError::Settings(format!(
                "the number of samples is {}, expected at most {}",
                settings.samples,
                1 << 30
            )));
        }
        let device = &context.0;
        let facts = DriverFacts::of(context.info());
        let features = Features::of(scene, settings);
        let space = RenderSpace::of(scene);
        let tables = Tables::of(scene, &space, settings);
        let sobol = sobol::table(features.sobol_levels);

        let (width, height) = (scene.film.width, scene.film.height);
        let slots = slot_count(width, height);
        let band_slots = (device.info.max_storage_range / size_of::<FilmSlot>() as u64 / 64 * 64).min(1 << 26);
        if slots > u64::from(u32::MAX) / 2 {
            return Err(RenderError::Settings(format!("an image of {width}×{height} pixels is too large")));
        }

        let texel = |name, bytes: usize, format| Buffer::new(device, name, bytes as u64, Usage::Texel(format));
        let float4 = ash::vk::Format::R32G32B32A32_SFLOAT;
        let mut uploads = vec![
            (texel("tree", size_of_val(tables.records.as_slice()), float4)?, bytemuck::cast_slice(&tables.records)),
            (texel("shapes", size_of_val(tables.shapes.as_slice()), float4)?, bytemuck::cast_slice(&tables.shapes)),
            (
                texel("sobol", size_of_val(sobol.as_slice()), ash::vk::Format::R32G32B32A32_UINT)?,
                bytemuck::cast_slice::<_, u8>(&sobol),
            ),
            (
                texel("lights", size_of_val(tables.lights.texels.as_slice()), float4)?,
                bytemuck::cast_slice(&tables.lights.texels),
            ),
        ];
        let counters = Buffer::new(device, "counters", size_of::<Counters>() as u64, Usage::Storage)?;
        let readbacks = (0..IN_FLIGHT)
            .map(|i| Buffer::new(device, &format!("readback {i}"), size_of::<Counters>() as u64, Usage::Readback))
            .collect::<Result<Vec<_>, _>>()?;

        let queued = features.tree
            && match settings.scheduler {
                Scheduler::Auto => facts.queue && !features.brute_force,
                Scheduler::Inline => false,
                Scheduler::Queue => true,
            };
        let regions = if queued { facts.queue_regions } else { 0 };
        let queue_pool = Buffer::new(device, "queue pool", u64::from(regions / 8), Usage::Storage)?;
        let queue_buffer = Buffer::new(device, "queue", u64::from(regions) * queue::REGION_BYTES, Usage::Storage)?;

        let mut bands = Vec::new();
        let mut first = 0u64;
        while first < slots {
            let count = (slots - first).min(band_slots);
            let film = Buffer::new(device, "film", count * size_of::<FilmSlot>() as u64, Usage::Storage)?;
            let numbers = [binding::TREE, binding::SHAPES, binding::SOBOL, binding::LIGHTS];
            let mut bindings: Vec<_> =
                numbers.iter().zip(&uploads).map(|(&number, (buffer, _))| Binding { number, buffer }).collect();
            bindings.push(Binding { number: binding::FILM, buffer: &film });
            bindings.push(Binding { number: binding::COUNTERS, buffer: &counters });
            bindings.push(Binding { number: binding::QUEUE, buffer: &queue_buffer });
            bindings.push(Binding { number: binding::QUEUE_POOL, buffer: &queue_pool });
            let set = BindingSet::new(device, &bindings, size_of::<Push>() as u32)?;
            bands.push(Band { first: first as u32, slots: count as u32, set, film });
            first += count;
        }

        let workgroup = match settings.workgroup_size {
            // The queue's workgroup is one subgroup.
            _ if queued => device.info.subgroup_size,
            Some(size) => size,
            None => facts.workgroup_size,
        };
        if workgroup == 0 || workgroup > device.limits.max_compute_work_group_invocations {
            return Err(RenderError::Settings(format!(
                "a workgroup of {workgroup} invocations is not possible, expected 1 to {}",
                device.limits.max_compute_work_group_invocations
            )));
        }
        let loop_budget = settings.loop_budget.unwrap_or(facts.loop_budget);
        let mut specialization = tables.specialization(&features, settings);
        specialization.uint(constant::WORKGROUP, workgroup).uint(constant::LOOP_BUDGET, loop_budget);
        // Lanes that must be at work for a subgroup to go on as it does.
        let enough = (workgroup * 5 / 8).max(1);
        specialization
            .uint(constant::REGIONS, regions)
            .uint(constant::ENOUGH_PATHS, enough)
            .uint(constant::ENOUGH_WALKS, enough);
        let built_in =
            kernels::choose(&features, queued, settings.general || settings.unneeded == Some(Feature::Places));
        let stage = built_in.name;
        let spirv = kernels::spirv(&built_in, settings)?;
        let compile_start = Instant::now();
        let pipeline = Pipeline::new(device, stage, &spirv, &specialization, &bands[0].set)?;
        let pipeline_seconds = compile_start.elapsed().as_secs_f64();

        let mut timeline = Timeline::new(device, IN_FLIGHT)?;
        upload(device, &mut timeline, &mut uploads)?;
        let push = push_constants(scene, settings);
        let mut renderer = Self {
            settings: settings.clone(),
            features,
            tree: tables.tree,
            hidden_lights: tables.hidden_lights(),
            push,
            width,
            height,
            loop_budget,
            slots_per_group: if queued { queue::TILE } else { workgroup },
            most_samples: if queued { queue::PATHS / queue::TILE } else { u32::MAX },
            stage,
            bands,
            timeline,
            pipeline,
            counters,
            readbacks,
            _tables: uploads.into_iter().map(|(buffer, _)| buffer).collect(),
            queue: [queue_buffer, queue_pool],
            device: Arc::clone(device),
            statistics: RenderStatistics::default(),
        };
        let warm_up_start = Instant::now();
        renderer.warm_up()?;
        renderer.statistics.compile_seconds = pipeline_seconds + warm_up_start.elapsed().as_secs_f64();
        renderer.statistics.setup_seconds = start.elapsed().as_secs_f64();
        Ok(renderer)
    }

    /// What the pipeline is specialised for.
    pub fn features(&self) -> &Features {
        &self.features
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

    /// What the last rendering did.
    pub fn statistics(&self) -> &RenderStatistics {
        &self.statistics
    }

    /// Renders until all samples are done, the time limit is over, or `on_progress` breaks; then reads the film.
    ///
    /// `on_progress` is called after every dispatch.
    ///
    /// # Errors
    /// The device fails, or the driver cuts loops short.
    pub fn render(&mut self, mut on_progress: impl FnMut(&Progress) -> ControlFlow<()>) -> Result<Film, RenderError> {
        let start = Instant::now();
        let RenderStatistics { setup_seconds, compile_seconds, .. } = self.statistics;
        self.statistics = RenderStatistics { setup_seconds, compile_seconds, ..RenderStatistics::default() };
        self.clear_film()?;
        let pixels = u64::from(self.width) * u64::from(self.height);
        let total = pixels * u64::from(self.settings.samples);
        let bands: Vec<_> = self.bands.iter().map(|b| (b.first, b.slots)).collect();
        let mut plan = Plan::new(&bands, self.settings.samples, self.settings.samples_per_dispatch, self.most_samples);
        let mut in_flight: VecDeque<(Ticket, Work, Instant, usize)> = VecDeque::new();
        let mut done_before_repeat = None;
        let mut stop = false;
        let mut last_finished = start;
        loop {
            while !stop && in_flight.len() < IN_FLIGHT {
                let Some(work) = plan.next() else { break };
                let readback = (self.statistics.dispatches % IN_FLIGHT as u64) as usize;
                let ticket = self.submit(&work, readback)?;
                self.statistics.dispatches += 1;
                in_flight.push_back((ticket, work, Instant::now(), readback));
            }
            let Some((ticket, work, submitted, readback)) = in_flight.pop_front() else { break };
            let stages = self.timeline.wait(&ticket)?;
            let now = Instant::now();
            // The device works on one submission at a time: this one began when its predecessor ended.
            let seconds = now.duration_since(submitted.max(last_finished)).as_secs_f64();
            last_finished = now;
            let counters = self.read_counters(readback)?;
            if counters.truncated > 0 {
                return Err(RenderError::Truncated { count: counters.truncated });
            }
            self.statistics.add(&counters, &stages);
            let done = self.statistics.samples;
            plan.measured(&work, seconds);
            if in_flight.is_empty() && plan.is_over() && done < total && !stop {
                // Samples that ran out of loop budget are done again, as long as that gets any further.
                if done_before_repeat.replace(done) == Some(done) {
                    return Err(RenderError::Stuck { budget: self.loop_budget });
                }
                plan.repeat();
            }
            let progress = Progress { done, total, elapsed: start.elapsed() };
            let late = self.settings.time_limit.is_some_and(|limit| {
                // A pass that would not end in time is not begun; the first one always is.
                progress.elapsed + Duration::from_secs_f64(seconds) > limit
            });
            if done < total && (late || on_progress(&progress).is_break()) {
                stop = true;
            } else if done == total {
                let _ = on_progress(&progress);
            }
        }
        let film = self.read_film()?;
        self.statistics.stopped = self.statistics.samples < total;
        self.statistics.samples_per_pixel = film.counts().iter().copied().min().unwrap_or(0);
        self.statistics.render_seconds = start.elapsed().as_secs_f64();
        Ok(film)
    }

    /// Compiles the pipeline for good: some drivers do so only when it first runs.
    fn warm_up(&mut self) -> Result<(), RenderError> {
        let push = Push { end_slot: 0, ..self.push };
        let (pipeline, set) = (&self.pipeline, &self.bands[0].set);
        let ticket = self.timeline.submit(|r| r.dispatch(pipeline, set, bytemuck::bytes_of(&push), [1, 1, 1]))?;
        self.timeline.wait(&ticket)?;
        Ok(())
    }

    fn clear_film(&mut self) -> Result<(), RenderError> {
        let (bands, counters, queue_pool) = (&self.bands, &self.counters, &self.queue[1]);
        let ticket = self.timeline.submit(|r| {
            for band in bands {
                r.clear(&band.film);
            }
            r.clear(queue_pool);
            r.clear(counters);
            r.barrier(Access::Transfer, Access::Compute);
        })?;
        self.timeline.wait(&ticket)?;
        Ok(())
    }

    fn submit(&mut self, work: &Work, readback: usize) -> Result<Ticket, RenderError> {
        let band = &self.bands[work.band];
        let push = Push {
            first_slot: work.first_slot,
            end_slot: work.end_slot,
            target_samples: work.target_samples,
            max_new_samples: work.new_samples,
            band_first: band.first,
            ..self.push
        };
        let groups = (work.end_slot - work.first_slot).div_ceil(self.slots_per_group);
        let stage = self.stage;
        let (pipeline, counters, readback) = (&self.pipeline, &self.counters, &self.readbacks[readback]);
        let ticket = self.timeline.submit(|r| {
            r.timed(stage, |r| r.dispatch(pipeline, &band.set, bytemuck::bytes_of(&push), [groups, 1, 1]));
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

    fn read_counters(&self, readback: usize) -> Result<Counters, RenderError> {
        let bytes = mapped(&self.readbacks[readback])?;
        Ok(*bytemuck::from_bytes(&bytes[..size_of::<Counters>()]))
    }

    fn read_film(&mut self) -> Result<Film, RenderError> {
        let mut film = Film::new(self.width, self.height);
        for band in &self.bands {
            let bytes = u64::from(band.slots) * size_of::<FilmSlot>() as u64;
            let readback = Buffer::new(&self.device, "film readback", bytes, Usage::Readback)?;
            let ticket = self.timeline.submit(|r| {
                r.barrier(Access::Compute, Access::Transfer);
                r.copy(&band.film, 0, &readback, 0, bytes);
                r.barrier(Access::Transfer, Access::Host);
            })?;
            self.timeline.wait(&ticket)?;
            film.read_slots(band.first, bytemuck::cast_slice(&mapped(&readback)?[..bytes as usize]));
        }
        Ok(film)
    }
}

fn mapped(buffer: &Buffer) -> Result<&[u8], RenderError> {
    buffer.mapped().ok_or_else(|| RenderError::Settings("the driver does not map read-back memory".to_owned()))
}

pub(crate) fn push_constants(scene: &Scene, settings: &RenderSettings) -> Push {
    let camera = &scene.camera;
    let forward = (camera.target - camera.position).normalize();
    let right = forward.cross(camera.up.normalize()).normalize();
    let up = right.cross(forward);
    let half_width = (camera.horizontal_fov.to_radians() / 2.0).tan();
    let half_height = half_width * f64::from(scene.film.height) / f64::from(scene.film.width);
    let vector = |v: glam::DVec3| {
        let v = v.as_vec3();
        [v.x, v.y, v.z, 0.0]
    };
    Push {
        camera_right: vector(right * half_width),
        camera_up: vector(up * half_height),
        camera_forward: vector(forward),
        background: [scene.background[0] as f32, scene.background[1] as f32, scene.background[2] as f32, 0.0],
        width: scene.film.width,
        height: scene.film.height,
        seed: settings.seed,
        ..Push::zeroed()
    }
}
