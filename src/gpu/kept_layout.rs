//! Layouts of descriptors and push constants, which a device keeps.

use ash::vk;

use crate::gpu::error::{GpuError, check};

/// What a binding is to shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BindingKind {
    /// An array of numbers.
    Array,
    /// A few numbers to read, the same for all invocations.
    Values,
    /// Texels to read.
    Texels,
    /// Texels to read and write.
    StorageTexels,
    /// What ray queries look through.
    AccelerationStructure,
}

impl BindingKind {
    pub const ALL: [Self; 5] =
        [Self::Array, Self::Values, Self::Texels, Self::StorageTexels, Self::AccelerationStructure];

    /// What Vulkan calls it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Array => "storage buffer",
            Self::Values => "uniform buffer",
            Self::Texels => "uniform texel buffer, R32G32B32A32_UINT",
            Self::StorageTexels => "storage texel buffer, R32G32B32A32_UINT",
            Self::AccelerationStructure => "acceleration structure",
        }
    }

    pub fn raw(self) -> vk::DescriptorType {
        match self {
            Self::Array => vk::DescriptorType::STORAGE_BUFFER,
            Self::Values => vk::DescriptorType::UNIFORM_BUFFER,
            Self::Texels => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
            Self::StorageTexels => vk::DescriptorType::STORAGE_TEXEL_BUFFER,
            Self::AccelerationStructure => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
        }
    }
}

/// A layout that its device keeps: pipelines to spare must not outlive theirs.
pub(super) struct KeptLayout {
    pub bindings: Vec<(u32, BindingKind)>,
    pub push_bytes: u32,
    pub set: vk::DescriptorSetLayout,
    pub raw: vk::PipelineLayout,
}

impl KeptLayout {
    /// Makes it of the bindings' numbers and kinds, and the size of the push constants.
    pub fn new(device: &ash::Device, bindings: &[(u32, BindingKind)], push_bytes: u32) -> Result<Self, GpuError> {
        let layout_bindings: Vec<_> = bindings
            .iter()
            .map(|&(number, kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(number)
                    .descriptor_type(kind.raw())
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let mut layout = Self {
            bindings: bindings.to_vec(),
            push_bytes,
            set: vk::DescriptorSetLayout::null(),
            raw: vk::PipelineLayout::null(),
        };
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&layout_bindings);
        // SAFETY: live device; `layout_bindings` outlives the call.
        layout.set = check("vkCreateDescriptorSetLayout", unsafe { device.create_descriptor_set_layout(&info, None) })?;
        let set_layouts = [layout.set];
        let push = push_ranges(push_bytes);
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts).push_constant_ranges(&push);
        // SAFETY: the set layout was just made with this device; both arrays outlive the call.
        match check("vkCreatePipelineLayout", unsafe { device.create_pipeline_layout(&info, None) }) {
            Ok(raw) => Ok(Self { raw, ..layout }),
            Err(error) => {
                // SAFETY: nobody has it.
                unsafe { layout.destroy(device) };
                Err(error)
            }
        }
    }

    /// Destroys it.
    ///
    /// # Safety
    /// It is of this device, and nothing uses it any more.
    pub unsafe fn destroy(self, device: &ash::Device) {
        // SAFETY: the caller's; destroying a null handle does nothing.
        unsafe {
            device.destroy_pipeline_layout(self.raw, None);
            device.destroy_descriptor_set_layout(self.set, None);
        }
    }
}

/// Push constants of so many bytes, if there are any.
pub(super) fn push_ranges(bytes: u32) -> Vec<vk::PushConstantRange> {
    let range = vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(bytes);
    if bytes > 0 { vec![range] } else { Vec::new() }
}
