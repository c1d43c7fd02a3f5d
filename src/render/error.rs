//! Errors of rendering.

use crate::gpu::GpuError;
use crate::scene::SceneError;

/// What can stop a rendering.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The Vulkan layer.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The driver ended loops that the shader did not end: the image would be biased.
    #[error(
        "the driver cut {count} loops short (some drivers bound the iterations of an invocation); \
         set a loop budget below its limit"
    )]
    Truncated {
        /// Invocations that were cut.
        count: u64,
    },
    /// The driver broke a rule of Vulkan in some other way.
    #[error("the driver is at fault: {0}")]
    Driver(String),
    /// Dispatches over the whole image finished no sample, so that no further ones would either.
    #[error("no sample fits into the loop budget of {budget} iterations; lower max_depth or raise the budget")]
    Stuck {
        /// The budget.
        budget: u32,
    },
    /// No thread could be started to make buffers or pipelines.
    #[error("no thread could be started: {0}")]
    Thread(#[source] std::io::Error),
    /// A scene that cannot be rendered, see [`Scene::validate`](crate::Scene::validate).
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// Settings that make no sense.
    #[error("{0}")]
    Settings(String),
}
