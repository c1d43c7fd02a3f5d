//! Kernels that run one function of the shader library over arrays of inputs (shaders/probe), for comparison with
//! double precision on the host. They are compiled from the same files as the path tracer.

mod audit;
mod functions;
mod lights;
mod plain;
mod rays;
mod traversal;

use std::borrow::Cow;
use std::marker::PhantomData;
use std::time::Instant;

use bytemuck::{AnyBitPattern, NoUninit, Zeroable};

use crate::gpu::{Access, BindingKind, BindingSet, Buffer, Context, Pipeline, Timeline, Usage, loop_limit};
use crate::render::kernel::bindings;
use crate::render::kernel::bindings::TableBuffers;
use crate::render::kernel::driver_traits::DriverTraits;
use crate::render::kernel::layout::{Counters, FilmSlot, Push, binding};
use crate::render::kernel::sobol;
use crate::render::kernel::specialization::{Compiled, LaunchConstants};
use crate::render::scene::tables::Tables;
use crate::render::space::RenderSpace;
use crate::render::{Features, RenderSettings};
use crate::scene::Scene;

use crate::check::CheckError;

pub(crate) use crate::check::probe::audit::audit;
pub(crate) use crate::check::probe::functions::{Function, Operations, Words};
pub(crate) use crate::check::probe::lights::{Density, DensityQuery, LightPoint, LightQuery};
pub(crate) use crate::check::probe::plain::{FUNCTION, PlainKernel, WORKGROUP, workgroups};
pub(crate) use crate::check::probe::rays::{
    HitRecord, INSIDE, OcclusionRecord, PathInput, PathRecord, RayInput, RayProbe,
};
pub(crate) use crate::check::probe::traversal::{Query, Traced, Traversal};

/// Inputs of one dispatch.
pub(crate) const BATCH: usize = 1 << 18;
/// Loop iterations that an invocation may spend: beyond all that a probe needs, it makes the shader count them.
const COUNTED: u32 = 1 << 20;

const INPUT: u32 = 8;
const OUTPUT: u32 = 9;

/// What probes see, besides what all kernels do.
const BINDINGS: [(u32, BindingKind); 2] = [(INPUT, BindingKind::Array), (OUTPUT, BindingKind::Array)];
const PROBE: u32 = 240;
const RUN: u32 = 241;

/// A kernel of shaders/probe with the choice of its function.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    pub name: &'static str,
    pub spirv: Cow<'static, [u8]>,
    pub function: u32,
    /// Invocations of a workgroup.
    pub workgroup: u32,
    /// Inputs that a workgroup serves.
    pub inputs: u32,
    /// Loop iterations of an invocation (0: no bound); see [`COUNTED`].
    pub loop_budget: u32,
    /// Steps through the BVH are counted.
    pub counts_steps: bool,
}

impl Kernel {
    /// A kernel of one invocation an input, which reports the steps of its traversals.
    pub const fn function(name: &'static str, spirv: &'static [u8], function: u32) -> Self {
        Self {
            name,
            spirv: Cow::Borrowed(spirv),
            function,
            workgroup: 64,
            inputs: 64,
            loop_budget: COUNTED,
            counts_steps: true,
        }
    }
}

/// A kernel ready to run over inputs `I`, each giving an `O`. Both are whole 16-byte words.
pub(crate) struct Probe<I, O> {
    context: Context,
    timeline: Timeline,
    pipeline: Pipeline,
    set: BindingSet,
    input: Buffer,
    upload: Buffer,
    output: Buffer,
    readback: Buffer,
    film: Buffer,
    _tables: TableBuffers,
    _counters: Buffer,
    push: Push,
    inputs: u32,
    records: PhantomData<(I, O)>,
}

