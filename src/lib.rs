//! photolith: a headless Vulkan path tracer.
//!
//! A [`Scene`] is loaded from a file or built in code; a [`Context`] is an open Vulkan device; a [`Renderer`] holds a
//! scene on the device, specialised for what the scene needs, and renders it under [`RenderSettings`] into a [`Film`]
//! of exact sums, which becomes an [`Image`].
//!
//! ```
//! use std::ops::ControlFlow;
//! use photolith::{Context, ContextOptions, Image, RenderSettings, Renderer, Scene};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = r#"
//!     version = 1
//!     [camera]
//!     position = [0, 0, 5]
//!     target = [0, 0, 0]
//!     horizontal_fov = 40
//!     [film]
//!     width = 32
//!     height = 32
//!     [background]
//!     radiance = [1, 1, 1]
//!     [[material]]
//!     name = "grey"
//!     type = "diffuse"
//!     reflectance = [0.5, 0.5, 0.5]
//!     [[sphere]]
//!     center = [0, 0, 0]
//!     radius = 1
//!     material = "grey"
//! "#;
//! let scene = Scene::from_toml_str(text, "example", None)?.scene;
//! let context = Context::new(&ContextOptions::default())?;
//! let settings = RenderSettings { samples: 4, ..RenderSettings::of(&scene) };
//! let mut renderer = Renderer::new(&context, &scene, &settings)?;
//! let film = renderer.render(|_| ControlFlow::Continue(()))?;
//! let image = Image::from_pixels(film.width(), film.height(), film.mean())?;
//! // A convex grey body under a white sky reflects exactly half of it.
//! let middle = image.pixel(16, 16).ok_or("no such pixel")?;
//! assert!((middle[0] - 0.5).abs() < 1e-6);
//! # Ok(())
//! # }
//! ```

#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

pub mod accel;
pub mod bench;
mod cache;
pub mod check;
pub mod files;
mod ggx_albedo;
mod glass_albedo;
pub mod gpu;
mod hash;
pub mod host;
pub mod image;
#[cfg(test)]
mod layers;
pub mod oracle;
pub mod render;
pub mod scene;
mod spirv;

pub use crate::cache::user_cache;
pub use crate::gpu::{Context, ContextOptions, GpuError, Validation};
pub use crate::image::Image;
pub use crate::render::{Film, RenderError, RenderSettings, Renderer};
pub use crate::scene::Scene;
