//! Compute pipelines and their specialization constants.

use std::sync::Arc;

use ash::vk;

use super::bindings::BindingLayout;
use super::device::Device;
use super::error::{GpuError, check};
use super::prune::prune;

/// Values of specialization constants, by id.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Specialization {
    entries: Vec<(u32, u32)>,
}

impl Specialization {
    /// Sets an unsigned constant, which may have had another value.
    pub fn uint(&mut self, id: u32, value: u32) -> &mut Self {
        // Vulkan wants each of them once.
        match self.entries.iter_mut().find(|entry| entry.0 == id) {
            Some(entry) => entry.1 = value,
            None => self.entries.push((id, value)),
        }
        self
    }

    /// Sets a signed constant.
    pub fn int(&mut self, id: u32, value: i32) -> &mut Self {
        self.uint(id, value as u32)
    }

    /// Sets a float constant, bit for bit.
    pub fn float(&mut self, id: u32, value: f32) -> &mut Self {
        self.uint(id, value.to_bits())
    }

    /// Sets a boolean constant.
    pub fn bool(&mut self, id: u32, value: bool) -> &mut Self {
        self.uint(id, u32::from(value))
    }

    /// The value of a constant, if it is set.
    pub(super) fn value(&self, id: u32) -> Option<u32> {
        self.entries.iter().find(|&&(i, _)| i == id).map(|&(_, value)| value)
    }

    /// Number of constants that are set.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether none is set.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

/// A compute pipeline.
pub(crate) struct Pipeline {
    pub raw: vk::Pipeline,
    device: Arc<Device>,
}

impl Pipeline {
    /// Specialises SPIR-V and compiles it.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        spirv: &[u8],
        specialization: &Specialization,
        layout: &BindingLayout,
    ) -> Result<Self, GpuError> {
        // Whatever the alignment of the bytes.
        let words: Vec<u32> = spirv.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
        let words = prune(&words, specialization).unwrap_or_else(|| {
            log::debug!("{name}: SPIR-V of another kind than glslang's, left to the driver as it is");
            words
        });
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the SPIR-V was made by glslang in the build script, or is the user's own (`spirv_folder`), who
        // answers for it.
        let module = check("vkCreateShaderModule", unsafe { device.raw.create_shader_module(&info, None) })?;
        device.name(module, name);
        let map: Vec<_> = specialization
            .entries
            .iter()
            .enumerate()
            .map(|(i, &(id, _))| vk::SpecializationMapEntry { constant_id: id, offset: 4 * i as u32, size: 4 })
            .collect();
        let data: Vec<u8> = specialization.entries.iter().flat_map(|&(_, v)| v.to_ne_bytes()).collect();
        let values = vk::SpecializationInfo::default().map_entries(&map).data(&data);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(&values);
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout.raw)];
        // SAFETY: module, layout and the specialization data live for the call.
        let made = unsafe { device.raw.create_compute_pipelines(vk::PipelineCache::null(), &info, None) };
        // SAFETY: a module may go once its pipelines are made.
        unsafe { device.raw.destroy_shader_module(module, None) };
        let raw = check("vkCreateComputePipelines", made.map_err(|(_, e)| e))?[0];
        device.name(raw, name);
        Ok(Self { raw, device: Arc::clone(device) })
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device before they drop a pipeline that a submission uses.
        unsafe { self.device.raw.destroy_pipeline(self.raw, None) };
    }
}
