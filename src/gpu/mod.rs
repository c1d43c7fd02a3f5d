//! Vulkan by hand: instance, device, memory, pipelines and submissions. Knows nothing of rendering.

mod binaries;
mod bindings;
mod buffer;
mod device;
mod error;
mod instance;
mod messages;
mod pipeline;
mod prune;
mod reconvergence;
mod required;
mod select;
mod shader_cache;
mod shader_objects;
mod spares;
mod spirv_check;
mod submit;
mod timestamps;
mod violation;

pub(crate) use bindings::{BindingKind, BindingLayout, BindingSet};
pub(crate) use buffer::{Buffer, Usage};
pub(crate) use device::Device;
pub use device::{Context, ContextOptions};
pub use error::GpuError;
pub use instance::Validation;
pub use messages::Messages;
pub(crate) use pipeline::Pipeline;
pub use pipeline::Specialization;
pub use select::{DeviceInfo, DeviceKind};
pub use shader_cache::separate_caches_by_width;
pub use spirv_check::check_spirv;
pub use submit::StageTime;
pub(crate) use submit::{Access, Ticket, Timeline};
pub use violation::Violation;
