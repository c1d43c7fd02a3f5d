//! What photolith requires of a device.

use std::ops::RangeInclusive;

use ash::vk;

/// What a feature is called, and where Vulkan tells and is told of it.
type Feature = (&'static str, for<'a> fn(&'a mut vk::PhysicalDeviceVulkan12Features<'static>) -> &'a mut vk::Bool32);

const FEATURES: [Feature; 2] = [
    ("timeline semaphores", |features| &mut features.timeline_semaphore),
    ("broadcasts from any lane of a subgroup", |features| &mut features.subgroup_broadcast_dynamic_id),
];

/// Storage buffers that a kernel sees at most. (Vulkan allows at least 4.)
pub(super) const STORAGE_BUFFERS: u32 = 5;
/// Tables of a scene, which are storage buffers too where texel buffers are too small.
const TABLES: u32 = 5;
/// Texels that tables may need: a scene of a million triangles has some ten million. (Vulkan allows at least 65,536.)
const ENOUGH_TEXELS: u32 = 1 << 20;

/// Lanes of a subgroup, a power of two. (Vulkan allows 1 and 2, where nothing was tested; lavapipe, which takes any number that its
/// environment asks for, crashes with these and renders something else with 14.)
const LANES: RangeInclusive<u32> = 4..=128;

/// The features, switched on.
pub(super) fn features() -> vk::PhysicalDeviceVulkan12Features<'static> {
    let mut features = vk::PhysicalDeviceVulkan12Features::default();
    for (_, of) in FEATURES {
        *of(&mut features) = vk::TRUE;
    }
    features
}

/// Whether texel buffers are too small for tables, which there is room for as arrays.
pub(super) fn tables_in_arrays(limits: &vk::PhysicalDeviceLimits) -> bool {
    limits.max_texel_buffer_elements < ENOUGH_TEXELS && most_storage_buffers(limits) > STORAGE_BUFFERS
}

/// Storage buffers that a kernel sees at most on a device.
pub(super) fn most_storage_buffers(limits: &vk::PhysicalDeviceLimits) -> u32 {
    let all = STORAGE_BUFFERS + TABLES;
    if limits.max_per_stage_descriptor_storage_buffers < all { STORAGE_BUFFERS } else { all }
}

/// What a device of Vulkan 1.2 with these features, subgroups and limits lacks.
pub(super) fn missing(
    mut features: vk::PhysicalDeviceVulkan12Features<'static>,
    subgroups: &vk::PhysicalDeviceVulkan11Properties<'_>,
    limits: &vk::PhysicalDeviceLimits,
) -> Vec<String> {
    let absent = FEATURES.into_iter().filter(|(_, of)| *of(&mut features) == vk::FALSE);
    let mut missing: Vec<_> = absent.map(|(name, _)| name.to_owned()).collect();
    if !subgroups.subgroup_supported_operations.contains(operations())
        || !subgroups.subgroup_supported_stages.contains(vk::ShaderStageFlags::COMPUTE)
    {
        missing.push("subgroup vote, arithmetic and ballot in compute shaders".to_owned());
    }
    let lanes = subgroups.subgroup_size;
    if !lanes.is_power_of_two() || !LANES.contains(&lanes) {
        let (fewest, most) = (LANES.start(), LANES.end());
        missing.push(format!("subgroups of {fewest} to {most} lanes, a power of two (it has {lanes})"));
    }
    let buffers = limits.max_per_stage_descriptor_storage_buffers;
    if buffers < STORAGE_BUFFERS {
        missing.push(format!("{STORAGE_BUFFERS} storage buffers in a shader (it has {buffers})"));
    }
    missing
}

/// What the lanes of a subgroup do together.
fn operations() -> vk::SubgroupFeatureFlags {
    vk::SubgroupFeatureFlags::BASIC
        | vk::SubgroupFeatureFlags::VOTE
        | vk::SubgroupFeatureFlags::ARITHMETIC
        | vk::SubgroupFeatureFlags::BALLOT
}

#[cfg(test)]
mod tests {
    use super::*;

    fn capable() -> (vk::PhysicalDeviceVulkan11Properties<'static>, vk::PhysicalDeviceLimits) {
        let subgroups = vk::PhysicalDeviceVulkan11Properties::default()
            .subgroup_size(8)
            .subgroup_supported_stages(vk::ShaderStageFlags::COMPUTE)
            .subgroup_supported_operations(operations());
        let limits = vk::PhysicalDeviceLimits {
            max_per_stage_descriptor_storage_buffers: STORAGE_BUFFERS,
            ..Default::default()
        };
        (subgroups, limits)
    }

    #[test]
    fn what_is_enabled_is_enough() {
        let (subgroups, limits) = capable();
        let features = features();
        assert_eq!((features.timeline_semaphore, features.subgroup_broadcast_dynamic_id), (vk::TRUE, vk::TRUE));
        assert_eq!(missing(features, &subgroups, &limits), Vec::<String>::new());
    }

    #[test]
    fn all_that_a_device_lacks_is_told() {
        let (_, mut limits) = capable();
        limits.max_per_stage_descriptor_storage_buffers = 4;
        let expected = [
            "timeline semaphores",
            "broadcasts from any lane of a subgroup",
            "subgroup vote, arithmetic and ballot in compute shaders",
            "subgroups of 4 to 128 lanes, a power of two (it has 0)",
            "5 storage buffers in a shader (it has 4)",
        ];
        assert_eq!(missing(Default::default(), &Default::default(), &limits), expected);
    }

    #[test]
    fn tables_are_arrays_where_texels_are_few_and_buffers_many() {
        let limits = |max_texel_buffer_elements, max_per_stage_descriptor_storage_buffers| vk::PhysicalDeviceLimits {
            max_texel_buffer_elements,
            max_per_stage_descriptor_storage_buffers,
            ..Default::default()
        };
        let found = [(1 << 16, 10), (1 << 16, 9), (1 << 27, 30)].map(|(t, b)| tables_in_arrays(&limits(t, b)));
        assert_eq!(found, [true, false, false]);
    }

    #[test]
    fn subgroups_have_lanes_as_vulkan_has_them() {
        let (subgroups, limits) = capable();
        let lacks = |lanes| missing(features(), &subgroups.subgroup_size(lanes), &limits).len();
        assert_eq!([4, 8, 16, 32, 64, 128].map(lacks), [0; 6]);
        assert_eq!([0, 1, 2, 12, 14, 31_250, 256].map(lacks), [1; 7]);
    }
}
