//! Recording and submitting work: a ring of command buffers behind one timeline semaphore.

use std::sync::Arc;
use std::time::Duration;

use ash::vk;

use crate::gpu::acceleration_level::{Level, Unbuilt};
use crate::gpu::bindings::BindingSet;
use crate::gpu::buffer::Buffer;
use crate::gpu::device::{Device, WAIT_LIMIT};
use crate::gpu::error::{GpuError, check};
use crate::gpu::pipeline::Pipeline;

/// A named span of device time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageTime {
    /// What ran.
    pub stage: &'static str,
    /// Seconds on the device.
    pub seconds: f64,
}

/// The ring: `slots` command buffers in flight at most, submitted in order.
pub(crate) struct Timeline {
    slots: Vec<Slot>,
    semaphore: vk::Semaphore,
    pool: vk::CommandPool,
    submitted: u64,
    /// How long a wait may last.
    limit: Duration,
    device: Arc<Device>,
}

struct Slot {
    commands: vk::CommandBuffer,
    queries: vk::QueryPool,
    stages: Vec<&'static str>,
    /// Timeline value that says this slot's work is done; 0: never submitted.
    value: u64,
}

/// Timestamps that one submission can hold: a start and an end for each stage.
const STAGES: u32 = 64;

impl Timeline {
    /// Makes the ring.
    pub fn new(device: &Arc<Device>, slots: usize) -> Result<Self, GpuError> {
        let mut timeline = Self {
            slots: Vec::new(),
            semaphore: vk::Semaphore::null(),
            pool: vk::CommandPool::null(),
            submitted: 0,
            limit: WAIT_LIMIT,
            device: Arc::clone(device),
        };
        let raw = &device.raw;
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: live device with the timeline feature; `kind` outlives the call.
        timeline.semaphore = check("vkCreateSemaphore", unsafe { raw.create_semaphore(&info, None) })?;
        device.name(timeline.semaphore, "timeline");
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(device.queue_family)
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        // SAFETY: the queue family is the one that the device was made with.
        timeline.pool = check("vkCreateCommandPool", unsafe { raw.create_command_pool(&info, None) })?;
        let info =
            vk::CommandBufferAllocateInfo::default().command_pool(timeline.pool).command_buffer_count(slots as u32);
        // SAFETY: the pool was just made with this device, and no other thread uses it.
        let buffers = check("vkAllocateCommandBuffers", unsafe { raw.allocate_command_buffers(&info) })?;
        for (i, commands) in buffers.into_iter().enumerate() {
            device.name(commands, &format!("submission {i}"));
            let queries = if device.timestamps.is_some() {
                let info =
                    vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(2 * STAGES);
                // SAFETY: live device, whose queue has timestamps; the count is not 0.
                check("vkCreateQueryPool", unsafe { raw.create_query_pool(&info, None) })?
            } else {
                vk::QueryPool::null()
            };
            timeline.slots.push(Slot { commands, queries, stages: Vec::new(), value: 0 });
        }
        Ok(timeline)
    }

