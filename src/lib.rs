//! photolith: a headless Vulkan path tracer.

pub mod accel;
pub mod gpu;
pub mod image;
pub mod oracle;
pub mod render;
pub mod scene;

pub use scene::Scene;
