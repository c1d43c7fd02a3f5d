//! Acceleration structures of the device, over boxes.

use std::slice;
use std::sync::Arc;

use ash::{khr, vk};

use crate::gpu::buffer::{Buffer, Usage};
use crate::gpu::device::Device;
use crate::gpu::error::{GpuError, check};
use crate::gpu::submit::{Access, Timeline};

/// Lowest and highest corner, as Vulkan has them.
type BoxCorners = [[f32; 3]; 2];
const _: () = assert!(size_of::<BoxCorners>() == size_of::<vk::AabbPositionsKHR>());

/// Of the instance (shaders/lib/intersect/query.glsl).
const MASK: u8 = 1;

/// Boxes for ray queries, which name them by their numbers.
pub(crate) struct AccelerationStructure {
    top: Level,
    _boxes: Level,
}

impl AccelerationStructure {
    /// Builds one over at least one box.
    ///
    /// # Errors
    /// The device was not opened for ray queries; there are too many boxes, or is too little memory; a Vulkan call fails.
    pub fn new(device: &Arc<Device>, timeline: &mut Timeline, boxes: &[BoxCorners]) -> Result<Self, GpuError> {
        let limit = device.ray_queries()?.limits.max_boxes;
        if boxes.len() as u64 > limit {
            let (count, device) = (boxes.len() as u64, device.info.name.clone());
            return Err(GpuError::TooManyBoxes { count, limit, device });
        }
        let input = input(device, "boxes", bytemuck::cast_slice(boxes))?;
        let aabbs = vk::AccelerationStructureGeometryAabbsDataKHR::default()
            .data(vk::DeviceOrHostAddressConstKHR { device_address: input.address() })
            .stride(size_of::<BoxCorners>() as u64);
        let geometry = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::AABBS)
            .geometry(vk::AccelerationStructureGeometryDataKHR { aabbs });
        let bottom = Unbuilt::new(device, "leaf boxes", BOTTOM, geometry, boxes.len() as u32)?;

        let instance = vk::AccelerationStructureInstanceKHR {
            transform: vk::TransformMatrixKHR { matrix: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0] },
            instance_custom_index_and_mask: vk::Packed24_8::new(0, MASK),
            instance_shader_binding_table_record_offset_and_flags: vk::Packed24_8::new(0, 0),
            acceleration_structure_reference: vk::AccelerationStructureReferenceKHR {
                device_handle: bottom.level.address(),
            },
        };
        // SAFETY: plain numbers without gaps, by their definition in the specification.
        let bytes = unsafe {
            slice::from_raw_parts((&raw const instance).cast::<u8>(), size_of::<vk::AccelerationStructureInstanceKHR>())
        };
        let instances_input = self::input(device, "instances", bytes)?;
        let instances = vk::AccelerationStructureGeometryInstancesDataKHR::default()
            .data(vk::DeviceOrHostAddressConstKHR { device_address: instances_input.address() });
        let geometry = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(vk::AccelerationStructureGeometryDataKHR { instances });
        let top = Unbuilt::new(device, "instances of leaf boxes", TOP, geometry, 1)?;

        let ticket = timeline.submit(|r| {
            r.build(&bottom);
            r.barrier(Access::Build, Access::Build);
            r.build(&top);
            r.barrier(Access::Build, Access::RayQuery);
        })?;
        timeline.wait(&ticket)?;
        Ok(Self { top: top.level, _boxes: bottom.level })
    }

    /// What shaders see.
    pub(super) fn raw(&self) -> vk::AccelerationStructureKHR {
        self.top.raw
    }
}

const BOTTOM: vk::AccelerationStructureTypeKHR = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
const TOP: vk::AccelerationStructureTypeKHR = vk::AccelerationStructureTypeKHR::TOP_LEVEL;

/// A buffer that a build reads.
fn input(device: &Arc<Device>, name: &str, bytes: &[u8]) -> Result<Buffer, GpuError> {
    let mut buffer = Buffer::new(device, name, bytes.len() as u64, Usage::BuildInput)?;
    let unmapped = || GpuError::OutOfMemory { what: name.to_owned(), reason: "it is not mapped".to_owned() };
    buffer.mapped_mut().ok_or_else(unmapped)?[..bytes.len()].copy_from_slice(bytes);
    Ok(buffer)
}

/// One level, with its memory.
struct Level {
    raw: vk::AccelerationStructureKHR,
    calls: khr::acceleration_structure::Device,
    _storage: Buffer,
    device: Arc<Device>,
}

impl Level {
    fn address(&self) -> u64 {
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
    level: Level,
    kind: vk::AccelerationStructureTypeKHR,
    geometry: [vk::AccelerationStructureGeometryKHR<'a>; 1],
    count: u32,
    scratch: Buffer,
    scratch_alignment: u64,
}

impl<'a> Unbuilt<'a> {
    fn new(
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