    /// Records with `record` and submits. Returns the ticket to wait for.
    ///
    /// Waits for the slot's previous submission, whose stage times are overwritten.
    pub fn submit(&mut self, record: impl FnOnce(&mut Recorder<'_>)) -> Result<Ticket, GpuError> {
        let index = (self.submitted % self.slots.len() as u64) as usize;
        let raw = self.device.raw.clone();
        let previous = self.slots[index].value;
        if previous > 0 {
            self.wait_value(previous)?;
        }
        let slot = &mut self.slots[index];
        slot.stages.clear();
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's last submission has finished, so its command buffer may be recorded anew.
        unsafe {
            check("vkBeginCommandBuffer", raw.begin_command_buffer(slot.commands, &begin))?;
            if slot.queries != vk::QueryPool::null() {
                raw.cmd_reset_query_pool(slot.commands, slot.queries, 0, 2 * STAGES);
            }
        }
        let mut recorder = Recorder { device: &self.device, slot };
        // The host wrote buffers before this submission; its memory operations are made visible by the submission.
        record(&mut recorder);
        let value = self.submitted + 1;
        let values = [value];
        let semaphores = [self.semaphore];
        let commands = [slot.commands];
        let mut timeline = vk::TimelineSemaphoreSubmitInfo::default().signal_semaphore_values(&values);
        let submit = [vk::SubmitInfo::default()
            .command_buffers(&commands)
            .signal_semaphores(&semaphores)
            .push_next(&mut timeline)];
        // SAFETY: recording is over; everything recorded outlives the submission, as owners wait before they drop.
        unsafe {
            check("vkEndCommandBuffer", raw.end_command_buffer(slot.commands))?;
            self.device.submit(&submit)?;
        }
        // Not before: nobody is to wait for what was not submitted.
        (self.submitted, slot.value) = (value, value);
        Ok(Ticket { slot: index, value })
    }

    /// Waits for a submission and returns its stage times.
    pub fn wait(&mut self, ticket: &Ticket) -> Result<Vec<StageTime>, GpuError> {
        self.wait_value(ticket.value)?;
        let slot = &self.slots[ticket.slot];
        let Some(timestamps) = &self.device.timestamps else { return Ok(Vec::new()) };
        if slot.value != ticket.value || slot.stages.is_empty() {
            return Ok(Vec::new());
        }
        let mut ticks = vec![0u64; 2 * slot.stages.len()];
        // SAFETY: the queries were written by the submission that has just finished.
        check("vkGetQueryPoolResults", unsafe {
            self.device.raw.get_query_pool_results(slot.queries, 0, &mut ticks, vk::QueryResultFlags::TYPE_64)
        })?;
        Ok(slot
            .stages
            .iter()
            .zip(ticks.chunks_exact(2))
            .map(|(&stage, t)| StageTime { stage, seconds: timestamps.seconds_between(t[0], t[1]) })
            .collect())
    }

    /// Waits for everything that was submitted.
    pub fn wait_all(&mut self) -> Result<(), GpuError> {
        if self.submitted > 0 { self.wait_value(self.submitted) } else { Ok(()) }
    }

    fn wait_value(&self, value: u64) -> Result<(), GpuError> {
        self.device.check_in_use()?;
        let semaphores = [self.semaphore];
        let values = [value];
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is alive, and `value` was submitted.
        let waited = unsafe { self.device.raw.wait_semaphores(&info, self.limit.as_nanos() as u64) };
        // A lost device works no more. Of any other failure it is not known whether it still does.
        if waited.is_err_and(|result| result != vk::Result::ERROR_DEVICE_LOST) {
            self.device.give_up();
        }
        match waited {
            Err(vk::Result::TIMEOUT) => Err(GpuError::Timeout { what: "a submission", limit: self.limit }),
            other => check("vkWaitSemaphores", other),
        }
    }
}

impl Drop for Timeline {
    fn drop(&mut self) {
        // Why it was given up has been told.
        if self.device.is_given_up() {
            return;
        }
        if let Err(error) = self.wait_all() {
            log::error!("{error}");
        }
        if self.device.is_given_up() {
            return;
        }
        let raw = &self.device.raw;
        // SAFETY: nothing is in flight any more.
        unsafe {
            for slot in &self.slots {
                raw.destroy_query_pool(slot.queries, None);
            }
            raw.destroy_command_pool(self.pool, None);
            raw.destroy_semaphore(self.semaphore, None);
        }
    }
}

/// Names a submission.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ticket {
    slot: usize,
    value: u64,
}

/// Records commands. Every barrier is asked for by the caller: none is hidden.
pub(crate) struct Recorder<'a> {
    device: &'a Device,
    slot: &'a mut Slot,
}

