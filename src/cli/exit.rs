//! Exit codes, the same for all subcommands.

use std::process::ExitCode;

use photolith::check::CheckError;
use photolith::{GpuError, RenderError};

use super::output;

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
/// Stopped by Ctrl-C (what was done is written).
pub const INTERRUPTED: u8 = 130;

/// Shown under every help text of the program.
pub const HELP: &str = "Exit codes: 0 done, 1 an image or check is wrong, 2 usage, bad input or too little memory, 3 no suitable device, \
                        4 validation message or driver fault, 5 device lost, 6 timeout, 130 interrupted (what was \
                        done is written)";

/// Context of an error: validation was asked for, but does not work.
#[derive(Debug, thiserror::Error)]
#[error("validation cannot be trusted")]
pub struct Deaf;

/// How a command ends that has come to `code`, and to this in writing what it was to write: that is told beside something graver.
///
/// # Errors
/// What could not be written, if all else is well.
pub fn with(code: u8, written: anyhow::Result<()>) -> anyhow::Result<ExitCode> {
    match written {
        Err(error) if code != OK => output::tell(&format!("{error:#}")),
        written => written?,
    }
    Ok(ExitCode::from(code))
}

/// The exit code for an error, found in its chain of causes.
pub fn code_of(error: &anyhow::Error) -> u8 {
    if error.downcast_ref::<Deaf>().is_some() {
        return VALIDATION;
    }
    for cause in error.chain() {
        if let Some(error) = cause.downcast_ref::<GpuError>() {
            return of_gpu(error);
        }
        if let Some(error) = cause.downcast_ref::<RenderError>() {
            return of_render(error);
        }
        match cause.downcast_ref::<CheckError>() {
            Some(CheckError::Gpu(error)) => return of_gpu(error),
            Some(CheckError::Render(error)) => return of_render(error),
            _ => {}
        }
    }
    BAD_INPUT
}

fn of_render(error: &RenderError) -> u8 {
    match error {
        RenderError::Gpu(error) => of_gpu(error),
        RenderError::Truncated { .. } | RenderError::Driver(_) => VALIDATION,
        RenderError::Stuck { .. } | RenderError::Thread(_) | RenderError::Scene(_) | RenderError::Settings(_) => {
            BAD_INPUT
        }
    }
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
        GpuError::TooLarge { .. }
        | GpuError::TooManyPrimitives { .. }
        | GpuError::CompilesTooLong { .. }
        | GpuError::OutOfMemory { .. } => BAD_INPUT,
        GpuError::Call { .. } => VALIDATION,
    }
}
