//! Errors of benchmarks.

use std::path::PathBuf;

use crate::check::CheckError;
use crate::files::WriteError;
use crate::gpu::GpuError;
use crate::image::ImageError;
use crate::render::RenderError;

/// What can stop a benchmark.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A rendering failed.
    #[error("{what}")]
    Render {
        /// The configuration or the scene.
        what: String,
        /// Why.
        #[source]
        source: RenderError,
    },
    /// Rays could not be made or traced.
    #[error("rays of {scene}")]
    Rays {
        /// The scene.
        scene: String,
        /// Why.
        #[source]
        source: CheckError,
    },
    /// A file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A device could not be opened.
    #[error("device '{device}'")]
    Device {
        /// As it was asked for.
        device: String,
        /// Why.
        #[source]
        source: GpuError,
    },
    /// An image could not be read, written or compared.
    #[error("{what}")]
    Image {
        /// The image.
        what: String,
        /// Why.
        #[source]
        source: ImageError,
    },
    /// `KEY=VALUE,VALUE…` that is not understood.
    #[error("'{text}' cannot be varied: {problem}")]
    Vary {
        /// What was given.
        text: String,
        /// What was found and what was expected.
        problem: String,
    },
    /// A reference without a statement of its noise.
    #[error(
        "{}: the reference carries no estimate of its noise (an EXR layer 'variance'), so that errors cannot be told \
         from it; state it with --reference-noise, or let the program make a reference",
        path.display()
    )]
    UnknownNoise {
        /// The file.
        path: PathBuf,
    },
    /// A reference that says nothing about some pixels.
    #[error("{}: {count} pixel(s) of the reference are NaN or infinite, or their variance is", path.display())]
    NonFinite {
        /// The file.
        path: PathBuf,
        /// How many there are.
        count: usize,
    },
    /// The reference cannot become as exact as is wanted.
    #[error(
        "{scene}: a reference with a noise of {wanted:.3e} needs about {needed:.1e} samples per pixel, more than the {most} that \
         there are; raise --reference-noise"
    )]
    ReferenceSamples {
        /// The scene.
        scene: String,
        /// Root of the mean variance, radiance, as wanted.
        wanted: f64,
        /// Samples per pixel that it needs.
        needed: f64,
        /// Samples per pixel that there are.
        most: u64,
    },
    /// The reference does not become as exact as is wanted.
    #[error(
        "{scene}: the reference has a noise of {reached:.3e} after {samples} samples per pixel, wanted {wanted:.3e}"
    )]
    ReferenceNoise {
        /// The scene.
        scene: String,
        /// Root of the mean variance, radiance.
        reached: f64,
        /// The same, as wanted.
        wanted: f64,
        /// Samples per pixel that were spent.
        samples: u64,
    },
    /// It was asked to stop before there was a result.
    #[error("interrupted")]
    Interrupted,
    /// Nothing to measure: no samples, seeds or configurations, or an image without a finite pixel.
    #[error("{0}")]
    Settings(String),
    /// A plot could not be drawn.
    #[error("{}: {problem}", path.display())]
    Plot {
        /// The file.
        path: PathBuf,
        /// Why.
        problem: String,
    },
}
