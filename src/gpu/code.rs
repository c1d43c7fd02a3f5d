//! What a pipeline is made of.

use ash::vk;

use crate::gpu::prune::prune;
use crate::gpu::specialization::Specialization;
use crate::spirv::words_of;

/// What a pipeline is made of.
pub(super) struct Code<'a> {
    pub name: &'a str,
    pub spirv: &'a [u8],
    pub specialization: &'a Specialization,
    /// All that the pipeline depends on but for the device.
    pub identity: &'a [u8],
    /// What the shader sees.
    pub set: vk::DescriptorSetLayout,
    pub push: &'a [vk::PushConstantRange],
}

/// SPIR-V without what the constants switch off, in words.
pub(super) fn pruned(code: &Code<'_>) -> Vec<u32> {
    let words = words_of(code.spirv);
    prune(&words, code.specialization).unwrap_or_else(|| {
        log::debug!("{}: SPIR-V of another kind than glslang's, left to the driver as it is", code.name);
        words
    })
}
