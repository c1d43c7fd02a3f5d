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
    #[error("{}", stuck(*budget))]
    Stuck {
        /// The budget; 0: none.
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

fn stuck(budget: u32) -> String {
    let found = match budget {
        0 => "no sample was finished: the driver ends loops after so many iterations, and there is no loop budget to stay below that".to_owned(),
        _ => format!("no sample fits into the loop budget of {budget} iterations: its rays come near more surfaces than that"),
    };
    format!(
        "{found}. lavapipe before Mesa 23.1 ends all loops after 65,535 iterations: there only a newer driver helps, or fewer surfaces that \
         overlap, or a lower max_depth where there are mirrors or glass; other drivers can be given a larger budget"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stuck_is_told_what_helps() {
        let text = |budget| RenderError::Stuck { budget }.to_string();
        assert!(
            text(50_000).contains("loop budget of 50000 iterations") && text(50_000).contains("65,535"),
            "{}",
            text(50_000)
        );
        assert!(!text(0).contains(" 0 ") && text(0).contains("no loop budget"), "{}", text(0));
    }
}
