//! Acceleration structures of the device, over boxes and triangles.

use std::slice;
use std::sync::Arc;

use ash::vk;

use crate::gpu::acceleration_level::{BOTTOM, BuildOptions, Level, TOP, Unbuilt};
use crate::gpu::buffer::{Buffer, Usage};
use crate::gpu::compaction::compacted;
use crate::gpu::device::Device;
use crate::gpu::error::GpuError;
use crate::gpu::submit::{Access, Timeline};

/// Lowest and highest corner.
type BoxCorners = [[f32; 3]; 2];
const _: () = assert!(size_of::<BoxCorners>() == size_of::<vk::AabbPositionsKHR>());
/// Corners.
type TriangleCorners = [[f32; 3]; 3];

/// What a bottom level is made of.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Shapes<'a> {
    Boxes(&'a [BoxCorners]),
    Triangles(&'a [TriangleCorners]),
}

impl Shapes<'_> {
    fn name(self) -> &'static str {
        match self {
            Self::Boxes(_) => "boxes",
            Self::Triangles(_) => "triangles",
        }
    }

    fn count(self) -> usize {
        match self {
            Self::Boxes(boxes) => boxes.len(),
            Self::Triangles(triangles) => triangles.len(),
        }
    }

    fn bytes(&self) -> &[u8] {
        match self {
            Self::Boxes(boxes) => bytemuck::cast_slice(boxes),
            Self::Triangles(triangles) => bytemuck::cast_slice(triangles),
        }
    }

    /// As the build reads them.
    fn geometry(self, input: &Buffer, opaque: bool) -> vk::AccelerationStructureGeometryKHR<'static> {
        let data = vk::DeviceOrHostAddressConstKHR { device_address: input.address() };
        let (kind, geometry) = match self {
            Self::Boxes(_) => {
                let aabbs =
                    vk::AccelerationStructureGeometryAabbsDataKHR::default()
                        .data(data)
                        .stride(size_of::<BoxCorners>() as u64);
                (vk::GeometryTypeKHR::AABBS, vk::AccelerationStructureGeometryDataKHR { aabbs })
            }
            Self::Triangles(all) => {
                let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
                    .vertex_format(vk::Format::R32G32B32_SFLOAT)
                    .vertex_data(data)
                    .vertex_stride(size_of::<[f32; 3]>() as u64)
                    .max_vertex(3 * all.len() as u32 - 1)
                    .index_type(vk::IndexType::NONE_KHR);
                (vk::GeometryTypeKHR::TRIANGLES, vk::AccelerationStructureGeometryDataKHR { triangles })
            }
        };
        let flags = match opaque {
            true => vk::GeometryFlagsKHR::OPAQUE,
            false => vk::GeometryFlagsKHR::NO_DUPLICATE_ANY_HIT_INVOCATION,
        };
        vk::AccelerationStructureGeometryKHR::default().geometry_type(kind).geometry(geometry).flags(flags)
    }
}

/// A bottom level: at least one shape.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part<'a> {
    pub shapes: Shapes<'a>,
    /// They stop all rays that meet them; else shaders are asked, once for each.
    pub opaque: bool,
}

/// A bottom level, somewhere.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instance {
    /// Which.
    pub part: usize,
    /// By how much it is moved.
    pub offset: [f32; 3],
    /// What shaders are told, 24 bits.
    pub index: u32,
    /// Rays with no bit of this pass.
    pub mask: u8,
    pub flags: vk::GeometryInstanceFlagsKHR,
}

impl Instance {
    /// An index has 24 bits.
    const MAX_INDEX: u32 = (1 << 24) - 1;
    /// What rays ask for (shaders/lib/intersect/query.glsl).
    const MASK: u8 = 1;

    /// A part as it is.
    pub fn of(part: usize, index: u32) -> Self {
        Self { part, offset: [0.0; 3], index, mask: Self::MASK, flags: vk::GeometryInstanceFlagsKHR::empty() }
    }