impl<I: NoUninit, O: AnyBitPattern> Probe<I, O> {
    /// Specialises the kernel for `scene`, whose tables it sees, and `settings`.
    pub fn new(
        context: &Context,
        kernel: Kernel,
        scene: &Scene,
        tables: &Tables,
        settings: &RenderSettings,
        film_slots: usize,
    ) -> Result<Self, CheckError> {
        let device = &context.0;
        let features = Features::new(scene, tables, settings);
        let table = sobol::table(features.sobol_levels, 1);
        let storage = |name, bytes: usize| Buffer::new(device, name, bytes as u64, Usage::Storage);
        let input = storage("probe input", BATCH * size_of::<I>())?;
        let output = storage("probe output", BATCH * size_of::<O>())?;
        let film_bytes = (film_slots.max(1) * size_of::<FilmSlot>()) as u64;
        let film = Buffer::new(device, "film", film_bytes, Usage::StorageTexelAndArray)?;
        let counters = storage("counters", size_of::<Counters>())?;
        let mut timeline = Timeline::new(device, 1)?;
        let table_buffers = TableBuffers::new(device, &mut timeline, tables, &table)?;
        let layout = bindings::layout(device, &BINDINGS, features.ray_query)?;
        let bound = table_buffers.and(&[
            (binding::FILM, &film),
            (binding::FILM_ROWS, &film),
            (binding::COUNTERS, &counters),
            (INPUT, &input),
            (OUTPUT, &output),
        ]);
        let set = BindingSet::new(&layout, &bound)?;
        let counting = RenderSettings { count_steps: kernel.counts_steps, ..settings.clone() };
        let traits = DriverTraits::of(&device.info, loop_limit(device)?).with(settings);
        let launch = LaunchConstants {
            workgroup: kernel.workgroup,
            loop_budget: kernel.loop_budget,
            enough_lanes: kernel.workgroup - kernel.workgroup / 4,
            threads: traits.threads,
            shuffles: traits.shuffles,
            tables_in_arrays: traits.tables_in_arrays,
            ..LaunchConstants::default()
        };
        let mut specialization = Compiled { features: &features, tables, settings: &counting, launch }.specialization();
        specialization.uint(PROBE, kernel.function).uint(RUN, kernel.inputs);
        let pipeline = Pipeline::new(device, kernel.name, &kernel.spirv, &specialization, &layout)?;
        let ticket = timeline.submit(|r| {
            r.clear(&film);
            r.clear(&counters);
            r.barrier(Access::Transfer, Access::Compute);
        })?;
        timeline.wait(&ticket)?;
        let push = Push { width: 64, height: 64, seed: settings.seed, ..Push::zeroed() };
        Ok(Self {
            context: context.clone(),
            timeline,
            pipeline,
            set,
            upload: Buffer::new(device, "probe upload", input.bytes, Usage::Upload)?,
            readback: Buffer::new(device, "probe readback", output.bytes.max(film.bytes), Usage::Readback)?,
            input,
            output,
            film,
            _tables: table_buffers,
            _counters: counters,
            push,
            inputs: kernel.inputs,
            records: PhantomData,
        })
    }

    /// Runs the function over all inputs, in batches.
    pub fn run(&mut self, inputs: &[I]) -> Result<Vec<O>, CheckError> {
        let mut outputs = Vec::with_capacity(inputs.len());
        for batch in inputs.chunks(BATCH) {
            write(&mut self.upload, bytemuck::cast_slice(batch))?;
            let push = Push { end_slot: batch.len() as u32, ..self.push };
            let groups = (batch.len() as u32).div_ceil(self.inputs);
            let (bytes_in, bytes_out) = (size_of_val(batch), batch.len() * size_of::<O>());
            let (pipeline, set) = (&self.pipeline, &self.set);
            let (input, upload, output, readback) = (&self.input, &self.upload, &self.output, &self.readback);
            let ticket = self.timeline.submit(|r| {
                r.copy(upload, 0, input, 0, bytes_in as u64);
                r.barrier(Access::Transfer, Access::Compute);
                r.dispatch(pipeline, set, bytemuck::bytes_of(&push), [groups, 1, 1]);
                r.barrier(Access::Compute, Access::Transfer);
                r.copy(output, 0, readback, 0, bytes_out as u64);
                r.barrier(Access::Transfer, Access::Host);
            })?;
            self.timeline.wait(&ticket)?;
            let bytes = self.readback.mapped().ok_or(CheckError::Unmapped)?;
            if let Some(captures) = &self.context.0.captures {
                captures.buffer("push constants", bytemuck::bytes_of(&push));
                captures.buffer(&format!("binding {INPUT}, input"), bytemuck::cast_slice(batch));
                captures.buffer(&format!("binding {OUTPUT}, output of {groups} workgroups"), &bytes[..bytes_out]);
            }
            outputs.extend(bytes[..bytes_out].chunks_exact(size_of::<O>()).map(bytemuck::pod_read_unaligned::<O>));
        }
        Ok(outputs)
    }

