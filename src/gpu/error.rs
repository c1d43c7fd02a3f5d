//! What can go wrong between this program and a Vulkan driver.

use std::time::Duration;

use ash::vk;

/// Errors of the Vulkan layer.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// The Vulkan loader library is not installed.
    #[error("no Vulkan loader found ({0}); install libvulkan1 and a driver, for example mesa-vulkan-drivers")]
    NoLoader(String),
    /// The loader is there, but no driver reports a device.
    #[error("no Vulkan device found; install a driver (for example mesa-vulkan-drivers) or set VK_DRIVER_FILES")]
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
