//! What all test binaries share: how devices are opened, and where what can be made again is kept.

use std::path::Path;

use photolith::gpu::RayQueryUse;
use photolith::{ContextOptions, Validation};

/// The cache folder of the tests (`XDG_CACHE_HOME` of the programs that they start). A kept shader is found by all that it was made
/// from, so that none is stale, and is put in place whole, so that tests may share the folder.
pub const CACHE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/cache");

/// The default device, its shaders kept where the program keeps them.
pub fn context_options(validation: Validation) -> ContextOptions {
    let shader_folder = Some(Path::new(CACHE).join("photolith/shaders"));
    ContextOptions { validation, shader_folder, ray_query: RayQueryUse::Always, ..ContextOptions::default() }
}