    /// Uploads inputs, at most [`BATCH`], for [`Self::dispatch`].
    pub fn load(&mut self, inputs: &[I]) -> Result<(), CheckError> {
        write(&mut self.upload, bytemuck::cast_slice(inputs))?;
        let (upload, input, bytes) = (&self.upload, &self.input, size_of_val(inputs) as u64);
        let ticket = self.timeline.submit(|r| {
            r.copy(upload, 0, input, 0, bytes);
            r.barrier(Access::Transfer, Access::Compute);
        })?;
        self.timeline.wait(&ticket)?;
        Ok(())
    }

    /// Runs over the first `count` inputs that were loaded, with `any_hit` for the kernel to see. Returns the seconds
    /// that this took: on the device where that has timestamps, else until the host knew.
    pub fn dispatch(&mut self, count: usize, any_hit: bool) -> Result<f64, CheckError> {
        let push = Push { end_slot: count as u32, max_new_samples: u32::from(any_hit), ..self.push };
        let groups = (count as u32).div_ceil(self.inputs);
        let (pipeline, set) = (&self.pipeline, &self.set);
        let start = Instant::now();
        let ticket = self.timeline.submit(|r| {
            r.timed("probe", |r| r.dispatch(pipeline, set, bytemuck::bytes_of(&push), [groups, 1, 1]));
            r.barrier(Access::Compute, Access::Compute);
        })?;
        let stages = self.timeline.wait(&ticket)?;
        let wall = start.elapsed().as_secs_f64();
        Ok(stages.first().map_or(wall, |s| s.seconds))
    }

    /// The outputs of the last dispatch.
    pub fn read(&mut self, count: usize) -> Result<Vec<O>, CheckError> {
        let (output, readback, bytes) = (&self.output, &self.readback, count * size_of::<O>());
        let ticket = self.timeline.submit(|r| {
            r.barrier(Access::Compute, Access::Transfer);
            r.copy(output, 0, readback, 0, bytes as u64);
            r.barrier(Access::Transfer, Access::Host);
        })?;
        self.timeline.wait(&ticket)?;
        let mapped = self.readback.mapped().ok_or(CheckError::Unmapped)?;
        Ok(mapped[..bytes].chunks_exact(size_of::<O>()).map(bytemuck::pod_read_unaligned).collect())
    }

    /// Runs `dispatches` times over `slots` of the film, `samples` new ones a slot each time, and reads the film.
    pub fn accumulate(&mut self, slots: u32, samples: u32, dispatches: u32) -> Result<Vec<FilmSlot>, CheckError> {
        let push = Push { end_slot: slots, max_new_samples: samples, ..self.push };
        let groups = slots.div_ceil(self.inputs);
        // A few dispatches a submission: bounded, without a wait each.
        const TOGETHER: u32 = 16;
        let mut left = dispatches;
        while left > 0 {
            let now = left.min(TOGETHER);
            let (pipeline, set) = (&self.pipeline, &self.set);
            let ticket = self.timeline.submit(|r| {
                for _ in 0..now {
                    r.dispatch(pipeline, set, bytemuck::bytes_of(&push), [groups, 1, 1]);
                    r.barrier(Access::Compute, Access::Compute);
                }
            })?;
            self.timeline.wait(&ticket)?;
            left -= now;
        }
        let (film, readback) = (&self.film, &self.readback);
        let ticket = self.timeline.submit(|r| {
            r.barrier(Access::Compute, Access::Transfer);
            r.copy(film, 0, readback, 0, film.bytes);
            r.barrier(Access::Transfer, Access::Host);
        })?;
        self.timeline.wait(&ticket)?;
        let bytes = self.readback.mapped().ok_or(CheckError::Unmapped)?;
        let bytes = &bytes[..slots as usize * size_of::<FilmSlot>()];
        Ok(bytes.chunks_exact(size_of::<FilmSlot>()).map(bytemuck::pod_read_unaligned).collect())
    }
}

fn write(buffer: &mut Buffer, bytes: &[u8]) -> Result<(), CheckError> {
    let target = buffer.mapped_mut().ok_or(CheckError::Unmapped)?;
    target[..bytes.len()].copy_from_slice(bytes);
    Ok(())
}

/// Tables of a scene for a probe.
pub(crate) fn tables_of(scene: &Scene, settings: &RenderSettings) -> (RenderSpace, Tables) {
    let space = RenderSpace::of(scene);
    let tables = Tables::new(scene, &space, settings);
    (space, tables)
}
