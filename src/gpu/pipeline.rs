//! Compute pipelines.

use std::mem::take;
use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use crate::gpu::binaries::BinaryStore;
use crate::gpu::bindings::BindingLayout;
use crate::gpu::code::{Code, pruned};
use crate::gpu::device::Device;
use crate::gpu::error::{GpuError, check};
use crate::gpu::prune;
use crate::gpu::raw_pipeline::RawPipeline;
use crate::gpu::reconvergence::as_promised;
use crate::gpu::specialization::Specialization;
use crate::gpu::trial;
use crate::spirv::words_of;

/// A specialised shader, ready to be dispatched. One that is dropped stays with its device for a while, where the next that wants
/// the same finds it: to compile it again takes some tenths of a second on lavapipe.
pub(crate) struct Pipeline {
    raw: RawPipeline,
    identity: Vec<u8>,
    device: Arc<Device>,
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
        let push = layout.push_ranges();
        let code = Code { name, spirv, specialization, identity: &identity, set: layout.set, push: &push };
        if let Some(captures) = &device.captures {
            captures.shader(&code, &layout.bindings, layout.push_bytes);
        }
        let raw = match device.pipelines.take(&identity) {
            Some(spare) => spare,
            None => compile(device, &code, layout.raw)?,
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

fn compile(device: &Device, code: &Code<'_>, layout: vk::PipelineLayout) -> Result<RawPipeline, GpuError> {
    let Some(objects) = &device.shader_objects else {
        return Ok(RawPipeline::Pipeline(create(device, code, layout)?));
    };
    let shader = objects.make(code)?;
    device.name(shader, code.name);
    Ok(RawPipeline::Shader(shader, Arc::clone(objects)))
}

/// [`pruned`], kept on disk from one start to the next: to take 650 KB apart takes about 7 ms.
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

fn create(device: &Device, code: &Code<'_>, layout: vk::PipelineLayout) -> Result<vk::Pipeline, GpuError> {
    let Code { name, specialization, .. } = code;
    let words = pruned_once(device, code);
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: the SPIR-V was made by glslang in the build script, or is the user's own (`spirv_folder`), who
    // answers for it.
    let module = check("vkCreateShaderModule", unsafe { device.raw.create_shader_module(&info, None) })?;
    device.name(module, name);
    let (map, data) = specialization.raw();
    let values = vk::SpecializationInfo::default().map_entries(&map).data(&data);
    let mut lanes = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default()
        .required_subgroup_size(device.info.subgroup_size);
    let mut stage = vk::PipelineShaderStageCreateInfo::default()
        .stage(vk::ShaderStageFlags::COMPUTE)
        .module(module)
        .name(c"main")
        .specialization_info(&values);
    if device.info.pins_subgroups {
        stage = stage.push_next(&mut lanes);
    }
    let start = Instant::now();
    let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
    let made = trial::compile(&device.info, name, || {
        // SAFETY: module, layout and the specialization data live for the call.
        let made = unsafe { device.raw.create_compute_pipelines(vk::PipelineCache::null(), &info, None) };
        check("vkCreateComputePipelines", made.map_err(|(_, e)| e))
    });
    // SAFETY: a module may go once its pipelines are made.
    unsafe { device.raw.destroy_shader_module(module, None) };
    let raw = made?[0];
    log::debug!("{name}: compiled in {:.3} s", start.elapsed().as_secs_f64());
    device.name(raw, name);
    Ok(raw)
}
