//! Light traced from emitters through glass and by mirrors (shaders/light_trace.comp), added to what paths have found.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use crate::gpu::{
    BindingKind, BindingLayout, BindingSet, Buffer, Device, Pipeline, Resource, Specialization, Ticket, Usage,
};

use crate::render::engine::Engine;
use crate::render::engine::buffers::{IN_FLIGHT, mapped};
use crate::render::engine::control::RenderControl;
use crate::render::error::RenderError;
use crate::render::kernel;
use crate::render::kernel::LIGHT_TRACE;
use crate::render::kernel::bindings;
use crate::render::kernel::features::Features;
use crate::render::kernel::layout::{Push, SplatRecord, binding};
use crate::render::kernel::specialization::id;
use crate::render::light_tracing::splats::{SplatRecords, Splats};
use crate::render::plan::launch::Launch;
use crate::render::plan::prepared::Prepared;
use crate::render::scene::tables::Tables;
use crate::render::settings::RenderSettings;
use crate::render::space::view::View;

/// Light paths for each sample of the image. Squared error × time with half as many is 1.04 to 1.2 times as large, with twice as many
/// .93 to 1.12, with four times as many 1.03 to 1.35 (a bunny of glass, an armadillo of mirror, balls of both; 4 and 16 samples,
/// lavapipe 25.0.7).
const LIGHT_PATHS_PER_SAMPLE: f64 = 1.0 / 8.0;
/// Most light paths: their numbers have 32 bits.
const MOST_LIGHT_PATHS: u64 = ((1 << 31) - BLOCK) as u64;
/// Light paths of a dispatch, if as many records fit into a buffer: on CPUs, and on GPUs.
const DISPATCH: [u32; 2] = [1 << 15, 1 << 16];
/// Blocks of light paths with numbers that are evenly spread.
const BLOCK: u32 = 1024;
/// Light paths that an invocation traces, likewise: a lane whose light path has ended need not wait for the others. A GPU has few light paths for its
/// many lanes.
const LIGHT_PATHS_PER_INVOCATION: [u32; 2] = [16, 1];
/// Samples per pixel after which the first light paths are traced.
const FIRST_LIGHT_PATHS: u32 = 16;
/// What they see, besides what all kernels do.
const BINDINGS: [(u32, BindingKind); 1] = [(binding::LIGHT_PATHS, BindingKind::StorageTexels)];

/// The number of targets that light paths have, which paths are to know of: 0 for no light paths. It depends on nothing that is compiled
/// without being needed, so that the image does not.
pub(crate) fn caster_count(needed: &Features, tables: &Tables) -> u32 {
    if needed.may_trace_light() { tables.light_paths.targets } else { 0 }
}

/// What density light paths have where paths have 1 (`light_path_scale` of the shaders).
pub(crate) fn scale(view: &View) -> f32 {
    (LIGHT_PATHS_PER_SAMPLE * std::f64::consts::PI * 4.0 * view.right.length() * view.up.length()) as f32
}

/// Invocations of a workgroup: small ones, of which few light paths still make many.
fn workgroup(launch: &Launch) -> u32 {
    if launch.traits.threads { launch.subgroup.clamp(32, 128) } else { launch.traits.workgroup_size }
}

/// What the kernel is specialised for.
pub(crate) fn specialization(launch: &Launch, prepared: &Prepared<'_>) -> Specialization {
    let mut specialization = launch.specialization(prepared);
    specialization.uint(id::WORKGROUP, workgroup(launch)).bool(id::SAMPLE_MAP, false).bool(id::REUSE, false);
    specialization
}

/// What tracing light paths takes on the device.
pub(crate) struct LightTracer {
    pipeline: Pipeline,
    workgroup: u32,
    /// Light paths of a dispatch.
    dispatch: u32,
    /// Light paths of an invocation.
    per_invocation: u32,
    /// For each dispatch in flight.
    records: Vec<Records>,
}

/// Where the light paths of a dispatch note what they light.
struct Records {
    set: BindingSet,
    buffer: Buffer,
}

/// Light paths for samples of the image: whole blocks of evenly spread numbers, each of another scramble.
fn light_paths_for(samples: u64) -> u64 {
    ((samples as f64 * LIGHT_PATHS_PER_SAMPLE) as u64).max(1).next_multiple_of(u64::from(BLOCK)).min(MOST_LIGHT_PATHS)
}

/// The most light paths of a rendering. (If it gets more samples later, dispatches are smaller than they could be.)
fn most_light_paths(pixels: u64, settings: &RenderSettings) -> u64 {
    light_paths_for(pixels * u64::from(settings.samples))
}

/// Bytes of what so many light paths note.
fn records_bytes(light_paths: usize) -> u64 {
    light_paths as u64 * u64::from(SplatRecord::MOST) * size_of::<SplatRecord>() as u64
}

impl LightTracer {
    /// The kernel, for a scene and what else it is to be specialised for.
    ///
    /// # Errors
    /// A shader of the user's cannot be read; a Vulkan call fails.
    pub fn pipeline(
        device: &Arc<Device>,
        layout: &BindingLayout,
        specialization: &Specialization,
        settings: &RenderSettings,
    ) -> Result<Pipeline, RenderError> {
        let spirv = kernel::spirv(&LIGHT_TRACE, settings)?;
        Pipeline::new(device, LIGHT_TRACE.name, &spirv, specialization, layout)
            .map_err(|error| kernel::not_made(&LIGHT_TRACE, settings, error))
    }

    /// What the kernel sees.
    pub fn layout(device: &Arc<Device>, ray_query: bool) -> Result<Arc<BindingLayout>, RenderError> {
        Ok(bindings::layout(device, &BINDINGS, ray_query)?)
    }

