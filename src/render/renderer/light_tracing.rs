//! Light traced from emitters through glass and by mirrors (shaders/light_trace.comp), added to what paths have found.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use crate::gpu::{
    Access, BindingKind, BindingLayout, BindingSet, Buffer, Device, Pipeline, Specialization, Ticket, Usage,
};

use crate::render::error::RenderError;
use crate::render::film::Film;
use crate::render::kernel;
use crate::render::kernel::LIGHT_TRACE;
use crate::render::kernel::bindings;
use crate::render::kernel::driver_traits::DriverTraits;
use crate::render::kernel::features::Features;
use crate::render::kernel::layout::{Counters, Push, SplatRecord, binding};
use crate::render::kernel::specialization::id;
use crate::render::light_tracing::splats::{SplatRecords, Splats};
use crate::render::renderer::pass::{RenderControl, mapped};
use crate::render::renderer::{IN_FLIGHT, Renderer};
use crate::render::scene::tables::Tables;
use crate::render::settings::{LightTracing, RenderSettings, Reuse};
use crate::render::space::view::View;

/// Light paths for each sample of the image. Squared error × time with half as many is 1.04 to 1.2 times as large, with twice as many
/// .93 to 1.12, with four times as many 1.03 to 1.35 (a bunny of glass, an armadillo of mirror, balls of both; 4 and 16 samples,
/// lavapipe 25.0.7).
const LIGHT_PATHS_PER_SAMPLE: f64 = 1.0 / 8.0;
/// Most light paths: their numbers have 32 bits.
const MOST_LIGHT_PATHS: u64 = ((1 << 31) - BLOCK) as u64;
/// Light paths of a dispatch, if as many notes fit into a buffer: on CPUs, and on GPUs.
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
pub(crate) fn targets(needed: &Features, tables: &Tables, settings: &RenderSettings) -> u32 {
    // Light that pixels share would have to be shared with light paths for each of them apart.
    let wanted = settings.light_tracing == LightTracing::Auto && settings.reuse != Reuse::Always;
    if wanted && needed.may_trace_light() { tables.light_paths.targets } else { 0 }
}

/// What density light paths have where paths have 1 (`light_path_scale` of the shaders).
pub(crate) fn scale(view: &View) -> f32 {
    (LIGHT_PATHS_PER_SAMPLE * std::f64::consts::PI * 4.0 * view.right.length() * view.up.length()) as f32
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
    notes: Vec<Records>,
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
pub(crate) fn most_light_paths(pixels: u64, settings: &RenderSettings) -> u64 {
    light_paths_for(pixels * u64::from(settings.samples))
}

/// Bytes of what so many light paths note.
fn records_bytes(light_paths: usize) -> u64 {
    light_paths as u64 * u64::from(SplatRecord::MOST) * size_of::<SplatRecord>() as u64
}

impl LightTracer {
    /// The kernel, for which `paths` has what scene and features say.
    pub fn pipeline(
        device: &Arc<Device>,
        layout: &BindingLayout,
        paths: &Specialization,
        workgroup: u32,
        settings: &RenderSettings,
    ) -> Result<Pipeline, RenderError> {
        let mut specialization = paths.clone();
        specialization.uint(id::WORKGROUP, workgroup).bool(id::SAMPLE_MAP, false).bool(id::REUSE, false);
        let spirv = kernel::spirv(&LIGHT_TRACE, settings)?;
        Pipeline::new(device, LIGHT_TRACE.name, &spirv, &specialization, layout)
            .map_err(|error| kernel::not_made(&LIGHT_TRACE, settings, error))
    }

    /// What the kernel sees.
    pub fn layout(device: &Arc<Device>) -> Result<Arc<BindingLayout>, RenderError> {
        Ok(bindings::layout(device, &BINDINGS)?)
    }

    /// With its buffers, for so many light paths at most; `bound` are those of the path tracer that all kernels see.
    pub fn new(
        device: &Arc<Device>,
        layout: &Arc<BindingLayout>,
        pipeline: Pipeline,
        workgroup: u32,
        traits: &DriverTraits,
        most_light_paths: u64,
        bound: &[(u32, &Buffer)],
    ) -> Result<Self, RenderError> {
        let of_gpus = usize::from(traits.threads);
        let most = device.info.max_texel_elements / u64::from(SplatRecord::MOST);
        let dispatch = (most.min(u64::from(DISPATCH[of_gpus])).min(most_light_paths) as u32 / BLOCK).max(1) * BLOCK;
        let in_flight = most_light_paths.div_ceil(u64::from(dispatch)).clamp(1, IN_FLIGHT as u64) as usize;
        let notes = |i: usize| {
            let bytes = records_bytes(dispatch as usize);
            let buffer = Buffer::new(device, &format!("light paths {i}"), bytes, Usage::HostTexel)?;
            let mut all = bound.to_vec();
            all.push((binding::LIGHT_PATHS, &buffer));
            Ok(Records { set: BindingSet::new(layout, &all)?, buffer })
        };
        let notes = (0..in_flight).map(notes).collect::<Result<_, RenderError>>()?;
        Ok(Self { pipeline, workgroup, dispatch, per_invocation: LIGHT_PATHS_PER_INVOCATION[of_gpus], notes })
    }

    /// What the light paths of these numbers have noted, which were the last to use that one of the buffers.
    fn recorded(&self, span: &Range<u32>, number: usize) -> Result<SplatRecords<'_>, RenderError> {
        let bytes = mapped(&self.notes[number].buffer)?;
        Ok(SplatRecords::of(bytemuck::cast_slice(&bytes[..records_bytes(span.len()) as usize])))
    }
}

impl Renderer {
    /// The light of no light path yet.
    pub(crate) fn no_light_paths(&self) -> Splats {
        let pixels = if self.light_paths.is_some() { self.width as usize * self.height as usize } else { 0 };
        Splats::new(pixels)
    }

