//! Which Vulkan devices there are, what they lack, and which one is picked.

use ash::vk;
use std::ffi::CStr;

use crate::gpu::error::{GpuError, check};
use crate::gpu::instance::Instance;
use crate::gpu::ray_query;
use crate::gpu::ray_query::RayQueryLimits;
use crate::gpu::required;
use crate::gpu::subgroups;

/// What a physical device is and whether it can be used.
#[derive(Debug, Clone)]
pub struct DeviceInfo {
    /// Position in the driver's list.
    pub index: usize,
    /// The device's name.
    pub name: String,
    /// The driver's name and version text.
    pub driver: String,
    /// Which driver it is (`VkDriverId`), whatever it calls itself.
    pub driver_id: i32,
    /// Discrete, integrated, virtual or CPU.
    pub kind: DeviceKind,
    /// Vulkan version of the device, `major.minor.patch`.
    pub api_version: String,
    /// Vulkan's device UUID as 32 hex digits with dashes.
    pub uuid: String,
    /// Lanes of a subgroup.
    pub subgroup_size: u32,
    /// Whether all subgroups have that size. (Intel's GPUs may report one and run another, unless it is asked for.)
    pub same_subgroups: bool,
    /// Whether that size can be asked for.
    pub pins_subgroups: bool,
    /// Whether lanes of a subgroup can read each other's values.
    pub shuffles: bool,
    /// Bytes of the largest storage buffer binding.
    pub max_storage_range: u64,
    /// Elements of the largest texel buffer.
    pub max_texel_elements: u64,
    /// What it tells of ray queries, if it has them.
    pub ray_query: Option<RayQueryLimits>,
    /// Whether texel buffers are too small for tables, which shaders then see as arrays.
    pub tables_in_arrays: bool,
    /// Bytes of device-local memory.
    pub memory: u64,
    /// What photolith requires and the device lacks; empty if it can be used.
    pub missing: Vec<String>,
}

/// Kinds of device, best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A graphics card of its own.
    Discrete,
    /// Shares memory with the CPU.
    Integrated,
    /// A GPU inside a virtual machine.
    Virtual,
    /// A driver that runs on the CPU, such as lavapipe.
    Cpu,
    /// Anything else.
    Other,
}

impl std::fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Discrete => "discrete GPU",
            Self::Integrated => "integrated GPU",
            Self::Virtual => "virtual GPU",
            Self::Cpu => "CPU",
            Self::Other => "other",
        })
    }
}

/// Raw handles, descriptions, in the driver's order.
pub(crate) fn enumerate(instance: &Instance) -> Result<Vec<(vk::PhysicalDevice, DeviceInfo)>, GpuError> {
    // SAFETY: plain enumeration on a live instance.
    let devices = check("vkEnumeratePhysicalDevices", unsafe { instance.raw.enumerate_physical_devices() })?;
    Ok(devices.into_iter().enumerate().map(|(i, device)| (device, describe(instance, device, i))).collect())
}

fn describe(instance: &Instance, device: vk::PhysicalDevice, index: usize) -> DeviceInfo {
    let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
    let mut v12 = vk::PhysicalDeviceVulkan12Properties::default();
    let mut f12 = vk::PhysicalDeviceVulkan12Features::default();
    // SAFETY: `device` comes from this instance; the structures below are chained to live values.
    let (basic, memory) = unsafe {
        (
            instance.raw.get_physical_device_properties(device),
            instance.raw.get_physical_device_memory_properties(device),
        )
    };
    let mut missing = Vec::new();
    let mut ray_query = None;
    let at_least_12 = basic.api_version >= vk::API_VERSION_1_2;
    if at_least_12 {
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut v11).push_next(&mut v12);
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut f12);
        // SAFETY: as above; the 1.2 structures are known to a 1.2 device.
        unsafe {
            instance.raw.get_physical_device_properties2(device, &mut properties);
            instance.raw.get_physical_device_features2(device, &mut features);
        }
        ray_query = ray_query::limits(instance, device, &f12);
        missing = required::missing(f12, &v11, &basic.limits);
    } else {
        missing.push("Vulkan 1.2".to_owned());
    }
    if compute_queue_family(instance, device).is_none() {
        missing.push("a compute queue".to_owned());
    }
    let pins_subgroups = at_least_12 && subgroups::can_be_pinned(instance, device, v11.subgroup_size);
    let text = |text: Result<&CStr, _>| text.ok().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let (driver_name, mut driver_info) = (text(v12.driver_name_as_c_str()), text(v12.driver_info_as_c_str()));
    if driver_info.is_empty() && v12.driver_id == vk::DriverId::GOOGLE_SWIFTSHADER {
        driver_info = dotted(basic.driver_version);
    }
    let driver = format!("{driver_name} {driver_info}").trim().to_owned();
    DeviceInfo {
        index,
        name: basic.device_name_as_c_str().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default(),
        driver,
        driver_id: v12.driver_id.as_raw(),
        kind: match basic.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
            vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
            _ => DeviceKind::Other,
        },
        api_version: dotted(basic.api_version),
        uuid: format_uuid(&v11.device_uuid),
        subgroup_size: v11.subgroup_size,
        same_subgroups: pins_subgroups
            || basic.device_type == vk::PhysicalDeviceType::CPU
            || subgroups::have_one_size(instance, device),
        pins_subgroups,
        shuffles: v11.subgroup_supported_operations.contains(vk::SubgroupFeatureFlags::SHUFFLE),
        max_storage_range: u64::from(basic.limits.max_storage_buffer_range),
        max_texel_elements: u64::from(basic.limits.max_texel_buffer_elements),
        ray_query,
        tables_in_arrays: required::tables_in_arrays(&basic.limits),
        memory: memory
            .memory_heaps_as_slice()
            .iter()
            .filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
            .map(|h| h.size)
            .sum(),
        missing,
    }
}

