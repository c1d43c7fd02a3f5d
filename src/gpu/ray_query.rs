//! Ray queries: whether a device has them, and what it has to be made with for that.

use std::ffi::CStr;

use ash::{khr, vk};

use crate::gpu::instance::Instance;

/// What a device has to be made with. (Acceleration structures depend on the last one, which nothing here uses.)
pub(super) const EXTENSIONS: [&CStr; 3] =
    [khr::ray_query::NAME, khr::acceleration_structure::NAME, khr::deferred_host_operations::NAME];

/// Whether a device is opened for ray queries, if it has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RayQueryUse {
    /// It is not.
    #[default]
    Never,
    /// Unless it is a CPU, where nothing gets faster by them.
    OnGpus,
    /// It is.
    Always,
}

impl RayQueryUse {
    pub(super) fn applies_to(self, is_cpu: bool) -> bool {
        self == Self::Always || (self == Self::OnGpus && !is_cpu)
    }
}

/// What a device with ray queries tells of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RayQueryLimits {
    /// Boxes, or triangles, of an acceleration structure, at most.
    pub max_primitives: u64,
    /// Of the addresses of memory in which one is built.
    pub(super) scratch_alignment: u64,
}

/// The calls of a device that was made with [`EXTENSIONS`].
pub(crate) struct RayQueries {
    pub calls: khr::acceleration_structure::Device,
    pub limits: RayQueryLimits,
}

impl RayQueries {
    pub fn on(instance: &Instance, device: &ash::Device, limits: RayQueryLimits) -> Self {
        Self { calls: khr::acceleration_structure::Device::new(&instance.raw, device), limits }
    }
}

/// The limits of a device of Vulkan 1.2; `None` if it lacks ray queries. Features count: a device may know the extensions without them.
pub(super) fn limits(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    basic: &vk::PhysicalDeviceVulkan12Features<'_>,
) -> Option<RayQueryLimits> {
    if !EXTENSIONS.iter().all(|name| instance.has_extension(physical, name)) {
        return None;
    }
    let mut queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
    let mut structures = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut queries).push_next(&mut structures);
    let mut limits = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut limits);
    // SAFETY: `physical` comes from this instance, and knows the extensions of the structures.
    unsafe {
        instance.raw.get_physical_device_features2(physical, &mut features);
        instance.raw.get_physical_device_properties2(physical, &mut properties);
    }
    let has_all = [queries.ray_query, structures.acceleration_structure, basic.buffer_device_address]
        .iter()
        .all(|&feature| feature == vk::TRUE);
    has_all.then_some(RayQueryLimits {
        max_primitives: limits.max_primitive_count,
        scratch_alignment: u64::from(limits.min_acceleration_structure_scratch_offset_alignment.max(1)),
    })
}
