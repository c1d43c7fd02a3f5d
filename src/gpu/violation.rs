//! Deliberate violations: a watch that never speaks up is only worth something if it is known to be awake.

use std::sync::Arc;

use ash::vk;

use crate::gpu::acceleration_level::BuildOptions;
use crate::gpu::acceleration_structure::{AccelerationStructure, Instance, Part, Shapes};
use crate::gpu::bindings::{BindingLayout, BindingSet, Resource};
use crate::gpu::buffer::{Buffer, Usage};
use crate::gpu::device::{Context, Device};
use crate::gpu::error::{GpuError, check};
use crate::gpu::kept_layout::BindingKind;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::specialization::Specialization;
use crate::gpu::submit::Timeline;

const SPIRV: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/violation.spv"));
/// Of objects that break rules.
const NAME: &str = "deliberate violation";

/// A rule that can be broken on purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Violation {
    /// A fill of a buffer that is not a copy's destination: for [`Validation::Core`](crate::gpu::Validation::Core).
    Usage,
    /// Two fills of a buffer without a barrier: for [`Validation::Synchronization`](crate::gpu::Validation::Synchronization).
    Hazard,
    /// A ray query that begins behind the start of its ray: for [`Validation::GpuAssisted`](crate::gpu::Validation::GpuAssisted).
    RayQuery,
}

impl Context {
    /// Breaks a rule. With the validation that the violation is for, a message appears in [`Context::messages`].
    ///
    /// # Errors
    /// The device was not opened for ray queries, if there is to be one; a Vulkan call fails.
    pub fn violate(&self, violation: Violation) -> Result<(), GpuError> {
        match violation {
            Violation::Usage => fill(&self.0, Usage::Upload, 1),
            Violation::Hazard => fill(&self.0, Usage::Storage, 2),
            Violation::RayQuery => query(&self.0),
        }
    }
}

/// Fills a buffer, in commands that are recorded and never submitted, so that no driver comes to harm.
fn fill(device: &Arc<Device>, usage: Usage, fills: usize) -> Result<(), GpuError> {
    let buffer = Buffer::new(device, NAME, 64, usage)?;
    let info = vk::CommandPoolCreateInfo::default().queue_family_index(device.queue_family);
    // SAFETY: the queue family is the one that the device was made with.
    let pool = check("vkCreateCommandPool", unsafe { device.raw.create_command_pool(&info, None) })?;
    let result = record(&device.raw, pool, &buffer, fills);
    // SAFETY: the pool's only command buffer was never submitted.
    unsafe { device.raw.destroy_command_pool(pool, None) };
    result
}

/// Asks a ray query that Vulkan forbids of a box that the ray misses. It is asked indeed: only then does validation on the device see it.
fn query(device: &Arc<Device>) -> Result<(), GpuError> {
    let mut timeline = Timeline::new(device, 1)?;
    let one = [Part { shapes: Shapes::Boxes(&[[[5.0; 3], [6.0; 3]]]), opaque: false }];
    let options = BuildOptions::default();
    let structure = AccelerationStructure::new(device, &mut timeline, &one, &[Instance::of(0, 0)], options)?;
    let found = Buffer::new(device, NAME, 16, Usage::Storage)?;
    let bindings = [(0, BindingKind::AccelerationStructure), (1, BindingKind::Array)];
    let layout = BindingLayout::new(device, &bindings, 4)?;
    let resources = [(0, Resource::AccelerationStructure(structure.top())), (1, Resource::Buffer(&found))];
    let set = BindingSet::new(&layout, &resources)?;
    let pipeline = Pipeline::new(device, NAME, SPIRV, &Specialization::default(), &layout)?;
    let ticket = timeline.submit(|r| r.dispatch(&pipeline, &set, &(-1f32).to_le_bytes(), [1, 1, 1]))?;
    timeline.wait(&ticket)?;
    Ok(())
}

fn record(raw: &ash::Device, pool: vk::CommandPool, buffer: &Buffer, fills: usize) -> Result<(), GpuError> {
    let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
    // SAFETY: the pool is alive, and no other thread uses it.
    let commands = check("vkAllocateCommandBuffers", unsafe { raw.allocate_command_buffers(&info) })?[0];
    // SAFETY: a new command buffer. The fills break a rule, which is their purpose, but never run.
    unsafe {
        check("vkBeginCommandBuffer", raw.begin_command_buffer(commands, &vk::CommandBufferBeginInfo::default()))?;
        for _ in 0..fills {
            raw.cmd_fill_buffer(commands, buffer.raw, 0, vk::WHOLE_SIZE, 0);
        }
        check("vkEndCommandBuffer", raw.end_command_buffer(commands))
    }
}
