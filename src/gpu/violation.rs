//! Deliberate violations: a watch that never speaks up is only worth something if it is known to be awake.

use ash::vk;

use crate::gpu::buffer::{Buffer, Usage};
use crate::gpu::device::Context;
use crate::gpu::error::{GpuError, check};

/// A rule that can be broken on purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Violation {
    /// A fill of a buffer that is not a copy's destination: for [`Validation::Core`](crate::gpu::Validation::Core).
    Usage,
    /// Two fills of a buffer without a barrier: for [`Validation::Synchronization`](crate::gpu::Validation::Synchronization).
    Hazard,
}

impl Context {
    /// Breaks a rule, in commands that are recorded and never submitted, so that no driver comes to harm. With the
    /// validation that the violation is for, a message appears in [`Context::messages`].
    ///
    /// # Errors
    /// A Vulkan call fails.
    pub fn violate(&self, violation: Violation) -> Result<(), GpuError> {
        let (device, usage, fills) = match violation {
            Violation::Usage => (&self.0, Usage::Upload, 1),
            Violation::Hazard => (&self.0, Usage::Storage, 2),
        };
        let buffer = Buffer::new(device, "deliberate violation", 64, usage)?;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(device.queue_family);
        // SAFETY: the queue family is the one that the device was made with.
        let pool = check("vkCreateCommandPool", unsafe { device.raw.create_command_pool(&info, None) })?;
        let result = record(&device.raw, pool, &buffer, fills);
        // SAFETY: the pool's only command buffer was never submitted.
        unsafe { device.raw.destroy_command_pool(pool, None) };
        result
    }
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
