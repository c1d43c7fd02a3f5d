//! Kernels of words in and words out (shaders/execution), which need nothing of a scene.

use crate::check::CheckError;
use crate::gpu::{
    AccelerationStructure, Access, BindingKind, BindingLayout, BindingSet, Buffer, Context, Pipeline, Resource,
    Specialization, Timeline, Usage,
};

const GIVEN: u32 = 0;
const FOUND: u32 = 1;
const STRUCTURE: u32 = 2;
const BINDINGS: [(u32, BindingKind); 2] = [(GIVEN, BindingKind::Array), (FOUND, BindingKind::Array)];

/// Ids of constants that all of them have (shaders/execution/io.glsl).
pub(crate) const WORKGROUP: u32 = 1;
pub(crate) const FUNCTION: u32 = 2;

/// A kernel with its buffers.
pub(crate) struct PlainKernel {
    context: Context,
    // Dropped before what it uses.
    pub timeline: Timeline,
    pub pipeline: Pipeline,
    pub set: BindingSet,
    given: Buffer,
    pub found: Buffer,
    upload: Buffer,
    pub readback: Buffer,
}

impl PlainKernel {
    /// Specialises the kernel, for so many words in and out, with so many submissions in flight.
    pub fn new(
        context: &Context,
        name: &str,
        spirv: &[u8],
        specialization: &Specialization,
        [given, found]: [usize; 2],
        in_flight: usize,
    ) -> Result<Self, CheckError> {
        Self::with(context, name, spirv, specialization, [given, found], in_flight, None)
    }

    /// The same, with an acceleration structure, which has to outlive it.
    pub fn with(
        context: &Context,
        name: &str,
        spirv: &[u8],
        specialization: &Specialization,
        [given, found]: [usize; 2],
        in_flight: usize,
        structure: Option<&AccelerationStructure>,
    ) -> Result<Self, CheckError> {
        let device = &context.0;
        let of_structure = structure.map(|_| (STRUCTURE, BindingKind::AccelerationStructure));
        let bindings: Vec<_> = BINDINGS.into_iter().chain(of_structure).collect();
        let layout = BindingLayout::new(device, &bindings, 8)?;
        let storage = |name, words: usize| Buffer::new(device, name, 4 * words as u64, Usage::Storage);
        let (given, found) = (storage("given", given)?, storage("found", found)?);
        let mut resources = vec![(GIVEN, Resource::Buffer(&given)), (FOUND, Resource::Buffer(&found))];
        resources.extend(structure.map(|of| (STRUCTURE, Resource::AccelerationStructure(of.top()))));
        let set = BindingSet::new(&layout, &resources)?;
        Ok(Self {
            context: context.clone(),
            timeline: Timeline::new(device, in_flight)?,
            pipeline: Pipeline::new(device, name, spirv, specialization, &layout)?,
            set,
            upload: Buffer::new(device, "upload", given.bytes, Usage::Upload)?,
            readback: Buffer::new(device, "readback", found.bytes, Usage::Readback)?,
            given,
            found,
        })
    }

    /// Uploads words, and clears those that are to be found.
    pub fn load(&mut self, words: &[u32]) -> Result<(), CheckError> {
        let bytes: &[u8] = bytemuck::cast_slice(words);
        if let Some(captures) = &self.context.0.captures {
            captures.buffer("binding 0, given", bytes);
        }
        let target = self.upload.mapped_mut().ok_or(CheckError::Unmapped)?;
        target[..bytes.len()].copy_from_slice(bytes);
        let (upload, given, found) = (&self.upload, &self.given, &self.found);
        let ticket = self.timeline.submit(|r| {
            r.copy(upload, 0, given, 0, bytes.len() as u64);
            r.clear(found);
            r.barrier(Access::Transfer, Access::Compute);
        })?;
        self.timeline.wait(&ticket)?;
        Ok(())
    }

    /// Runs it once, in so many workgroups, over words, and returns the first `count` of those that it has found.
    pub fn run(&mut self, words: &[u32], push: [u32; 2], groups: u32, count: usize) -> Result<Vec<u32>, CheckError> {
        self.load(words)?;
        let Self { pipeline, set, found, readback, .. } = self;
        let ticket = self.timeline.submit(|r| {
            r.dispatch(pipeline, set, bytemuck::bytes_of(&push), [groups, 1, 1]);
            r.barrier(Access::Compute, Access::Transfer);
            r.copy(found, 0, readback, 0, found.bytes);
            r.barrier(Access::Transfer, Access::Host);
        })?;
        self.timeline.wait(&ticket)?;
        let found = self.read(count)?;
        if let Some(captures) = &self.context.0.captures {
            captures.buffer("push constants", bytemuck::bytes_of(&push));
            captures.buffer(&format!("binding 1, found by {groups} workgroups"), bytemuck::cast_slice(&found));
        }
        Ok(found)
    }

    /// The first words of what was read back.
    pub fn read(&self, count: usize) -> Result<Vec<u32>, CheckError> {
        let bytes = self.readback.mapped().ok_or(CheckError::Unmapped)?;
        Ok(bytes[..4 * count].chunks_exact(4).map(bytemuck::pod_read_unaligned).collect())
    }
}

/// Sizes of workgroups that a device allows, of those that are worth a trial.
pub(crate) fn workgroups(context: &Context) -> impl Iterator<Item = u32> {
    let limits = &context.0.limits;
    let most = limits.max_compute_work_group_invocations.min(limits.max_compute_work_group_size[0]);
    [1, 3, 8, 32, 33, 64, 100, 128, 256].into_iter().filter(move |size| *size <= most)
}