    /// Samples per pixel after which light paths are traced, so that at no time too many of them are missing: they double.
    pub(crate) fn samples_between_light_tracing(&self) -> impl Iterator<Item = u32> + use<> {
        let samples = self.settings.samples;
        let first = if self.light_paths.is_some() { FIRST_LIGHT_PATHS.min(samples) } else { samples };
        std::iter::successors(Some(first), move |&n| (n < samples).then(|| n.saturating_mul(2).min(samples)))
    }

    /// The samples that are done, as many as they would be if each pixel got as many as are asked for.
    pub(crate) fn even_samples(&self) -> u64 {
        let done = self.statistics.samples;
        if self.sample_map.is_even() {
            return done;
        }
        let samples = self.settings.samples;
        let even = u128::from(self.pixels(&self.whole_film())) * u128::from(samples);
        (u128::from(done) * even / u128::from(self.samples_of_image(samples).max(1))) as u64
    }

    /// Traces as many light paths as go with so many samples, over all pixels, or fewer if the watch says stop. Returns whether all are traced.
    pub(crate) fn keep_up_with_light_paths(
        &mut self,
        samples: u64,
        watch: &mut RenderControl<'_>,
    ) -> Result<bool, RenderError> {
        let light_paths = light_paths_for(samples);
        self.trace_light_to(light_paths, watch)?;
        Ok(self.light_paths.is_none() || self.light.light_paths >= light_paths)
    }

    /// The same when paths are over, for which there is a limit of its own. Adds the light of all light paths to the film.
    pub(crate) fn add_light_paths(
        &mut self,
        film: &mut Film,
        samples: u64,
        watch: &mut RenderControl<'_>,
    ) -> Result<bool, RenderError> {
        if self.light_paths.is_none() {
            return Ok(true);
        }
        watch.set_limit(self.settings.time_limit);
        let complete = self.keep_up_with_light_paths(samples, watch)?;
        self.light.add_to(film);
        Ok(complete)
    }

    /// Traces light paths until there are so many, or the watch says stop after a dispatch, when what is in flight is still waited for: any
    /// number of them is right in the mean, but none at all. The device traces a dispatch while the host adds up what the one before
    /// it has noted.
    fn trace_light_to(&mut self, light_paths: u64, watch: &mut RenderControl<'_>) -> Result<(), RenderError> {
        let Some(tracer) = self.light_paths.clone() else { return Ok(()) };
        let (dispatch, most_in_flight) = (u64::from(tracer.dispatch), tracer.notes.len());
        let mut begun = self.light.light_paths;
        let mut in_flight = VecDeque::new();
        loop {
            while in_flight.len() < most_in_flight && begun < light_paths && (begun == 0 || !watch.stop) {
                let end = light_paths.min(begun + dispatch);
                let span = begun as u32..end as u32;
                let number = (begun / dispatch) as usize % most_in_flight;
                let ticket = self.trace_light(&tracer, &span, tracer.per_invocation, number)?;
                in_flight.push_back((ticket, Instant::now(), span, number));
                begun = end;
            }
            let Some((ticket, submitted, span, number)) = in_flight.pop_front() else { return Ok(()) };
            self.finish(&ticket, number)?;
            let budget = self.launch.loop_budget;
            let is_unfinished = || Ok::<_, RenderError>(budget > 0 && tracer.recorded(&span, number)?.are_unfinished());
            if is_unfinished()? {
                // What did not fit into the loop budget beside others may alone.
                let ticket = self.trace_light(&tracer, &span, 1, number)?;
                self.finish(&ticket, number)?;
                if is_unfinished()? {
                    return Err(RenderError::Stuck { budget });
                }
            }
            self.light.add(tracer.recorded(&span, number)?);
            let seconds = watch.finished_since(submitted);
            watch.report(self.statistics.samples, seconds, false);
        }
    }

    /// Traces the light paths of these numbers, so many with each invocation, as one of the dispatches in flight.
    fn trace_light(
        &mut self,
        tracer: &LightTracer,
        span: &Range<u32>,
        per_invocation: u32,
        number: usize,
    ) -> Result<Ticket, RenderError> {
        let push = Push { first_slot: span.start, end_slot: span.end, ..self.push };
        let (counters, read_counters) = (&self.buffers.counters, &self.buffers.readbacks[number]);
        let ticket = self.timeline.submit(|r| {
            r.timed(LIGHT_TRACE.name, |r| {
                let groups = (span.len() as u32).div_ceil(per_invocation * tracer.workgroup);
                r.dispatch(&tracer.pipeline, &tracer.notes[number].set, bytemuck::bytes_of(&push), [groups, 1, 1]);
            });
            r.barrier(Access::Compute, Access::Transfer);
            r.barrier(Access::Compute, Access::Host);
            r.copy(counters, 0, read_counters, 0, size_of::<Counters>() as u64);
            r.barrier(Access::Transfer, Access::Transfer);
            r.clear(counters);
            r.barrier(Access::Transfer, Access::Compute);
            r.barrier(Access::Transfer, Access::Host);
        })?;
        Ok(ticket)
    }

    /// Compiles the kernel for good, as [`Renderer::warm_up`] does.
    pub(crate) fn warm_up_light_tracing(&mut self) -> Result<(), RenderError> {
        let Some(tracer) = &self.light_paths else { return Ok(()) };
        let push = Push { end_slot: 0, ..self.push };
        let ticket = self
            .timeline
            .submit(|r| r.dispatch(&tracer.pipeline, &tracer.notes[0].set, bytemuck::bytes_of(&push), [1, 1, 1]))?;
        self.timeline.wait(&ticket)?;
        Ok(())
    }
}
