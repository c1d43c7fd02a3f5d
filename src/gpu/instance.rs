//! The Vulkan instance: loader, layers, debug messenger.

use std::ffi::{CStr, c_char};
use std::sync::Arc;

use ash::{ext, khr, vk};

use crate::gpu::error::{GpuError, check};
use crate::gpu::messages::Messages;

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Which validation to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Validation {
    /// No layers.
    #[default]
    Off,
    /// Core validation: the rules of each call.
    Core,
    /// Synchronization validation: missing barriers between dispatches and copies.
    Synchronization,
    /// GPU-assisted validation: the layer makes shaders check bounds of buffers, and what they give to ray queries. It takes a layer from
    /// about 1.4.300 on.
    GpuAssisted,
}

/// An instance with its optional debug messenger.
pub(crate) struct Instance {
    pub raw: ash::Instance,
    pub messages: Arc<Messages>,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    pub validation: Validation,
    /// Version of Vulkan that the validation layer knows, if there is one.
    pub layer_version: Option<u32>,
    // Last: the loader library must outlive everything made with it.
    _entry: ash::Entry,
}

impl Instance {
    /// Loads Vulkan and makes an instance of version 1.2, whose messages join these.
    ///
    /// # Errors
    /// No loader; the validation layer is missing; the driver refuses.
    pub fn new(validation: Validation, messages: Messages) -> Result<Self, GpuError> {
        // SAFETY: the loader library is trusted, as every program that opens it does.
        let entry = unsafe { ash::Entry::load() }.map_err(|e| GpuError::NoLoader(e.to_string()))?;
        let messages = Arc::new(messages);

        let mut layers: Vec<*const c_char> = Vec::new();
        let mut extensions: Vec<*const c_char> = Vec::new();
        let mut layer_version = None;
        // SAFETY: plain enumeration.
        let known = unsafe { entry.enumerate_instance_extension_properties(None) }.unwrap_or_default();
        // Drivers that do not do all that Vulkan asks for (MoltenVK) are seen only by who asks for them.
        let sees_all = known.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::portability_enumeration::NAME));
        let mut flags = vk::InstanceCreateFlags::empty();
        if sees_all {
            extensions.push(khr::portability_enumeration::NAME.as_ptr());
            flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
        }
        if validation != Validation::Off {
            // SAFETY: plain enumeration.
            let known =
                check("vkEnumerateInstanceLayerProperties", unsafe { entry.enumerate_instance_layer_properties() })?;
            let layer = known.iter().find(|l| l.layer_name_as_c_str() == Ok(VALIDATION_LAYER));
            layer_version = Some(layer.ok_or(GpuError::NoValidationLayer)?.spec_version);
            layers.push(VALIDATION_LAYER.as_ptr());
            extensions.push(ext::debug_utils::NAME.as_ptr());
            extensions.push(ext::validation_features::NAME.as_ptr());
        }

        let application = vk::ApplicationInfo::default()
            .application_name(c"photolith")
            .engine_name(c"photolith")
            .api_version(vk::API_VERSION_1_2);
        let enabled: &[_] = match validation {
            Validation::Off | Validation::Core => &[],
            Validation::Synchronization => &[vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION],
            Validation::GpuAssisted => &[
                vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
                vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
            ],
        };
        // The others run without the core checks: all are separate runs.
        let disabled = [vk::ValidationFeatureDisableEXT::CORE_CHECKS];
        let mut features = vk::ValidationFeaturesEXT::default();
        if !enabled.is_empty() {
            features = features.enabled_validation_features(enabled).disabled_validation_features(&disabled);
        }
        // With shaders that check, warnings are what the layer says of its own doing.
        let severity = match validation {
            Validation::GpuAssisted => vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            _ => vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
        };
        // Chained here too, so that messages about creating and destroying the instance are heard.
        let mut messenger_info = messages.create_info(severity);
        let mut info = vk::InstanceCreateInfo::default()
            .flags(flags)
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        if validation != Validation::Off {
            info = info.push_next(&mut features).push_next(&mut messenger_info);
        }
        // SAFETY: all pointers in `info` live until the call returns; `messages` outlives the instance.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => GpuError::NoDevice,
            result => GpuError::Call { call: "vkCreateInstance", result },
        })?;

        let messenger = if validation == Validation::Off {
            None
        } else {
            let utils = ext::debug_utils::Instance::new(&entry, &raw);
            // SAFETY: the extension is enabled, and `messages` outlives the messenger (destroyed in Drop).
            match unsafe { utils.create_debug_utils_messenger(&messages.create_info(severity), None) } {
                Ok(messenger) => Some((utils, messenger)),
                Err(result) => {
                    // SAFETY: nothing was made with the instance yet.
                    unsafe { raw.destroy_instance(None) };
                    return Err(GpuError::Call { call: "vkCreateDebugUtilsMessengerEXT", result });
                }
            }
        };
        Ok(Self { raw, messages, messenger, validation, layer_version, _entry: entry })
    }

    /// Whether a device of this instance knows an extension.
    pub fn has_extension(&self, device: vk::PhysicalDevice, name: &CStr) -> bool {
        // SAFETY: plain enumeration; `device` comes from this instance.
        let known = unsafe { self.raw.enumerate_device_extension_properties(device) }.unwrap_or_default();
        known.iter().any(|e| e.extension_name_as_c_str() == Ok(name))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: whoever owns an `Instance` drops the device before it.
        unsafe {
            if let Some((utils, messenger)) = self.messenger.take() {
                utils.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}
