//! What can go wrong between this program and a Vulkan driver.

use std::ffi::OsString;
use std::time::Duration;

use ash::vk;

/// Errors of the Vulkan layer.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// The Vulkan loader library is not installed.
    #[error("no Vulkan loader found ({0}); install libvulkan1 and a driver, for example mesa-vulkan-drivers")]
    NoLoader(String),
    /// The loader is there, but no driver reports a device.
    #[error("no Vulkan device found; {}", how_to_get_a_device(|name| std::env::var_os(name)))]
    NoDevice,
    /// `--device` names a device that is not there.
    #[error("no Vulkan device matches '{wanted}'; there are: {known}")]
    NoSuchDevice {
        /// What was asked for.
        wanted: String,
        /// The devices that exist.
        known: String,
    },
    /// The device lacks something that photolith requires.
    #[error("device '{device}' cannot be used: it lacks {missing}")]
    Unsuitable {
        /// Name of the device.
        device: String,
        /// The features or limits that are missing.
        missing: String,
    },
    /// A validation run was asked for, but the layer is not installed.
    #[error("the validation layer VK_LAYER_KHRONOS_validation is not installed (package vulkan-validationlayers)")]
    NoValidationLayer,
    /// The device was lost: a driver crash, a hang that the driver ended, or a removed device.
    #[error("the Vulkan device was lost during {0}")]
    DeviceLost(&'static str),
    /// A wait took longer than its bound.
    #[error("the Vulkan device did not finish {what} within {} s", .limit.as_secs_f64())]
    Timeout {
        /// What was waited for.
        what: &'static str,
        /// The bound.
        limit: Duration,
    },
    /// A buffer is larger than the device allows.
    #[error("{what} needs {bytes} bytes, but device '{device}' allows {limit} in one {kind}")]
    TooLarge {
        /// Which buffer.
        what: String,
        /// Its size, bytes.
        bytes: u64,
        /// The device's limit, bytes.
        limit: u64,
        /// Storage buffer, or texel buffer.
        kind: &'static str,
        /// Name of the device.
        device: String,
    },
    /// An acceleration structure is larger than the device allows.
    #[error("an acceleration structure of {count} {what} is too large: device '{device}' allows {limit}")]
    TooManyPrimitives {
        /// Wanted.
        count: u64,
        /// Boxes or triangles.
        what: &'static str,
        /// Allowed.
        limit: u64,
        /// Which device.
        device: String,
    },
    /// A kernel that a driver does not compile in reasonable time, if ever.
    #[error("device '{device}' does not compile the kernel {kernel} within {seconds} s of CPU time")]
    CompilesTooLong {
        /// Which kernel.
        kernel: String,
        /// The time it was given.
        seconds: u64,
        /// Name of the device.
        device: String,
    },
    /// Memory could not be had, of the device or of the host.
    #[error("no memory for {what}: {reason}")]
    OutOfMemory {
        /// Which buffer, with its size, or which call.
        what: String,
        /// The allocator's or the driver's word.
        reason: String,
    },
    /// Any other failed Vulkan call.
    #[error("{call} failed: {result}")]
    Call {
        /// The Vulkan function.
        call: &'static str,
        /// Its result code.
        result: vk::Result,
    },
}

/// Variables by which the loader is told which drivers to use (Vulkan-Loader, LoaderInterfaceArchitecture.md), where they may hide all.
const DRIVER_VARIABLES: [&str; 4] =
    ["VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_LOADER_DRIVERS_SELECT", "VK_LOADER_DRIVERS_DISABLE"];

fn how_to_get_a_device(variable: impl Fn(&str) -> Option<OsString>) -> String {
    let set: Vec<String> = DRIVER_VARIABLES
        .iter()
        .filter_map(|name| Some((name, variable(name).filter(|value| !value.is_empty())?)))
        .map(|(name, value)| format!("{name}={}", value.to_string_lossy()))
        .collect();
    match set.as_slice() {
        [] => "install a driver (for example mesa-vulkan-drivers) or set VK_DRIVER_FILES".to_owned(),
        set => format!(
            "the environment has {}, which decides what drivers are looked for: unset it, name a driver's manifest that is there, or \
             install a driver (for example mesa-vulkan-drivers)",
            set.join(" and ")
        ),
    }
}

/// Names the Vulkan function of a failed call, and tells a lost device and a lack of memory apart.
pub(crate) fn check<T>(call: &'static str, result: Result<T, vk::Result>) -> Result<T, GpuError> {
    result.map_err(|result| match result {
        vk::Result::ERROR_DEVICE_LOST => GpuError::DeviceLost(call),
        vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
            GpuError::OutOfMemory { what: call.to_owned(), reason: result.to_string() }
        }
        result => GpuError::Call { call, result },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_that_hide_drivers_are_named() {
        assert!(how_to_get_a_device(|_| None).starts_with("install a driver"));
        let text = how_to_get_a_device(|name| (name == "VK_ICD_FILENAMES").then(|| "/gone.json".into()));
        assert!(text.contains("VK_ICD_FILENAMES=/gone.json") && !text.contains("VK_DRIVER_FILES"), "{text}");
    }
}
