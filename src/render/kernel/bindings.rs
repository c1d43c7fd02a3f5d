//! What all kernels see, those of the path tracer and the probes (shaders/lib/layout.glsl).

use std::sync::Arc;

use crate::accel::Texel;
use crate::gpu::{
    AccelerationStructure, BindingKind, BindingLayout, Buffer, BuildOptions, Device, DeviceKind, GpuError, Resource,
    Timeline, Usage,
};

use crate::render::error::RenderError;
use crate::render::kernel::layout::{Push, binding};
use crate::render::kernel::upload::upload;
use crate::render::scene::tables::Tables;
use crate::render::settings::QueryBuild;

/// The tables of a scene, and the sampler's.
const TABLES: [u32; 5] = [binding::BVH, binding::GEOMETRY, binding::SOBOL, binding::LIGHTS, binding::TEXTURES];
const COMMON: [(u32, BindingKind); 4] = [
    (binding::FILM, BindingKind::StorageTexels),
    (binding::FILM_ROWS, BindingKind::Array),
    (binding::COUNTERS, BindingKind::Array),
    (binding::SCENE, BindingKind::Values),
];

/// What those see besides that use ray queries.
const OF_RAY_QUERIES: (u32, BindingKind) = (binding::ACCELERATION_STRUCTURE, BindingKind::AccelerationStructure);

/// The layout of a kernel that sees this and something of its own, and uses ray queries or not.
///
/// # Errors
/// The device was not opened for ray queries; a Vulkan call fails.
pub(crate) fn layout(
    device: &Arc<Device>,
    own: &[(u32, BindingKind)],
    ray_query: bool,
) -> Result<Arc<BindingLayout>, GpuError> {
    let kind = if device.info.tables_in_arrays { BindingKind::Array } else { BindingKind::Texels };
    let tables = TABLES.map(|number| (number, kind));
    let mut bindings = [&tables[..], &COMMON, own].concat();
    if ray_query {
        device.ray_queries()?;
        bindings.push(OF_RAY_QUERIES);
    }
    BindingLayout::new(device, &bindings, size_of::<Push>() as u32)
}

/// The tables of a scene and the sampler's, on the device.
pub(crate) struct TableBuffers {
    buffers: Vec<(u32, Buffer)>,
    acceleration_structure: Option<AccelerationStructure>,
}

impl TableBuffers {
    /// Makes and fills them.
    ///
    /// # Errors
    /// A limit of the device or its memory is exceeded.
    pub fn new(
        device: &Arc<Device>,
        timeline: &mut Timeline,
        tables: &Tables,
        sobol: &[Texel],
    ) -> Result<Self, RenderError> {
        let values = tables.values();
        let usage = if device.info.tables_in_arrays { Usage::Storage } else { Usage::Texel };
        let sources: [(u32, &str, &[u8], Usage); 6] = [
            (binding::BVH, "BVH", bytemuck::cast_slice(&tables.packed.texels), usage),
            (binding::GEOMETRY, "geometry", bytemuck::cast_slice(&tables.geometry.texels), usage),
            (binding::SOBOL, "sobol", bytemuck::cast_slice(sobol), usage),
            (binding::LIGHTS, "lights", bytemuck::cast_slice(&tables.lights.texels), usage),
            (binding::TEXTURES, "textures", bytemuck::cast_slice(&tables.textures), usage),
            (binding::SCENE, "scene", bytemuck::bytes_of(&values), Usage::Values),
        ];
        if let Some(captures) = &device.captures {
            sources
                .iter()
                .for_each(|(number, name, bytes, _)| captures.buffer(&format!("binding {number}, {name}"), bytes));
        }
        let mut uploads = Vec::new();
        for (_, name, bytes, usage) in sources {
            uploads.push((Buffer::new(device, name, bytes.len() as u64, usage)?, bytes));
        }
        upload(device, timeline, &mut uploads)?;
        let numbers = sources.iter().map(|&(number, ..)| number);
        let buffers = numbers.zip(uploads.into_iter().map(|(buffer, _)| buffer)).collect();
        let of = tables.query_geometry.as_ref().map(|of| {
            let options = BuildOptions {
                compact: match of.build {
                    // A CPU driver's have their final size at once.
                    QueryBuild::Plain => device.info.kind != DeviceKind::Cpu,
                    QueryBuild::Compacted => true,
                    QueryBuild::Shuffled | QueryBuild::ShiftedScratch => false,
                },
                shift_scratch: of.build == QueryBuild::ShiftedScratch,
            };
            let (parts, instances) = of.parts();
            AccelerationStructure::new(device, timeline, &parts, &instances, options)
        });
        Ok(Self { buffers, acceleration_structure: of.transpose()? })
    }

    /// What to bind: these, and others.
    pub fn and<'a>(&'a self, others: &[(u32, &'a Buffer)]) -> Vec<(u32, Resource<'a>)> {
        let own = self.buffers.iter().map(|(number, buffer)| (*number, buffer));
        let buffers = own.chain(others.iter().copied()).map(|(number, buffer)| (number, Resource::Buffer(buffer)));
        let structure = self.acceleration_structure.iter();
        let structure =
            structure.map(|of| (binding::ACCELERATION_STRUCTURE, Resource::AccelerationStructure(of.top())));
        buffers.chain(structure).collect()
    }
}
