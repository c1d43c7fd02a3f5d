//! Shaders without pipelines (VK_EXT_shader_object), whose binaries the driver hands over.
//!
//! lavapipe makes the same machine code of a shader only once, but works on the shader itself each time that a program
//! starts: .05 to .15 s. Its binaries are shaders that are done with that.

use std::ffi::CStr;
use std::path::{Path, PathBuf};

use ash::{ext, khr, vk};

use crate::gpu::binaries::BinaryStore;
use crate::gpu::code::{Code, pruned};
use crate::gpu::error::{GpuError, check};
use crate::gpu::instance::Instance;
use crate::gpu::select::{DeviceInfo, DeviceKind};

/// The first validation layer that knows of shader objects; earlier ones get in their way.
const LAYER_VERSION: u32 = vk::make_api_version(0, 1, 3, 246);

/// Where binaries are kept, for devices that have them.
pub(crate) struct Store {
    folder: PathBuf,
    /// Of device and driver.
    identity: Vec<u8>,
}

/// Makes shaders of one device.
pub(crate) struct ShaderObjects {
    calls: ext::shader_object::Device,
    binaries: BinaryStore,
    store: Store,
}

impl ShaderObjects {
    /// What a device has to be made with.
    pub const EXTENSIONS: [&CStr; 2] = [ext::shader_object::NAME, khr::dynamic_rendering::NAME];

    /// A store for a device, if it is worth it and the device can do it.
    pub fn find(instance: &Instance, physical: vk::PhysicalDevice, info: &DeviceInfo, folder: &Path) -> Option<Store> {
        // GPUs' drivers keep what they compile by themselves.
        if info.kind != DeviceKind::Cpu || instance.layer_version.is_some_and(|version| version < LAYER_VERSION) {
            return None;
        }
        if !Self::EXTENSIONS.iter().all(|name| instance.has_extension(physical, name)) {
            return None;
        }
        let mut objects = vk::PhysicalDeviceShaderObjectFeaturesEXT::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut objects);
        let mut binary = vk::PhysicalDeviceShaderObjectPropertiesEXT::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut binary);
        // SAFETY: `physical` comes from this instance, and knows the extension.
        unsafe {
            instance.raw.get_physical_device_features2(physical, &mut features);
            instance.raw.get_physical_device_properties2(physical, &mut properties);
        }
        let basic = properties.properties;
        if objects.shader_object == vk::FALSE {
            return None;
        }
        let mut identity = Vec::new();
        identity.extend(binary.shader_binary_uuid);
        identity.extend(basic.pipeline_cache_uuid);
        for number in [binary.shader_binary_version, basic.driver_version, basic.device_id, info.subgroup_size] {
            identity.extend(number.to_le_bytes());
        }
        identity.extend(info.driver.as_bytes());
        Some(Store { folder: folder.to_owned(), identity })
    }

    /// Makes a shader: of its binary if there is one that the driver still takes, else of the SPIR-V, and keeps its binary.
    pub(super) fn make(&self, code: &Code<'_>) -> Result<vk::ShaderEXT, GpuError> {
        let Code { name, specialization, set, push, .. } = code;
        let set_layouts = [*set];
        let (map, data) = specialization.raw();
        let identity = [&self.store.identity, code.identity].concat();
        let values = vk::SpecializationInfo::default().map_entries(&map).data(&data);
        let info = vk::ShaderCreateInfoEXT::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .name(c"main")
            .set_layouts(&set_layouts)
            .push_constant_ranges(push)
            .specialization_info(&values);
        if let Some(binary) = self.binaries.load(&identity) {
            match self.create(info, vk::ShaderCodeTypeEXT::BINARY, &Aligned::of(&binary).bytes()[..binary.len()]) {
                Ok(shader) => return Ok(shader),
                Err(error) => log::debug!("{name}: the driver does not take its own binary: {error}"),
            }
        }
        let words = pruned(code);
        let created = self.create(info, vk::ShaderCodeTypeEXT::SPIRV, bytemuck::cast_slice(&words));
        let shader = check("vkCreateShadersEXT", created)?;
        // SAFETY: the shader was just made.
        match unsafe { self.calls.get_shader_binary_data(shader) } {
            Ok(binary) => self.binaries.keep(&identity, &binary),
            Err(error) => log::debug!("{name}: no binary: {error}"),
        }
        Ok(shader)
    }

    /// Makes the shader that `info` describes of SPIR-V of glslang or the user's own, or of what this driver has handed over
    /// for the same description.
    fn create(
        &self,
        info: vk::ShaderCreateInfoEXT<'_>,
        kind: vk::ShaderCodeTypeEXT,
        code: &[u8],
    ) -> Result<vk::ShaderEXT, vk::Result> {
        // SAFETY: what the description names lives for the call, and so does the code, of which the driver judges.
        let made = unsafe { self.calls.create_shaders(&[info.code_type(kind).code(code)], None) };
        made.map(|shaders| shaders[0]).map_err(|(_, error)| error)
    }

    /// Binds a shader for the dispatches that follow.
    ///
    /// # Safety
    /// The command buffer is being recorded, and the shader outlives its execution.
    pub unsafe fn bind(&self, commands: vk::CommandBuffer, shader: vk::ShaderEXT) {
        // SAFETY: the caller's.
        unsafe { self.calls.cmd_bind_shaders(commands, &[vk::ShaderStageFlags::COMPUTE], &[shader]) };
    }

    /// Destroys a shader.
    ///
    /// # Safety
    /// No submission uses it any more.
    pub unsafe fn destroy(&self, shader: vk::ShaderEXT) {
        // SAFETY: the caller's.
        unsafe { self.calls.destroy_shader(shader, None) };
    }
}

impl Store {
    /// The calls of a device that was made with [`ShaderObjects::EXTENSIONS`].
    pub fn on(self, instance: &Instance, device: &ash::Device) -> ShaderObjects {
        let calls = ext::shader_object::Device::new(&instance.raw, device);
        ShaderObjects { calls, binaries: BinaryStore::new(&self.folder), store: self }
    }
}

/// Bytes that begin where Vulkan wants those of binaries to begin: at a multiple of 16.
struct Aligned(Vec<[u64; 2]>);

impl Aligned {
    fn of(bytes: &[u8]) -> Self {
        let mut blocks = vec![[0u64; 2]; bytes.len().div_ceil(16)];
        bytemuck::cast_slice_mut::<_, u8>(&mut blocks)[..bytes.len()].copy_from_slice(bytes);
        Self(blocks)
    }

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }
}
