//! Compute pipelines and their specialization constants.

use std::mem::take;
use std::sync::Arc;

use ash::vk;

use crate::gpu::binaries::BinaryStore;
use crate::gpu::bindings::BindingLayout;
use crate::gpu::device::Device;
use crate::gpu::error::{GpuError, check};
use crate::gpu::prune;
use crate::gpu::prune::prune;
use crate::gpu::reconvergence::as_promised;
use crate::gpu::shader_objects::ShaderObjects;
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

/// A specialised shader, ready to be dispatched. One that is dropped stays with its device for a while, where the next that wants
/// the same finds it: to compile it again takes some tenths of a second on lavapipe.
pub(crate) struct Pipeline {
    raw: RawPipeline,
    identity: Vec<u8>,
    device: Arc<Device>,
}

/// As a pipeline, or by itself.
#[derive(Clone)]
pub(super) enum RawPipeline {
    Pipeline(vk::Pipeline),
    Shader(vk::ShaderEXT, Arc<ShaderObjects>),
}

impl Pipeline {
    /// Specialises SPIR-V and compiles it, unless the device has the same to spare.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        spirv: &[u8],
        specialization: &Specialization,
        layout: &BindingLayout,
    ) -> Result<Self, GpuError> {
        let spirv = &as_promised(spirv, device.reconverges);
        let identity = identity(spirv, specialization, layout);
        let raw = match device.pipelines.take(&identity) {
            Some(spare) => spare,
            None => compile(device, &Code { name, spirv, specialization, identity: &identity }, layout)?,
        };
        Ok(Self { raw, identity, device: Arc::clone(device) })
    }

    /// Binds it for the dispatches that follow.
    ///
    /// # Safety
    /// The command buffer is being recorded, and the pipeline outlives its execution.
    pub unsafe fn bind(&self, commands: vk::CommandBuffer) {
        // SAFETY: the caller's.
        unsafe {
            match &self.raw {
                RawPipeline::Shader(shader, objects) => objects.bind(commands, *shader),
                RawPipeline::Pipeline(pipeline) => {
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
        if let Some(oldest) = self.device.pipelines.give_back(take(&mut self.identity), self.raw.clone()) {
            // SAFETY: owners wait for the device before they drop a pipeline that a submission uses.
            unsafe { oldest.destroy(&self.device.raw) };
        }
    }
}

impl RawPipeline {
    /// Destroys it.
    ///
    /// # Safety
    /// It is of this device, nobody has it, and no submission uses it any more.
    pub unsafe fn destroy(self, device: &ash::Device) {
        // SAFETY: the caller's.
        unsafe {
            match self {
                Self::Shader(shader, objects) => objects.destroy(shader),
                Self::Pipeline(pipeline) => device.destroy_pipeline(pipeline, None),
            }
        }
    }
}

/// What a pipeline is made of.
pub(super) struct Code<'a> {
    pub name: &'a str,
    pub spirv: &'a [u8],
    pub specialization: &'a Specialization,
    /// All that the pipeline depends on but for the device.
    pub identity: &'a [u8],
}

/// All that a pipeline depends on, its device aside. (It is made of what pruning leaves.)
fn identity(spirv: &[u8], specialization: &Specialization, layout: &BindingLayout) -> Vec<u8> {
    let mut identity = prune::identity(spirv);
    identity.extend(layout.push_bytes.to_le_bytes());
    identity.extend((layout.bindings.len() as u64).to_le_bytes());
    for &(number, kind) in &layout.bindings {
        identity.extend(number.to_le_bytes());
        identity.push(kind as u8);
    }
    for &(id, value) in &specialization.entries {
        identity.extend([id.to_le_bytes(), value.to_le_bytes()].concat());
    }
    identity
}

fn compile(device: &Device, code: &Code<'_>, layout: &BindingLayout) -> Result<RawPipeline, GpuError> {
    let Some(objects) = &device.shader_objects else {
        return Ok(RawPipeline::Pipeline(create(device, code, layout)?));
    };
    let shader = objects.make(code, layout)?;
    device.name(shader, code.name);
    Ok(RawPipeline::Shader(shader, Arc::clone(objects)))
}

/// SPIR-V without what the constants switch off, in words.
pub(super) fn pruned(code: &Code<'_>) -> Vec<u32> {
    let words = words_of(code.spirv);
    prune(&words, code.specialization).unwrap_or_else(|| {
        log::debug!("{}: SPIR-V of another kind than glslang's, left to the driver as it is", code.name);
        words
    })
}

/// The same, kept on disk from one start to the next: to take 650 KB apart takes about 7 ms.
fn pruned_once(device: &Device, code: &Code<'_>) -> Vec<u32> {
    let Some(folder) = &device.shader_folder else { return pruned(code) };
    let store = BinaryStore::new(folder);
    let identity = [b"SPIR-V", code.identity].concat();
    if let Some(kept) = store.load(&identity) {
        return words_of(&kept);
    }
    let words = pruned(code);
    store.keep(&identity, bytemuck::cast_slice(&words));
    words
}

fn create(device: &Device, code: &Code<'_>, layout: &BindingLayout) -> Result<vk::Pipeline, GpuError> {
    let Code { name, specialization, .. } = code;
    let words = pruned_once(device, code);
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
