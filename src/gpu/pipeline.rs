//! Compute pipelines: one descriptor set, push constants, specialization constants.

use std::sync::Arc;

use ash::vk;

use super::buffer::Buffer;
use super::device::Device;
use super::error::{GpuError, check};

/// Values of specialization constants, by id.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Specialization {
    entries: Vec<(u32, u32)>,
}

impl Specialization {
    /// Sets an unsigned constant.
    pub fn uint(&mut self, id: u32, value: u32) -> &mut Self {
        self.entries.push((id, value));
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

    /// Number of constants that are set.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether none is set.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

/// One binding of the descriptor set.
#[derive(Clone, Copy)]
pub(crate) struct Binding<'a> {
    pub number: u32,
    pub buffer: &'a Buffer,
    ty: vk::DescriptorType,
}

impl<'a> Binding<'a> {
    /// The buffer as its usage says.
    pub fn new(number: u32, buffer: &'a Buffer) -> Self {
        Self { number, buffer, ty: buffer.descriptor_type() }
    }

    /// A [`Usage::StorageTexelAndArray`](super::Usage::StorageTexelAndArray) buffer as an array.
    pub fn untyped(number: u32, buffer: &'a Buffer) -> Self {
        Self { number, buffer, ty: vk::DescriptorType::STORAGE_BUFFER }
    }
}

/// What a set of pipelines shares: layout and descriptor set over the same buffers.
pub(crate) struct BindingSet {
    pub layout: vk::PipelineLayout,
    pub set: vk::DescriptorSet,
    set_layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    device: Arc<Device>,
}

impl BindingSet {
    /// Makes the layout and writes the descriptors. The buffers must outlive the set's use.
    pub fn new(device: &Arc<Device>, bindings: &[Binding<'_>], push_bytes: u32) -> Result<Self, GpuError> {
        let layout_bindings: Vec<_> = bindings
            .iter()
            .map(|b| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(b.number)
                    .descriptor_type(b.ty)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let mut set = Self {
            layout: vk::PipelineLayout::null(),
            set: vk::DescriptorSet::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            pool: vk::DescriptorPool::null(),
            device: Arc::clone(device),
        };
        let raw = &device.raw;
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&layout_bindings);
        // SAFETY: live device; `layout_bindings` outlives the call.
        set.set_layout =
            check("vkCreateDescriptorSetLayout", unsafe { raw.create_descriptor_set_layout(&info, None) })?;
        let set_layouts = [set.set_layout];
        let push = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(push_bytes)];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
        if push_bytes > 0 {
            info = info.push_constant_ranges(&push);
        }
        // SAFETY: the set layout was just made with this device; both arrays outlive the call.
        set.layout = check("vkCreatePipelineLayout", unsafe { raw.create_pipeline_layout(&info, None) })?;
        let count = |wanted| bindings.iter().filter(|b| b.ty == wanted).count() as u32;
        let sizes: Vec<_> = [
            vk::DescriptorType::STORAGE_BUFFER,
            vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
            vk::DescriptorType::STORAGE_TEXEL_BUFFER,
        ]
        .into_iter()
        .map(|ty| vk::DescriptorPoolSize { ty, descriptor_count: count(ty) })
        .filter(|s| s.descriptor_count > 0)
        .collect();
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: live device; `sizes` is not empty, since a set has bindings, and outlives the call.
        set.pool = check("vkCreateDescriptorPool", unsafe { raw.create_descriptor_pool(&info, None) })?;
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(set.pool).set_layouts(&set_layouts);
        // SAFETY: pool and layout were just made with this device, and the pool has room for this one set.
        let sets = check("vkAllocateDescriptorSets", unsafe { raw.allocate_descriptor_sets(&info) })?;
        set.set = sets[0];

        let ranges: Vec<_> = bindings
            .iter()
            .map(|b| [vk::DescriptorBufferInfo::default().buffer(b.buffer.raw).range(vk::WHOLE_SIZE)])
            .collect();
        let views: Vec<_> = bindings.iter().map(|b| [b.buffer.view]).collect();
        let writes: Vec<_> = bindings
            .iter()
            .enumerate()
            .map(|(i, b)| {
                let ty = b.ty;
                let write =
                    vk::WriteDescriptorSet::default().dst_set(set.set).dst_binding(b.number).descriptor_type(ty);
                if ty == vk::DescriptorType::STORAGE_BUFFER {
                    write.buffer_info(&ranges[i])
                } else {
                    write.texel_buffer_view(&views[i])
                }
            })
            .collect();
        // SAFETY: no submission uses the new set yet; buffers and views are alive; `ranges` and `views` outlive the call.
        unsafe { raw.update_descriptor_sets(&writes, &[]) };
        Ok(set)
    }
}

impl Drop for BindingSet {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device first; destroying a null handle does nothing.
        unsafe {
            self.device.raw.destroy_descriptor_pool(self.pool, None);
            self.device.raw.destroy_pipeline_layout(self.layout, None);
            self.device.raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
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
        bindings: &BindingSet,
    ) -> Result<Self, GpuError> {
        // Whatever the alignment of the bytes.
        let words: Vec<u32> = spirv.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
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
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(bindings.layout)];
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
