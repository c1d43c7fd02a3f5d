//! Compute pipelines and their specialization constants.

use std::sync::Arc;

use ash::vk;

use super::binaries::BinaryStore;
use super::bindings::BindingLayout;
use super::device::Device;
use super::error::{GpuError, check};
use super::prune::{self, prune};
use super::reconvergence::as_promised;
use super::shader_objects::ShaderObjects;
use crate::spirv::words_of;

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

    /// As Vulkan wants it: where each constant is in the data, and the data.
    pub(super) fn raw(&self) -> (Vec<vk::SpecializationMapEntry>, Vec<u8>) {
        let entry = |(i, &(id, _)): (usize, &(u32, u32))| vk::SpecializationMapEntry {
            constant_id: id,
            offset: 4 * i as u32,
            size: 4,
        };
        (
            self.entries.iter().enumerate().map(entry).collect(),
            self.entries.iter().flat_map(|&(_, value)| value.to_ne_bytes()).collect(),
        )
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

/// A specialised shader, ready to be dispatched.
pub(crate) struct Pipeline {
    raw: Raw,
    device: Arc<Device>,
}

/// As a pipeline, or by itself.
enum Raw {
    Pipeline(vk::Pipeline),
    Shader(vk::ShaderEXT, Arc<ShaderObjects>),
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
        let spirv = &as_promised(spirv, device.reconverges);
        let raw = match &device.shader_objects {
            Some(objects) => {
                let shader = objects.make(name, spirv, specialization, layout)?;
                device.name(shader, name);
                Raw::Shader(shader, Arc::clone(objects))
            }
            None => Raw::Pipeline(create(device, name, spirv, specialization, layout)?),
        };
        Ok(Self { raw, device: Arc::clone(device) })
    }

    /// Binds it for the dispatches that follow.
    ///
    /// # Safety
    /// The command buffer is being recorded, and the pipeline outlives its execution.
    pub unsafe fn bind(&self, commands: vk::CommandBuffer) {
        // SAFETY: the caller's.
        unsafe {
            match &self.raw {
                Raw::Shader(shader, objects) => objects.bind(commands, *shader),
                Raw::Pipeline(pipeline) => {
                    self.device.raw.cmd_bind_pipeline(commands, vk::PipelineBindPoint::COMPUTE, *pipeline);
                }
            }
        }
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        if self.device.is_given_up() {
            return;
        }
        // SAFETY: owners wait for the device before they drop a pipeline that a submission uses.
        unsafe {
            match &self.raw {
                Raw::Shader(shader, objects) => objects.destroy(*shader),
                Raw::Pipeline(pipeline) => self.device.raw.destroy_pipeline(*pipeline, None),
            }
        }
    }
}

/// SPIR-V without what these constants switch off, in words.
pub(super) fn pruned(name: &str, spirv: &[u8], specialization: &Specialization) -> Vec<u32> {
    let words = words_of(spirv);
    prune(&words, specialization).unwrap_or_else(|| {
        log::debug!("{name}: SPIR-V of another kind than glslang's, left to the driver as it is");
        words
    })
}

/// The same, kept on disk from one start to the next: to take 650 KB apart takes about 7 ms.
fn pruned_once(device: &Device, name: &str, spirv: &[u8], specialization: &Specialization) -> Vec<u32> {
    let Some(folder) = &device.shader_folder else { return pruned(name, spirv, specialization) };
    let store = BinaryStore::new(folder);
    let mut identity = b"SPIR-V".to_vec();
    identity.extend(prune::identity(spirv));
    for (id, value) in &specialization.entries {
        identity.extend([id.to_le_bytes(), value.to_le_bytes()].concat());
    }
    if let Some(kept) = store.load(&identity) {
        return words_of(&kept);
    }
    let words = pruned(name, spirv, specialization);
    store.keep(&identity, bytemuck::cast_slice(&words));
    words
}

fn create(
    device: &Device,
    name: &str,
    spirv: &[u8],
    specialization: &Specialization,
    layout: &BindingLayout,
) -> Result<vk::Pipeline, GpuError> {
    let words = pruned_once(device, name, spirv, specialization);
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: the SPIR-V was made by glslang in the build script, or is the user's own (`spirv_folder`), who
    // answers for it.
    let module = check("vkCreateShaderModule", unsafe { device.raw.create_shader_module(&info, None) })?;
    device.name(module, name);
    let (map, data) = specialization.raw();
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
    Ok(raw)
}