/// A version as Vulkan packs it, in words.
fn dotted(version: u32) -> String {
    let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
    format!("{major}.{minor}.{}", vk::api_version_patch(version))
}

fn format_uuid(bytes: &[u8; 16]) -> String {
    let hex: String = bytes.iter().map(|b| format!("{b:02x}")).collect();
    [&hex[0..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..32]].join("-")
}

/// A queue family that computes; one without graphics first, since it is free of other work.
pub(crate) fn compute_queue_family(instance: &Instance, device: vk::PhysicalDevice) -> Option<u32> {
    // SAFETY: `device` comes from this instance.
    let families = unsafe { instance.raw.get_physical_device_queue_family_properties(device) };
    let find = |avoid: vk::QueueFlags| {
        families
            .iter()
            .position(|f| f.queue_flags.contains(vk::QueueFlags::COMPUTE) && !f.queue_flags.intersects(avoid))
    };
    find(vk::QueueFlags::GRAPHICS).or_else(|| find(vk::QueueFlags::empty())).map(|i| i as u32)
}

/// A name in lower case, without the width of vectors that is in a CPU driver's, as in "llvmpipe (LLVM 15.0.6, 256 bits)": that
/// changes with what is rendered.
fn comparable(name: &str) -> String {
    [128, 256, 512].iter().fold(name.to_lowercase(), |name, width| name.replace(&format!("{width} bits"), "bits"))
}

/// Picks a device and says why.
///
/// `wanted` is an index, a UUID, or part of a name (any case); a number is an index only. Without it: usable devices only, discrete before
/// integrated before virtual before CPU, then the driver's order (which `MESA_VK_DEVICE_SELECT` changes).
pub(crate) fn pick(devices: &[DeviceInfo], wanted: Option<&str>) -> Result<(usize, String), GpuError> {
    if devices.is_empty() {
        return Err(GpuError::NoDevice);
    }
    let (index, reason) = match wanted {
        Some(text) => {
            let text = text.trim();
            let name = comparable(text);
            let found = match text.parse::<usize>() {
                Ok(index) => Some(index).filter(|&i| i < devices.len()),
                Err(_) => devices
                    .iter()
                    .position(|d| d.uuid == name || d.uuid.replace('-', "") == name)
                    .or_else(|| devices.iter().position(|d| !name.is_empty() && comparable(&d.name).contains(&name))),
            };
            let index = found.ok_or_else(|| GpuError::NoSuchDevice {
                wanted: text.to_owned(),
                known: devices.iter().map(|d| format!("{}: {}", d.index, d.name)).collect::<Vec<_>>().join(", "),
            })?;
            (index, format!("asked for as '{text}'"))
        }
        None => {
            let usable = |d: &&DeviceInfo| d.missing.is_empty();
            let best = devices.iter().filter(usable).min_by_key(|d| (d.kind, d.index));
            match best {
                Some(d) if devices.len() == 1 => (d.index, format!("the only device ({})", d.kind)),
                Some(d) => (d.index, format!("the first {} among {} devices", d.kind, devices.len())),
                None => (0, String::new()),
            }
        }
    };
    let device = &devices[index];
    if !device.missing.is_empty() {
        return Err(GpuError::Unsuitable { device: device.name.clone(), missing: device.missing.join(", ") });
    }
    Ok((index, reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(index: usize, name: &str, kind: DeviceKind) -> DeviceInfo {
        DeviceInfo {
            index,
            name: name.to_owned(),
            driver: String::new(),
            driver_id: 0,
            kind,
            api_version: "1.3.0".to_owned(),
            uuid: format_uuid(&[index as u8; 16]),
            subgroup_size: 8,
            same_subgroups: true,
            pins_subgroups: false,
            shuffles: false,
            max_storage_range: 1 << 27,
            max_texel_elements: 1 << 27,
            ray_query: None,
            tables_in_arrays: false,
            memory: 1 << 30,
            missing: Vec::new(),
        }
    }

    #[test]
    fn prefers_real_gpus_and_finds_by_index_name_and_uuid() {
        let mut all = vec![
            device(0, "llvmpipe (LLVM 15.0.6, 256 bits)", DeviceKind::Cpu),
            device(1, "Intel Iris", DeviceKind::Integrated),
            device(2, "GeForce", DeviceKind::Discrete),
        ];
        assert_eq!(pick(&all, None).unwrap().0, 2);
        assert_eq!(pick(&all, Some("0")).unwrap().0, 0);
        assert_eq!(pick(&all, Some("LLVM")).unwrap().0, 0);
        assert_eq!(pick(&all, Some(&all[1].uuid)).unwrap().0, 1);
        for name in ["llvmpipe (LLVM 15.0.6, 512 bits)", "256 bits", " llvmpipe "] {
            assert_eq!(pick(&all, Some(name)).unwrap().0, 0, "{name}");
        }
        for nothing in ["15", "256", " ", ""] {
            assert!(matches!(pick(&all, Some(nothing)), Err(GpuError::NoSuchDevice { .. })), "{nothing}");
        }
        assert!(matches!(pick(&all, Some("radeon")), Err(GpuError::NoSuchDevice { .. })));
        assert!(matches!(pick(&all, Some("7")), Err(GpuError::NoSuchDevice { .. })));
        all[2].missing.push("Vulkan 1.2".to_owned());
        assert_eq!(pick(&all, None).unwrap().0, 1);
        assert!(matches!(pick(&all, Some("2")), Err(GpuError::Unsuitable { .. })));
        assert!(matches!(pick(&[], None), Err(GpuError::NoDevice)));
    }
}