impl Recorder<'_> {
    /// Runs a pipeline over `groups` workgroups.
    pub fn dispatch(&mut self, pipeline: &Pipeline, set: &BindingSet, push: &[u8], groups: [u32; 3]) {
        let (raw, commands) = (&self.device.raw, self.slot.commands);
        // SAFETY: the pipeline was made with the set's layout; `push` has the layout's size; the counts are
        // within the limits that the plan checks.
        unsafe {
            pipeline.bind(commands);
            raw.cmd_bind_descriptor_sets(commands, vk::PipelineBindPoint::COMPUTE, set.layout.raw, 0, &[set.raw], &[]);
            if !push.is_empty() {
                raw.cmd_push_constants(commands, set.layout.raw, vk::ShaderStageFlags::COMPUTE, 0, push);
            }
            raw.cmd_dispatch(commands, groups[0], groups[1], groups[2]);
        }
    }

    /// Records what else there is, into the command buffer.
    pub(super) fn record(&mut self, record: impl FnOnce(vk::CommandBuffer)) {
        record(self.slot.commands);
    }

    /// Copies a level of an acceleration structure into as little memory as it needs.
    pub(super) fn compact(&mut self, from: &Level, to: &Level) {
        // SAFETY: who compacts waits for the submission, and keeps both until then.
        unsafe { from.record_compaction(self.slot.commands, to) };
    }

    /// Builds a level of an acceleration structure.
    pub(super) fn build(&mut self, level: &Unbuilt<'_>) {
        // SAFETY: who builds waits for the submission, and keeps until then what it reads and writes.
        unsafe { level.record(self.slot.commands) };
    }

    /// Copies bytes of `from` to `to`, from and to the given byte offsets.
    pub fn copy(&mut self, from: &Buffer, from_offset: u64, to: &Buffer, to_offset: u64, bytes: u64) {
        let region = [vk::BufferCopy { src_offset: from_offset, dst_offset: to_offset, size: bytes }];
        // SAFETY: both buffers are alive and hold the range.
        unsafe { self.device.raw.cmd_copy_buffer(self.slot.commands, from.raw, to.raw, &region) };
    }

    /// Fills a buffer with zeros.
    pub fn clear(&mut self, buffer: &Buffer) {
        // SAFETY: the buffer is alive and may be a copy's destination.
        unsafe { self.device.raw.cmd_fill_buffer(self.slot.commands, buffer.raw, 0, vk::WHOLE_SIZE, 0) };
    }

    /// Fills four bytes of a buffer with zeros, from a byte offset on that is a multiple of four.
    pub fn clear_word(&mut self, buffer: &Buffer, offset: u64) {
        // SAFETY: the buffer is alive, may be a copy's destination, and holds the word.
        unsafe { self.device.raw.cmd_fill_buffer(self.slot.commands, buffer.raw, offset, 4, 0) };
    }

    /// Everything before that `from` names happens before, and is visible to, everything after that `to` names.
    pub fn barrier(&mut self, from: Access, to: Access) {
        let (from_stage, from_access) = from.source();
        let (to_stage, to_access) = to.destination();
        let barrier = [vk::MemoryBarrier::default().src_access_mask(from_access).dst_access_mask(to_access)];
        // SAFETY: a global memory barrier names no objects.
        unsafe {
            self.device.raw.cmd_pipeline_barrier(
                self.slot.commands,
                from_stage,
                to_stage,
                vk::DependencyFlags::empty(),
                &barrier,
                &[],
                &[],
            );
        }
    }

    /// Runs `record` between two timestamps that are reported under `stage`.
    pub fn timed(&mut self, stage: &'static str, record: impl FnOnce(&mut Self)) {
        let first = 2 * self.slot.stages.len() as u32;
        let on = self.slot.queries != vk::QueryPool::null() && first + 1 < 2 * STAGES;
        let stamp = |this: &Self, pipeline_stage, query| {
            if on {
                // SAFETY: the query was reset at the start of this command buffer and is written once.
                unsafe {
                    this.device.raw.cmd_write_timestamp(this.slot.commands, pipeline_stage, this.slot.queries, query);
                }
            }
        };
        if on {
            self.slot.stages.push(stage);
        }
        stamp(self, vk::PipelineStageFlags::TOP_OF_PIPE, first);
        record(self);
        stamp(self, vk::PipelineStageFlags::COMPUTE_SHADER, first + 1);
    }
}

