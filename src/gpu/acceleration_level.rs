//! One level of an acceleration structure, and its build.

use std::sync::Arc;

use ash::{khr, vk};

use crate::gpu::buffer::{Buffer, Usage};
use crate::gpu::device::Device;
use crate::gpu::error::{GpuError, check};

pub(super) const BOTTOM: vk::AccelerationStructureTypeKHR = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
pub(super) const TOP: vk::AccelerationStructureTypeKHR = vk::AccelerationStructureTypeKHR::TOP_LEVEL;

/// How to build.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BuildOptions {
    /// Bottom levels are copied into as little memory as they need.
    pub compact: bool,
    /// Tests only: scratch memory begins at an address that is no more aligned than it has to be.
    pub shift_scratch: bool,
}

/// One level, with its memory.
pub(crate) struct Level {
    pub(super) raw: vk::AccelerationStructureKHR,
    calls: khr::acceleration_structure::Device,
    _storage: Buffer,
    device: Arc<Device>,
}

impl Level {
    /// Memory for one, which is not built yet.
    pub(super) fn new(
        device: &Arc<Device>,
        name: &str,
        kind: vk::AccelerationStructureTypeKHR,
        bytes: u64,
    ) -> Result<Self, GpuError> {
        let calls = device.ray_queries()?.calls.clone();
        let storage = Buffer::new(device, name, bytes, Usage::AccelerationStructure)?;
        let info = vk::AccelerationStructureCreateInfoKHR::default().buffer(storage.raw).size(bytes).ty(kind);
        // SAFETY: the buffer was made for it, and has the size.
        let created = unsafe { calls.create_acceleration_structure(&info, None) };
        let raw = check("vkCreateAccelerationStructureKHR", created)?;
        device.name(raw, name);
        Ok(Self { raw, calls, _storage: storage, device: Arc::clone(device) })
    }

    /// Records a copy of it into another that is as large as it has to be.
    ///
    /// # Safety
    /// The command buffer is being recorded; it was built to be compacted; both live until it has been executed.
    pub(super) unsafe fn record_compaction(&self, commands: vk::CommandBuffer, to: &Self) {
        let info = vk::CopyAccelerationStructureInfoKHR::default()
            .src(self.raw)
            .dst(to.raw)
            .mode(vk::CopyAccelerationStructureModeKHR::COMPACT);
        // SAFETY: the caller's.
        unsafe { self.calls.cmd_copy_acceleration_structure(commands, &info) };
    }

    /// Where it is on the device.
    pub(super) fn address(&self) -> u64 {
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(self.raw);
        // SAFETY: it is alive.
        unsafe { self.calls.get_acceleration_structure_device_address(&info) }
    }
}

impl Drop for Level {
    fn drop(&mut self) {
        if !self.device.is_given_up() {
            // SAFETY: owners wait for the device first.
            unsafe { self.calls.destroy_acceleration_structure(self.raw, None) };
        }
    }
}

/// One level that is to be built of a geometry of so many primitives, and the memory for that.
pub(super) struct Unbuilt<'a> {
    pub level: Level,
    kind: vk::AccelerationStructureTypeKHR,
    geometry: [vk::AccelerationStructureGeometryKHR<'a>; 1],
    count: u32,
    flags: vk::BuildAccelerationStructureFlagsKHR,
    _scratch: Buffer,
    /// Where it may begin.
    scratch_address: u64,
}

impl<'a> Unbuilt<'a> {
    /// Finds out how large it is, and allocates that.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        kind: vk::AccelerationStructureTypeKHR,
        geometry: vk::AccelerationStructureGeometryKHR<'a>,
        count: u32,
        options: BuildOptions,
    ) -> Result<Self, GpuError> {
        let queries = device.ray_queries()?;
        let (calls, geometry) = (&queries.calls, [geometry]);
        let mut flags = vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE;
        if options.compact && kind == BOTTOM {
            flags |= vk::BuildAccelerationStructureFlagsKHR::ALLOW_COMPACTION;
        }
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: the geometry lives for the call, and one count belongs to it.
        unsafe {
            calls.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &build_info(kind, &geometry, flags),
                &[count],
                &mut sizes,
            );
        }
        let level = Level::new(device, name, kind, sizes.acceleration_structure_size)?;
        let alignment = queries.limits.scratch_alignment;
        let shift = if options.shift_scratch { alignment } else { 0 };
        // The address is rounded up.
        let scratch_bytes = sizes.build_scratch_size + alignment - 1 + shift;
        let scratch = Buffer::new(device, "scratch memory of a build", scratch_bytes, Usage::Scratch)?;
        let mut scratch_address = scratch.address().next_multiple_of(alignment);
        if options.shift_scratch && scratch_address.is_multiple_of(2 * alignment) {
            scratch_address += alignment;
        }
        Ok(Self { level, kind, geometry, count, flags, _scratch: scratch, scratch_address })
    }

    /// Records the build.
    ///
    /// # Safety
    /// The command buffer is being recorded; what the geometry reads, and this, live until it has been executed.
    pub unsafe fn record(&self, commands: vk::CommandBuffer) {
        let info = build_info(self.kind, &self.geometry, self.flags)
            .dst_acceleration_structure(self.level.raw)
            .scratch_data(vk::DeviceOrHostAddressKHR { device_address: self.scratch_address });
        let range = [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(self.count)];
        // SAFETY: the caller's; sizes are those that were asked for.
        unsafe { self.level.calls.cmd_build_acceleration_structures(commands, &[info], &[&range]) };
    }
}

fn build_info<'a>(
    kind: vk::AccelerationStructureTypeKHR,
    geometry: &'a [vk::AccelerationStructureGeometryKHR<'a>],
    flags: vk::BuildAccelerationStructureFlagsKHR,
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(kind)
        .flags(flags)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(geometry)
}
