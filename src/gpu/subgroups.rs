//! How many lanes the subgroups of a dispatch have: by VK_EXT_subgroup_size_control that can be asked for, else drivers may choose.

use std::ffi::CStr;

use ash::{ext, vk};

use crate::gpu::instance::Instance;

/// The extension by which a size is asked for.
pub(super) const EXTENSION: &CStr = ext::subgroup_size_control::NAME;

/// Whether compute shaders can ask for subgroups of this size.
pub(super) fn can_be_pinned(instance: &Instance, device: vk::PhysicalDevice, lanes: u32) -> bool {
    let Some(sizes) = sizes(instance, device) else { return false };
    let mut control = vk::PhysicalDeviceSubgroupSizeControlFeatures::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut control);
    // SAFETY: the device knows the extension that the structure is of.
    unsafe { instance.raw.get_physical_device_features2(device, &mut features) };
    control.subgroup_size_control == vk::TRUE
        && sizes.required_subgroup_size_stages.contains(vk::ShaderStageFlags::COMPUTE)
        && (sizes.min_subgroup_size..=sizes.max_subgroup_size).contains(&lanes)
}

/// Whether a device says that its subgroups have one size only.
pub(super) fn have_one_size(instance: &Instance, device: vk::PhysicalDevice) -> bool {
    sizes(instance, device).is_some_and(|sizes| sizes.min_subgroup_size == sizes.max_subgroup_size)
}

fn sizes(
    instance: &Instance,
    device: vk::PhysicalDevice,
) -> Option<vk::PhysicalDeviceSubgroupSizeControlProperties<'static>> {
    if !instance.has_extension(device, EXTENSION) {
        return None;
    }
    let mut sizes = vk::PhysicalDeviceSubgroupSizeControlProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut sizes);
    // SAFETY: the device knows the extension that the structure is of.
    unsafe { instance.raw.get_physical_device_properties2(device, &mut properties) };
    Some(sizes)
}
