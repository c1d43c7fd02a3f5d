//! The SPIR-V of the path tracer's kernels.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use crate::gpu::words_of;

use super::aliased::declare_aliased;
use super::error::RenderError;
use super::settings::RenderSettings;

/// How rays that need the tree are scheduled, once that is decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Schedule {
    /// A lane walks the tree where a ray arises.
    Inline,
    /// Lanes whose rays are done go on while others walk.
    Turns,
    /// Rays wait, and a subgroup walks the tree with many.
    Queue,
}

/// A kernel: its name, and its SPIR-V.
pub(crate) struct Kernel {
    pub name: &'static str,
    pub spirv: &'static [u8],
}

/// Traces rays where they arise (shaders/path_trace.comp).
const PATH_TRACE: Kernel =
    Kernel { name: "path_trace", spirv: include_bytes!(concat!(env!("OUT_DIR"), "/path_trace.spv")) };
/// Shades and walks in turns (shaders/path_turns.comp).
const PATH_TURNS: Kernel =
    Kernel { name: "path_turns", spirv: include_bytes!(concat!(env!("OUT_DIR"), "/path_turns.spv")) };
/// Lets rays wait for the tree (shaders/path_queue.comp).
const PATH_QUEUE: Kernel =
    Kernel { name: "path_queue", spirv: include_bytes!(concat!(env!("OUT_DIR"), "/path_queue.spv")) };

/// Traces light from lamps (shaders/light_trace.comp).
pub(crate) const LIGHT_TRACE: Kernel =
    Kernel { name: "light_trace", spirv: include_bytes!(concat!(env!("OUT_DIR"), "/light_trace.spv")) };

/// Traces rays and nothing else, for `bench --rays` (shaders/probe/traverse.comp).
pub(crate) const TRAVERSE: Kernel =
    Kernel { name: "traverse", spirv: include_bytes!(concat!(env!("OUT_DIR"), "/traverse.spv")) };

/// All that trace paths.
#[cfg(test)]
pub(crate) const PATH_KERNELS: [Kernel; 3] = [PATH_TRACE, PATH_TURNS, PATH_QUEUE];

/// The kernel of a scheduler.
pub(crate) const fn built_in(schedule: Schedule) -> Kernel {
    match schedule {
        Schedule::Inline => PATH_TRACE,
        Schedule::Turns => PATH_TURNS,
        Schedule::Queue => PATH_QUEUE,
    }
}

/// The names of kernels that may be in the folder of the settings.
const NAMES: [&str; 5] = [PATH_TRACE.name, PATH_TURNS.name, PATH_QUEUE.name, LIGHT_TRACE.name, TRAVERSE.name];

fn file_of(kernel: &str, folder: &Path) -> PathBuf {
    folder.join(kernel).with_extension("spv")
}

/// The SPIR-V of a kernel: the caller's, if there is one in the folder of the settings, else the built-in one. The caller's need not
/// say which variables are the same memory.
///
/// # Errors
/// The folder has no kernel at all (its name may be mistyped), or a file that cannot be read or is no SPIR-V.
pub(crate) fn spirv(kernel: &Kernel, settings: &RenderSettings) -> Result<Cow<'static, [u8]>, RenderError> {
    let Some(folder) = &settings.spirv_folder else { return Ok(Cow::Borrowed(kernel.spirv)) };
    if !NAMES.iter().any(|name| file_of(name, folder).exists()) {
        let (folder, files) = (folder.display(), NAMES.join(".spv, "));
        return Err(RenderError::Settings(format!("{folder}: no shader is there, expected one of {files}.spv")));
    }
    let path = file_of(kernel.name, folder);
    if !path.exists() {
        log::info!("{}: not there, the built-in shader is used", path.display());
        return Ok(Cow::Borrowed(kernel.spirv));
    }
    log::info!("{}: used instead of the built-in shader", path.display());
    let bytes = std::fs::read(&path).map_err(|e| RenderError::Settings(format!("{}: {e}", path.display())))?;
    // The magic number of the SPIR-V specification, section 2.3.
    if bytes.len() < 20 || bytes.len() % 4 != 0 || bytes[..4] != 0x0723_0203u32.to_le_bytes() {
        return Err(RenderError::Settings(format!("{}: not a SPIR-V module", path.display())));
    }
    Ok(Cow::Owned(declare_aliased(&words_of(&bytes)).into_iter().flat_map(u32::to_le_bytes).collect()))
}