    fn raw(&self, bottom: &[Level]) -> vk::AccelerationStructureInstanceKHR {
        let [x, y, z] = self.offset;
        vk::AccelerationStructureInstanceKHR {
            transform: vk::TransformMatrixKHR { matrix: [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z] },
            instance_custom_index_and_mask: vk::Packed24_8::new(self.index, self.mask),
            instance_shader_binding_table_record_offset_and_flags: vk::Packed24_8::new(0, self.flags.as_raw() as u8),
            acceleration_structure_reference: vk::AccelerationStructureReferenceKHR {
                device_handle: bottom[self.part].address(),
            },
        }
    }
}

/// Boxes and triangles for ray queries.
pub(crate) struct AccelerationStructure {
    top: Level,
    _bottom: Vec<Level>,
}

impl AccelerationStructure {
    /// Builds one of at least one instance.
    ///
    /// # Errors
    /// The device was not opened for ray queries; there are too many boxes or triangles, or is too little memory; a Vulkan call fails.
    pub fn new(
        device: &Arc<Device>,
        timeline: &mut Timeline,
        parts: &[Part<'_>],
        instances: &[Instance],
        options: BuildOptions,
    ) -> Result<Self, GpuError> {
        for part in parts {
            Self::check_count(device, part.shapes.name(), part.shapes.count() as u64)?;
        }
        if let Some(instance) = instances.iter().find(|instance| instance.index > Instance::MAX_INDEX) {
            return Err(GpuError::TooManyPrimitives {
                count: u64::from(instance.index),
                what: "boxes before triangles",
                limit: u64::from(Instance::MAX_INDEX),
                device: device.info.name.clone(),
            });
        }
        let inputs = parts.iter().map(|part| input(device, part.shapes.name(), part.shapes.bytes()));
        let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
        let unbuilt = parts.iter().zip(&inputs).map(|(Part { shapes, opaque }, input)| {
            let geometry = shapes.geometry(input, *opaque);
            Unbuilt::new(device, shapes.name(), BOTTOM, geometry, shapes.count() as u32, options)
        });
        let unbuilt = unbuilt.collect::<Result<Vec<_>, _>>()?;
        let ticket = timeline.submit(|r| {
            unbuilt.iter().for_each(|level| r.build(level));
            r.barrier(Access::Build, Access::Build);
        })?;
        timeline.wait(&ticket)?;
        let mut bottom: Vec<_> = unbuilt.into_iter().map(|level| level.level).collect();
        if options.compact {
            bottom = compacted(device, timeline, bottom)?;
        }

        let raw: Vec<_> = instances.iter().map(|instance| instance.raw(&bottom)).collect();
        // SAFETY: plain numbers without gaps, by their definition in the specification.
        let bytes = unsafe { slice::from_raw_parts(raw.as_ptr().cast::<u8>(), size_of_val(&raw[..])) };
        let input = input(device, "instances", bytes)?;
        let of_instances = vk::AccelerationStructureGeometryInstancesDataKHR::default()
            .data(vk::DeviceOrHostAddressConstKHR { device_address: input.address() });
        let geometry = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(vk::AccelerationStructureGeometryDataKHR { instances: of_instances });
        let top = Unbuilt::new(device, "instances", TOP, geometry, instances.len() as u32, options)?;
        let ticket = timeline.submit(|r| {
            r.build(&top);
            r.barrier(Access::Build, Access::RayQuery);
        })?;
        timeline.wait(&ticket)?;
        Ok(Self { top: top.level, _bottom: bottom })
    }

    /// Whether the device allows so many shapes in one level.
    ///
    /// # Errors
    /// It does not, or was not opened for ray queries.
    pub fn check_count(device: &Device, what: &'static str, count: u64) -> Result<(), GpuError> {
        let limit = device.ray_queries()?.limits.max_primitives;
        let too_many = || GpuError::TooManyPrimitives { count, what, limit, device: device.info.name.clone() };
        if count <= limit { Ok(()) } else { Err(too_many()) }
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
