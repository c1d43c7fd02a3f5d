//! Acceleration structures in as little memory as they need: how much that is, is known when they have been built.

use std::sync::Arc;

use ash::vk;

use crate::gpu::acceleration_level::{BOTTOM, Level};
use crate::gpu::device::Device;
use crate::gpu::error::{GpuError, check};
use crate::gpu::submit::{Access, Timeline};

/// Copies of bottom levels that were built to be compacted. The originals are gone then.
pub(super) fn compacted(
    device: &Arc<Device>,
    timeline: &mut Timeline,
    levels: Vec<Level>,
) -> Result<Vec<Level>, GpuError> {
    let sizes = compacted_sizes(device, timeline, &levels)?;
    let small = sizes.iter().map(|&bytes| Level::new(device, "compacted", BOTTOM, bytes));
    let small = small.collect::<Result<Vec<_>, _>>()?;
    let ticket = timeline.submit(|r| {
        levels.iter().zip(&small).for_each(|(from, to)| r.compact(from, to));
        r.barrier(Access::Build, Access::Build);
    })?;
    timeline.wait(&ticket)?;
    Ok(small)
}

/// The bytes that they need.
fn compacted_sizes(device: &Arc<Device>, timeline: &mut Timeline, levels: &[Level]) -> Result<Vec<u64>, GpuError> {
    let (raw, calls) = (&device.raw, &device.ray_queries()?.calls);
    let kind = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
    let info = vk::QueryPoolCreateInfo::default().query_type(kind).query_count(levels.len() as u32);
    // SAFETY: live device with the extension; the count is not 0.
    let pool = check("vkCreateQueryPool", unsafe { raw.create_query_pool(&info, None) })?;
    let structures: Vec<_> = levels.iter().map(|level| level.raw).collect();
    let mut sizes = vec![0u64; levels.len()];
    let submitted = timeline.submit(|r| {
        // SAFETY: the levels were built; the pool has a query for each, which is reset and then written once.
        r.record(|commands| unsafe {
            raw.cmd_reset_query_pool(commands, pool, 0, structures.len() as u32);
            calls.cmd_write_acceleration_structures_properties(commands, &structures, kind, pool, 0);
        });
    });
    let result = submitted.and_then(|ticket| {
        timeline.wait(&ticket)?;
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the queries were written by the submission that has just finished.
        check("vkGetQueryPoolResults", unsafe { raw.get_query_pool_results(pool, 0, &mut sizes, flags) })
    });
    if !device.is_given_up() {
        // SAFETY: nothing that uses it is in flight.
        unsafe { raw.destroy_query_pool(pool, None) };
    }
    result.map(|()| sizes)
}