    /// With its buffers, for the image of an engine.
    ///
    /// # Errors
    /// A limit of the device or its memory is exceeded.
    pub fn new(
        device: &Arc<Device>,
        engine: &Engine,
        layout: &Arc<BindingLayout>,
        pipeline: Pipeline,
        settings: &RenderSettings,
    ) -> Result<Self, RenderError> {
        let traits = &engine.launch.traits;
        let most_light_paths = most_light_paths(engine.pixel_count(), settings);
        let buffers = engine.buffers();
        let film = &buffers.bands[0].film;
        let own = [(binding::FILM, film), (binding::FILM_ROWS, film), (binding::COUNTERS, &buffers.counters)];
        let bound = buffers.tables.and(&own);
        let of_gpus = usize::from(traits.threads);
        let most = device.info.max_texel_elements / u64::from(SplatRecord::MOST);
        let dispatch = (most.min(u64::from(DISPATCH[of_gpus])).min(most_light_paths) as u32 / BLOCK).max(1) * BLOCK;
        let in_flight = most_light_paths.div_ceil(u64::from(dispatch)).clamp(1, IN_FLIGHT as u64) as usize;
        let records = |i: usize| {
            let bytes = records_bytes(dispatch as usize);
            let buffer = Buffer::new(device, &format!("light paths {i}"), bytes, Usage::HostTexelAndArray)?;
            let mut all = bound.clone();
            all.push((binding::LIGHT_PATHS, Resource::Buffer(&buffer)));
            Ok(Records { set: BindingSet::new(layout, &all)?, buffer })
        };
        let records = (0..in_flight).map(records).collect::<Result<_, RenderError>>()?;
        let workgroup = workgroup(&engine.launch);
        Ok(Self { pipeline, workgroup, dispatch, per_invocation: LIGHT_PATHS_PER_INVOCATION[of_gpus], records })
    }

    /// What the light paths of these numbers have recorded, which were the last to use that one of the buffers.
    fn recorded(&self, span: &Range<u32>, number: usize) -> Result<SplatRecords<'_>, RenderError> {
        let bytes = mapped(&self.records[number].buffer)?;
        Ok(SplatRecords::of(bytemuck::cast_slice(&bytes[..records_bytes(span.len()) as usize])))
    }
}

impl LightTracer {
    /// Samples per pixel, of so many in all, after which light paths are traced, so that at no time too many of them are missing: they
    /// double.
    pub fn samples_between(samples: u32) -> impl Iterator<Item = u32> {
        let first = FIRST_LIGHT_PATHS.min(samples);
        std::iter::successors(Some(first), move |&n| (n < samples).then(|| n.saturating_mul(2).min(samples)))
    }

    /// Traces as many light paths as go with so many samples, over all pixels, or fewer if the control says stop: then what is in flight
    /// is still waited for. Any number of them is right in the mean, but none at all. Returns whether all are traced. The device traces a
    /// dispatch while the host adds up what the one before it has recorded.
    ///
    /// # Errors
    /// The device fails, or the budget of loops does not suffice for a light path.
    pub fn keep_up(
        &self,
        engine: &mut Engine,
        splats: &mut Splats,
        samples: u64,
        control: &mut RenderControl<'_>,
    ) -> Result<bool, RenderError> {
        let light_paths = light_paths_for(samples);
        let (dispatch, most_in_flight) = (u64::from(self.dispatch), self.records.len());
        let mut begun = splats.light_paths;
        let mut in_flight = VecDeque::new();
        loop {
            while in_flight.len() < most_in_flight && begun < light_paths && (begun == 0 || !control.stop) {
                let end = light_paths.min(begun + dispatch);
                let span = begun as u32..end as u32;
                let number = (begun / dispatch) as usize % most_in_flight;
                let ticket = self.submit(engine, &span, self.per_invocation, number)?;
                in_flight.push_back((ticket, Instant::now(), span, number));
                begun = end;
            }
            let Some((ticket, submitted, span, number)) = in_flight.pop_front() else {
                return Ok(splats.light_paths >= light_paths);
            };
            engine.finish(&ticket, number)?;
            let budget = engine.launch.loop_budget;
            let is_unfinished = || Ok::<_, RenderError>(budget > 0 && self.recorded(&span, number)?.are_unfinished());
            if is_unfinished()? {
                // What did not fit into the loop budget beside others may alone.
                let ticket = self.submit(engine, &span, 1, number)?;
                engine.finish(&ticket, number)?;
                if is_unfinished()? {
                    return Err(RenderError::Stuck { budget });
                }
            }
            splats.add(self.recorded(&span, number)?);
            let seconds = control.finished_since(submitted);
            control.report(engine.statistics.samples, seconds, false);
        }
    }

    /// Traces the light paths of these numbers, so many with each invocation, as one of the dispatches in flight.
    fn submit(
        &self,
        engine: &mut Engine,
        span: &Range<u32>,
        per_invocation: u32,
        number: usize,
    ) -> Result<Ticket, RenderError> {
        let push = Push { first_slot: span.start, end_slot: span.end, modes: 0, ..engine.push };
        let workgroups = (span.len() as u32).div_ceil(per_invocation * self.workgroup);
        engine.submit_kernel((&self.pipeline, &self.records[number].set), LIGHT_TRACE.name, &push, workgroups, number)
    }

    /// Compiles the kernel for good, as [`Engine::warm_up`] does.
    ///
    /// # Errors
    /// The device fails.
    pub fn warm_up(&self, engine: &mut Engine) -> Result<(), RenderError> {
        engine.warm_up_kernel((&self.pipeline, &self.records[0].set))
    }
}
