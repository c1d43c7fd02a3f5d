//! Vulkan by hand: instance, device, memory, pipelines and submissions. Knows nothing of rendering.

pub(crate) mod pipeline_pool;

mod binaries;
mod bindings;
mod buffer;
mod capture;
mod code;
mod device;
mod error;
mod instance;
mod loops;
mod messages;
mod pipeline;
mod prune;
mod raw_pipeline;
mod reconvergence;
mod required;
mod select;
mod shader_cache;
mod shader_objects;
mod specialization;
mod spirv_check;
mod subgroups;
mod submit;
mod timestamps;
mod trial;
mod violation;

pub(crate) use crate::gpu::bindings::{BindingKind, BindingLayout, BindingSet};
pub(crate) use crate::gpu::buffer::{Buffer, Usage};
pub use crate::gpu::capture::{Capture, CapturedBuffer, CapturedShader};
pub(crate) use crate::gpu::device::Device;
pub use crate::gpu::device::{Context, ContextOptions};
pub use crate::gpu::error::GpuError;
pub use crate::gpu::instance::Validation;
pub(crate) use crate::gpu::loops::loop_limit;
pub use crate::gpu::messages::Messages;
pub(crate) use crate::gpu::pipeline::Pipeline;
pub use crate::gpu::select::{DeviceInfo, DeviceKind};
pub use crate::gpu::shader_cache::separate_caches_by_width;
pub use crate::gpu::specialization::Specialization;
pub use crate::gpu::spirv_check::check_spirv;
pub use crate::gpu::submit::StageTime;
pub(crate) use crate::gpu::submit::{Access, Recorder, Ticket, Timeline};
pub use crate::gpu::violation::Violation;
