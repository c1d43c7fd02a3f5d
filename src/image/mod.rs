//! Images of linear radiance: files (PNG, OpenEXR, Radiance HDR, PFM) and error metrics.
//!
//! [`write()`] and [`read`] choose the format by the file name's extension; [`metrics::compare`] measures
//! one image against a reference. Nothing here knows of the GPU.

mod buffer;
mod codec;
mod error;
mod file;
mod format;
pub mod heatmap;
mod layers;
mod metadata;
pub mod metrics;
mod tone;
mod transfer;

pub use crate::image::buffer::{Image, MAX_SIDE, Variance};
pub use crate::image::error::ImageError;
pub use crate::image::file::{Written, check_writable, encode, read, write, write_as};
pub use crate::image::format::Format;
pub use crate::image::layers::{ImageLayers, LayerValues, write_layers};
pub use crate::image::metadata::Metadata;
pub use crate::image::tone::auto_exposure;
