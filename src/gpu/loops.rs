//! After how many iterations a driver ends loops, found by trying.
//!
//! Some versions of lavapipe silently end all loops of an invocation after 65,535 iterations. No version number and no limit
//! of Vulkan says which do.

use std::sync::Arc;

use crate::gpu::binaries::BinaryStore;
use crate::gpu::bindings::{BindingLayout, BindingSet, Resource};
use crate::gpu::buffer::{Buffer, Usage};
use crate::gpu::device::Device;
use crate::gpu::error::GpuError;
use crate::gpu::kept_layout::BindingKind;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::select::DeviceKind;
use crate::gpu::specialization::Specialization;
use crate::gpu::submit::{Access, Timeline};

const SPIRV: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/loop_limit.spv"));
/// Iterations that are tried: more than a counter of 16 bits has.
const WANTED: u32 = 70_000;
/// Invocations, 16 bytes each: a workgroup of shaders/device/loop_limit.comp.
const INVOCATIONS: usize = 64;

/// Iterations after which a driver on the CPU ends loops; `None` if it does not, or the device is no CPU: there a watchdog would
/// end the device's work, and nothing is known to end loops. It is tried once, and the answer kept beside the shaders.
///
/// # Errors
/// A Vulkan call fails.
pub(crate) fn loop_limit(device: &Arc<Device>) -> Result<Option<u32>, GpuError> {
    if device.info.kind != DeviceKind::Cpu {
        return Ok(None);
    }
    if let Some(known) = device.loop_limit.get() {
        return Ok(*known);
    }
    let store = device.shader_folder.as_deref().map(BinaryStore::new);
    let identity =
        format!("loops {WANTED}, {}, {}, {} lanes", device.info.name, device.info.driver, device.info.subgroup_size);
    let kept = store.as_ref().and_then(|store| store.load(identity.as_bytes())?.try_into().ok());
    let done = match kept {
        Some(bytes) => u32::from_le_bytes(bytes),
        None => {
            let done = count(device)?;
            if let Some(store) = &store {
                store.keep(identity.as_bytes(), &done.to_le_bytes());
            }
            done
        }
    };
    let limit = (done < WANTED).then_some(done);
    log::debug!("loops end after {done} of {WANTED} iterations");
    Ok(*device.loop_limit.get_or_init(|| limit))
}

/// The fewest iterations that an invocation did.
fn count(device: &Arc<Device>) -> Result<u32, GpuError> {
    let bytes = 16 * INVOCATIONS as u64;
    let layout = BindingLayout::new(device, &[(0, BindingKind::Array)], 4)?;
    let counted = Buffer::new(device, "loop iterations", bytes, Usage::Storage)?;
    let readback = Buffer::new(device, "loop iterations, read", bytes, Usage::Readback)?;
    let set = BindingSet::new(&layout, &[(0, Resource::Buffer(&counted))])?;
    let pipeline = Pipeline::new(device, "loop_limit", SPIRV, &Specialization::default(), &layout)?;
    // Dropped before what it uses, since it waits for the device.
    let mut timeline = Timeline::new(device, 1)?;
    let ticket = timeline.submit(|r| {
        r.dispatch(&pipeline, &set, &WANTED.to_le_bytes(), [1, 1, 1]);
        r.barrier(Access::Compute, Access::Transfer);
        r.copy(&counted, 0, &readback, 0, bytes);
        r.barrier(Access::Transfer, Access::Host);
    })?;
    timeline.wait(&ticket)?;
    let words = readback.mapped().unwrap_or_default().chunks_exact(16).take(INVOCATIONS);
    // Without mapped memory nothing else works either; that is told where it is needed.
    Ok(words.map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).min().unwrap_or(WANTED))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::device::{Context, ContextOptions};

    #[test]
    fn the_limit_is_found_and_kept() {
        let folder = tempfile::tempdir().unwrap();
        let options = ContextOptions { shader_folder: Some(folder.path().to_owned()), ..ContextOptions::default() };
        let limit = || loop_limit(&Context::new(&options).unwrap().0).unwrap();
        let found = limit();
        assert!(found.is_none_or(|limit| (1000..WANTED).contains(&limit)), "{found:?}");
        // A second start reads what the first has kept.
        let files = std::fs::read_dir(folder.path()).unwrap().count();
        assert!(files > 0);
        assert_eq!(limit(), found);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), files);
    }
}
