//! One level of an acceleration structure, and its build.

use std::sync::Arc;

use ash::{khr, vk};

use crate::gpu::buffer::{Buffer, Usage};
use crate::gpu::device::Device;
use crate::gpu::error::{GpuError, check};

pub(super) const BOTTOM: vk::AccelerationStructureTypeKHR = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
pub(super) const TOP: vk::AccelerationStructureTypeKHR = vk::AccelerationStructureTypeKHR::TOP_LEVEL;

/// One level, with its memory.
pub(crate) struct Level {
    pub(super) raw: vk::AccelerationStructureKHR,
    calls: khr::acceleration_structure::Device,
    _storage: Buffer,
    device: Arc<Device>,
}

impl Level {
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
    scratch: Buffer,
    scratch_alignment: u64,
}

impl<'a> Unbuilt<'a> {
    /// Finds out how large it is, and allocates that.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        kind: vk::AccelerationStructureTypeKHR,
        geometry: vk::AccelerationStructureGeometryKHR<'a>,
        count: u32,
    ) -> Result<Self, GpuError> {
        let queries = device.ray_queries()?;
        let (calls, geometry) = (queries.calls.clone(), [geometry]);
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: the geometry lives for the call, and one count belongs to it.
        unsafe {
            calls.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &build_info(kind, &geometry),
                &[count],
                &mut sizes,
            );
        }
        let storage = Buffer::new(device, name, sizes.acceleration_structure_size, Usage::AccelerationStructure)?;
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(storage.raw)
            .size(sizes.acceleration_structure_size)
            .ty(kind);
        // SAFETY: the buffer was made for it, and has the size.
        let created = unsafe { calls.create_acceleration_structure(&info, None) };
        let raw = check("vkCreateAccelerationStructureKHR", created)?;
        let level = Level { raw, calls, _storage: storage, device: Arc::clone(device) };
        device.name(raw, name);
        let scratch_alignment = queries.limits.scratch_alignment;
        // The address is rounded up.
        let scratch_bytes = sizes.build_scratch_size + scratch_alignment - 1;
        let scratch = Buffer::new(device, "scratch memory of a build", scratch_bytes, Usage::Scratch)?;
        Ok(Self { level, kind, geometry, count, scratch, scratch_alignment })
    }

    /// Records the build.
    ///
    /// # Safety
    /// The command buffer is being recorded; what the geometry reads, and this, live until it has been executed.
    pub unsafe fn record(&self, commands: vk::CommandBuffer) {
        let scratch = self.scratch.address().next_multiple_of(self.scratch_alignment);
        let info = build_info(self.kind, &self.geometry)
            .dst_acceleration_structure(self.level.raw)
            .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch });
        let range = [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(self.count)];
        // SAFETY: the caller's; sizes are those that were asked for.
        unsafe { self.level.calls.cmd_build_acceleration_structures(commands, &[info], &[&range]) };
    }
}

fn build_info<'a>(
    kind: vk::AccelerationStructureTypeKHR,
    geometry: &'a [vk::AccelerationStructureGeometryKHR<'a>],
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(kind)
        .flags(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(geometry)
}
