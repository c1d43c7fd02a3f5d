//! Exit codes, the same for all subcommands.

use photolith::{GpuError, RenderError};

/// Success.
pub const OK: u8 = 0;
/// A comparison or a check failed.
pub const WRONG_IMAGE: u8 = 1;
/// Usage, a bad scene, an unwritable output, too little memory.
pub const BAD_INPUT: u8 = 2;
/// No suitable Vulkan device.
pub const NO_DEVICE: u8 = 3;
/// A validation layer reported something, or the driver broke a rule.
pub const VALIDATION: u8 = 4;
/// The device was lost.
pub const DEVICE_LOST: u8 = 5;
/// Something took too long.
pub const TIMEOUT: u8 = 6;
/// Stopped by Ctrl-C (the image so far is written).
pub const INTERRUPTED: u8 = 130;

/// Shown under every help text of the program.
pub const HELP: &str = "Exit codes: 0 done, 1 an image or check is wrong, 2 usage or bad input, 3 no suitable device, \
                        4 validation message or driver fault, 5 device lost, 6 timeout, 130 interrupted (what was \
                        done is written)";

/// The exit code for an error, found in its chain of causes.
pub fn code_of(error: &anyhow::Error) -> u8 {
    for cause in error.chain() {
        if let Some(error) = cause.downcast_ref::<GpuError>() {
            return of_gpu(error);
        }
        if let Some(error) = cause.downcast_ref::<RenderError>() {
            return match error {
                RenderError::Gpu(error) => of_gpu(error),
                RenderError::Truncated { .. } => VALIDATION,
                RenderError::Stuck { .. } | RenderError::Settings(_) => BAD_INPUT,
            };
        }
    }
    BAD_INPUT
}

fn of_gpu(error: &GpuError) -> u8 {
    match error {
        GpuError::NoLoader(_)
        | GpuError::NoDevice
        | GpuError::NoSuchDevice { .. }
        | GpuError::Unsuitable { .. }
        | GpuError::NoValidationLayer => NO_DEVICE,
        GpuError::DeviceLost(_) => DEVICE_LOST,
        GpuError::Timeout { .. } => TIMEOUT,
        GpuError::TooLarge { .. } | GpuError::OutOfMemory { .. } => BAD_INPUT,
        GpuError::Call { .. } => VALIDATION,
    }
}
