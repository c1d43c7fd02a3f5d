//! What a pipeline is to Vulkan.

use std::sync::Arc;

use ash::vk;

use crate::gpu::shader_objects::ShaderObjects;

/// As a pipeline, or by itself.
#[derive(Clone)]
pub(super) enum RawPipeline {
    Pipeline(vk::Pipeline),
    Shader(vk::ShaderEXT, Arc<ShaderObjects>),
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
