//! The SPIR-V of the path tracer's kernels, each built for several numbers of constant spheres and facets (build.rs).

use super::features::Features;

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
