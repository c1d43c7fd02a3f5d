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
    /// The device lacks what the case asks for.
    #[error("{0}")]
    NotSupported(String),
    /// The case panicked.
    #[error("panicked: {0}")]
    Panic(String),
    /// No thread could be started for the case.
    #[error("no thread for the case: {0}")]
    Thread(std::io::Error),
}

impl CheckError {
    /// Whether the device lacks something, or allows less of it than the case needs: that tells nothing of how exact it is.
    pub fn is_lack(&self) -> bool {
        let is_limit = |error: &GpuError| matches!(error, GpuError::TooLarge { .. } | GpuError::CompilesTooLong { .. });
        matches!(self, Self::NotSupported(_)) || self.gpu().is_some_and(is_limit)
    }

    /// The Vulkan error behind it, if there is one.
    pub fn gpu(&self) -> Option<&GpuError> {
        match self {
            Self::Gpu(error) | Self::Render(RenderError::Gpu(error)) => Some(error),
            _ => None,
        }
    }
}
