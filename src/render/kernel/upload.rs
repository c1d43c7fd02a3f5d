//! Tables on their way to the device.

use std::sync::Arc;

use rayon::prelude::*;

use crate::gpu::{Access, Buffer, Device, Timeline, Usage};

use crate::render::error::RenderError;

/// Copies tables to their buffers: directly where the host sees the device's memory, else through staging buffers.
pub(crate) fn upload(
    device: &Arc<Device>,
    timeline: &mut Timeline,
    uploads: &mut [(Buffer, &[u8])],
) -> Result<(), RenderError> {
    let mut staged = Vec::new();
    for (index, (buffer, bytes)) in uploads.iter_mut().enumerate() {
        if let Some(target) = buffer.mapped_mut() {
            copy(&mut target[..bytes.len()], bytes);
        } else if !bytes.is_empty() {
            let staging = staging(device, bytes.len() as u64, |target| copy(target, bytes))?;
            staged.push((index, staging));
        }
    }
    if !staged.is_empty() {
        let ticket = timeline.submit(|r| {
            for (index, staging) in &staged {
                let (buffer, bytes) = &uploads[*index];
                r.copy(staging, 0, buffer, 0, bytes.len() as u64);
            }
            r.barrier(Access::Transfer, Access::Compute);
        })?;
        timeline.wait(&ticket)?;
    }
    Ok(())
}

/// Copies by several threads: of memory that has not been used yet, the system takes longer to give a page than to copy it.
fn copy(to: &mut [u8], from: &[u8]) {
    const CHUNK: usize = 1 << 20;
    to.par_chunks_mut(CHUNK).zip(from.par_chunks(CHUNK)).for_each(|(to, from)| to.copy_from_slice(from));
}

/// A buffer to copy from, of so many bytes, filled by `fill`.
fn staging(device: &Arc<Device>, bytes: u64, fill: impl FnOnce(&mut [u8])) -> Result<Buffer, RenderError> {
    let mut staging = Buffer::new(device, "staging", bytes, Usage::Upload)?;
    let target =
        staging.mapped_mut().ok_or_else(|| RenderError::Driver("it does not map memory for uploads".to_owned()))?;
    fill(&mut target[..bytes as usize]);
    Ok(staging)
}
