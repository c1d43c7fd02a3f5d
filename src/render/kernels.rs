//! The SPIR-V of the path tracer's kernels, each built for several numbers of constant spheres and facets (build.rs).

use std::borrow::Cow;

use super::error::RenderError;
use super::features::Features;
use super::settings::RenderSettings;

/// A kernel: its name, and its SPIR-V.
pub(crate) struct Kernel {
    pub name: &'static str,
    pub spirv: &'static [u8],
}

macro_rules! variant {
    ($stem:literal, $spheres:literal, $facets:literal, $tree:literal) => {
        include_bytes!(concat!(env!("OUT_DIR"), "/", $stem, "_s", $spheres, "_f", $facets, "_t", $tree, ".spv"))
    };
}

macro_rules! variants {
    ($stem:literal, $tree:literal) => {
        [
            [variant!($stem, 0, 0, $tree), variant!($stem, 0, 16, $tree), variant!($stem, 0, 32, $tree)],
            [variant!($stem, 8, 0, $tree), variant!($stem, 8, 16, $tree), variant!($stem, 8, 32, $tree)],
            [variant!($stem, 16, 0, $tree), variant!($stem, 16, 16, $tree), variant!($stem, 16, 32, $tree)],
        ]
    };
}

/// By room for spheres (none, 8, 16) and for facets (none, 16, 32).
type Variants = [[&'static [u8]; 3]; 3];

static PATH_TRACE: Variants = variants!("path_trace", 0);
static PATH_TRACE_TREE: Variants = variants!("path_trace", 1);
static PATH_TRACE_BRUTE_FORCE: Variants = variants!("path_trace", 2);
static PATH_QUEUE: Variants = variants!("path_queue", 1);

/// The kernel with the least room that suffices. `general`: the one with the most.
pub(crate) fn choose(features: &Features, queued: bool, general: bool) -> Kernel {
    let (name, all) = match (queued, features.tree) {
        (true, _) => ("path_queue", &PATH_QUEUE),
        (false, true) if features.brute_force => ("path_trace", &PATH_TRACE_BRUTE_FORCE),
        (false, true) => ("path_trace", &PATH_TRACE_TREE),
        (false, false) => ("path_trace", &PATH_TRACE),
    };
    let room = |needed: u32, step: u32| if general { 2 } else { needed.div_ceil(step) as usize };
    Kernel { name, spirv: all[room(features.constant_spheres, 8)][room(features.facets, 16)] }
}

/// The SPIR-V of a kernel: the caller's, if there is one in the folder of the settings, else the built-in one.
pub(crate) fn spirv(kernel: &Kernel, settings: &RenderSettings) -> Result<Cow<'static, [u8]>, RenderError> {
    let path = settings.spirv_folder.as_ref().map(|f| f.join(kernel.name).with_extension("spv"));
    let Some(path) = path.filter(|p| p.exists()) else { return Ok(Cow::Borrowed(kernel.spirv)) };
    let bytes = std::fs::read(&path).map_err(|e| RenderError::Settings(format!("{}: {e}", path.display())))?;
    // The magic number of the SPIR-V specification, section 2.3.
    if bytes.len() < 20 || bytes.len() % 4 != 0 || bytes[..4] != 0x0723_0203u32.to_le_bytes() {
        return Err(RenderError::Settings(format!("{}: not a SPIR-V module", path.display())));
    }
    Ok(Cow::Owned(bytes))
}