/// One side of a barrier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    /// Compute shaders.
    Compute,
    /// Copies and fills.
    Transfer,
    /// Builds and copies of acceleration structures, and reading what they need.
    Build,
    /// Acceleration structures in compute shaders.
    RayQuery,
    /// Reads and writes of mapped memory by the host, after the submission. (What it wrote before needs no barrier: to submit makes
    /// that visible.)
    Host,
}

impl Access {
    /// What happens before a barrier: writes only, since reads leave nothing to be made visible.
    fn source(self) -> (vk::PipelineStageFlags, vk::AccessFlags) {
        let (stage, _, writes) = self.masks();
        (stage, writes)
    }

    /// What happens after it.
    fn destination(self) -> (vk::PipelineStageFlags, vk::AccessFlags) {
        let (stage, reads, writes) = self.masks();
        (stage, reads | writes)
    }

    /// Where it happens, reads and writes.
    fn masks(self) -> (vk::PipelineStageFlags, vk::AccessFlags, vk::AccessFlags) {
        use vk::{AccessFlags as A, PipelineStageFlags as Stage};
        match self {
            Self::Compute => (Stage::COMPUTE_SHADER, A::SHADER_READ | A::UNIFORM_READ, A::SHADER_WRITE),
            Self::Transfer => (Stage::TRANSFER, A::TRANSFER_READ, A::TRANSFER_WRITE),
            Self::Build => (
                Stage::ACCELERATION_STRUCTURE_BUILD_KHR,
                A::ACCELERATION_STRUCTURE_READ_KHR,
                A::ACCELERATION_STRUCTURE_WRITE_KHR,
            ),
            Self::RayQuery => (Stage::COMPUTE_SHADER, A::ACCELERATION_STRUCTURE_READ_KHR, A::empty()),
            Self::Host => (Stage::HOST, A::HOST_READ, A::HOST_WRITE),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;
    use crate::gpu::buffer::Usage;
    use crate::gpu::device::{Context, ContextOptions};

    fn context() -> Context {
        Context::new(&ContextOptions::default()).expect("a Vulkan device")
    }

    #[test]
    fn the_host_may_write_where_it_may_read() {
        let host = vk::AccessFlags::HOST_READ | vk::AccessFlags::HOST_WRITE;
        assert_eq!(Access::Host.destination(), (vk::PipelineStageFlags::HOST, host));
        assert_eq!(Access::Transfer.source(), (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_WRITE));
    }

    /// What nobody has submitted is never done.
    #[test]
    fn who_has_waited_in_vain_neither_waits_nor_destroys() {
        let context = context();
        let device = &context.0;
        let mut timeline = Timeline::new(device, 2).expect("a timeline");
        let buffer = Buffer::new(device, "left", 1 << 20, Usage::Storage).expect("a buffer");
        let done = timeline.submit(|r| r.clear(&buffer)).expect("a submission");
        timeline.wait(&done).expect("work that ends");
        timeline.limit = Duration::from_millis(1);
        let never = Ticket { slot: 1, value: 2 };
        assert!(matches!(timeline.wait(&never), Err(GpuError::Timeout { .. })));
        assert!(device.is_given_up());

        // From now on for anybody, and at once.
        timeline.limit = WAIT_LIMIT;
        let start = Instant::now();
        let mut other = Timeline::new(device, 1).expect("a timeline");
        for timeline in [&mut timeline, &mut other] {
            assert!(matches!(timeline.wait(&never), Err(GpuError::Timeout { .. })));
            let submitted = timeline.submitted;
            assert!(matches!(timeline.submit(|r| r.clear(&buffer)), Err(GpuError::Timeout { .. })));
            // Of what was not submitted nothing is left to wait for.
            assert_eq!(timeline.submitted, submitted);
            assert!(timeline.slots.iter().all(|slot| slot.value <= submitted));
        }
        let (bytes, _) = context.memory();
        drop((buffer, timeline, other));
        assert!(start.elapsed() < Duration::from_secs(60), "it was waited for");
        assert_eq!(context.memory().0, bytes, "memory that may be in use was taken back");
        let last = Arc::downgrade(device);
        drop(context);
        assert!(last.upgrade().is_some(), "the device was destroyed");
    }
}
