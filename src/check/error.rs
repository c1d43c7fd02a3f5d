//! Why a case could not be measured.

use crate::gpu::GpuError;
use crate::render::RenderError;

/// Errors of a case. A wrong number is none: it is a verdict.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The Vulkan layer.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Rendering.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The driver does not map memory that the host writes or reads.
    #[error("the driver does not map memory for uploads and read-backs")]
    Unmapped,
    /// The device lacks what the case is about.
    #[error("not supported: the device lacks {0}")]
    NotSupported(&'static str),
    /// The case panicked.
    #[error("panicked: {0}")]
    Panic(String),
    /// No thread could be started for the case.
    #[error("no thread for the case: {0}")]
    Thread(std::io::Error),
}

impl CheckError {
    /// The Vulkan error behind it, if there is one.
    pub fn gpu(&self) -> Option<&GpuError> {
        match self {
            Self::Gpu(error) | Self::Render(RenderError::Gpu(error)) => Some(error),
            _ => None,
        }
    }
}
