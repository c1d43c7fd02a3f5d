//! Acceleration structures of the device, over boxes.

use std::slice;
use std::sync::Arc;

use ash::vk;

use crate::gpu::acceleration_level::{BOTTOM, Level, TOP, Unbuilt};
use crate::gpu::buffer::{Buffer, Usage};
use crate::gpu::device::Device;
use crate::gpu::error::GpuError;
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
    pub fn top(&self) -> &Level {
        &self.top
    }
}

/// A buffer that a build reads.
fn input(device: &Arc<Device>, name: &str, bytes: &[u8]) -> Result<Buffer, GpuError> {
    let mut buffer = Buffer::new(device, name, bytes.len() as u64, Usage::BuildInput)?;
    let unmapped = || GpuError::OutOfMemory { what: name.to_owned(), reason: "it is not mapped".to_owned() };
    buffer.mapped_mut().ok_or_else(unmapped)?[..bytes.len()].copy_from_slice(bytes);
    Ok(buffer)
}
