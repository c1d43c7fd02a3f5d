//! The SPIR-V of the path tracer's kernels.

pub(crate) mod aliased;
pub(crate) mod bindings;
pub(crate) mod driver_traits;
pub(crate) mod features;
pub(crate) mod layout;
#[cfg(test)]
pub(crate) mod layout_tests;
pub(crate) mod sobol;
pub(crate) mod specialization;
pub(crate) mod upload;

use std::borrow::Cow;
use std::hash::Hasher;
use std::path::{Path, PathBuf};

use crate::files::read_regular;
use crate::gpu::{GpuError, check_spirv};
use crate::hash::Fnv;
use crate::spirv::words_of;

use crate::render::error::RenderError;
use crate::render::kernel::aliased::declare_aliased;
use crate::render::settings::RenderSettings;

/// How rays that need the BVH are scheduled, once that is decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Schedule {
    /// A lane traverses the BVH where a ray arises.
    Inline,
    /// Lanes whose rays are done go on while others traverse the BVH.
    Interleaved,
    /// Rays wait, and a subgroup traverses the BVH with many.
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
/// Lanes shade while others traverse the BVH (shaders/path_interleaved.comp).
const PATH_INTERLEAVED: Kernel =
    Kernel { name: "path_interleaved", spirv: include_bytes!(concat!(env!("OUT_DIR"), "/path_interleaved.spv")) };
/// Lets rays wait for the BVH (shaders/path_queue.comp).
const PATH_QUEUE: Kernel =
    Kernel { name: "path_queue", spirv: include_bytes!(concat!(env!("OUT_DIR"), "/path_queue.spv")) };

/// Traces light from emitters (shaders/light_trace.comp).
pub(crate) const LIGHT_TRACE: Kernel =
    Kernel { name: "light_trace", spirv: include_bytes!(concat!(env!("OUT_DIR"), "/light_trace.spv")) };

/// Finds what the camera sees first (shaders/first_hit.comp).
pub(crate) const FIRST_HIT: Kernel =
    Kernel { name: "first_hit", spirv: include_bytes!(concat!(env!("OUT_DIR"), "/first_hit.spv")) };

/// Traces rays and nothing else, for `bench --rays` (shaders/probe/traverse.comp).
pub(crate) const TRAVERSE: Kernel =
    Kernel { name: "traverse", spirv: include_bytes!(concat!(env!("OUT_DIR"), "/traverse.spv")) };

/// All that trace paths.
#[cfg(test)]
pub(crate) const PATH_KERNELS: [Kernel; 3] = [PATH_TRACE, PATH_INTERLEAVED, PATH_QUEUE];

/// The kernel of a scheduler.
pub(crate) const fn built_in(schedule: Schedule) -> Kernel {
    match schedule {
        Schedule::Inline => PATH_TRACE,
        Schedule::Interleaved => PATH_INTERLEAVED,
        Schedule::Queue => PATH_QUEUE,
    }
}

/// A number that tells the built-in shaders apart from those of another build.
pub fn shaders_hash() -> u64 {
    let mut hash = Fnv::default();
    [PATH_TRACE, PATH_INTERLEAVED, PATH_QUEUE, LIGHT_TRACE, FIRST_HIT]
        .iter()
        .for_each(|kernel| hash.write(kernel.spirv));
    hash.finish()
}

/// The names of kernels that may be in the folder of the settings.
const NAMES: [&str; 6] =
    [PATH_TRACE.name, PATH_INTERLEAVED.name, PATH_QUEUE.name, LIGHT_TRACE.name, FIRST_HIT.name, TRAVERSE.name];

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
    let fail = |problem: &dyn std::fmt::Display| RenderError::Settings(format!("{}: {problem}", path.display()));
    let bytes = read_regular(&path).map_err(|error| fail(&error))?;
    if bytes.len() % 4 != 0 {
        return Err(fail(&format!("not a SPIR-V module: {} bytes, expected words of four", bytes.len())));
    }
    let words = words_of(&bytes);
    check_spirv(&words).map_err(|problem| fail(&problem))?;
    Ok(Cow::Owned(declare_aliased(&words).into_iter().flat_map(u32::to_le_bytes).collect()))
}

/// What went wrong in making a pipeline: a driver that cannot do anything with the caller's shader is not at fault.
pub(crate) fn not_made(kernel: &Kernel, settings: &RenderSettings, error: GpuError) -> RenderError {
    let path = settings.spirv_folder.as_deref().map(|folder| file_of(kernel.name, folder)).filter(|path| path.exists());
    match (path, error) {
        (Some(path), error @ GpuError::Call { .. }) => {
            RenderError::Settings(format!("{}: the driver does not take this shader: {error}", path.display()))
        }
        (_, error) => error.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_modules_and_other_shaders_are_refused() {
        for kernel in [PATH_TRACE, PATH_INTERLEAVED, PATH_QUEUE, LIGHT_TRACE, FIRST_HIT, TRAVERSE] {
            let words = words_of(kernel.spirv);
            assert_eq!(check_spirv(&words), Ok(()), "{}", kernel.name);
            for cut in [1, 2, 3, 1000] {
                assert!(check_spirv(&words[..words.len() - cut]).unwrap_err().contains("damaged"), "{cut} words less");
            }
            let mut graphics = words.clone();
            let model = graphics.windows(4).position(|w| w[0] & 0xffff == 15 && w[1] == 5).unwrap();
            graphics[model + 1] = 4;
            assert!(check_spirv(&graphics).unwrap_err().contains("no compute shader"));
        }
        assert!(check_spirv(&[0; 5]).is_err());
    }
}
