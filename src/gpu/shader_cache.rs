//! Mesa's shader cache, a folder for each width of llvmpipe's vectors.

use std::path::PathBuf;
use std::{env, fs};

use crate::cache::user_cache;

/// Read by Mesa's llvmpipe when it starts: bits of its vectors.
const WIDTH: &str = "LP_NATIVE_VECTOR_WIDTH";
/// Mesa's shader cache. Its keys leave the width out, so that each width needs a folder of its own.
const CACHE: &str = "MESA_SHADER_CACHE_DIR";

/// If the user has asked llvmpipe for vectors of some width and for no shader cache, chooses one for that width: code for other
/// vectors from the common cache would run without a message, and make a wrong image.
///
/// This sets an environment variable of the process. Call it before the first [`Context`](crate::gpu::Context).
///
/// # Safety
/// No other thread reads or changes the environment meanwhile (see [`std::env::set_var`]).
pub unsafe fn separate_caches_by_width() {
    let width = env::var(WIDTH).ok().filter(|width| !width.is_empty() && width.bytes().all(|b| b.is_ascii_digit()));
    if env::var_os(CACHE).is_some() {
        return;
    }
    if let Some(folder) = width.and_then(|width| cache_of_width(&width)) {
        // SAFETY: by the contract of this function.
        unsafe { env::set_var(CACHE, &folder) };
    }
}

/// A folder for Mesa's code for vectors of a width; none if it cannot be made.
fn cache_of_width(width: &str) -> Option<PathBuf> {
    let folder = user_cache()?.join(format!("mesa-{width}"));
    fs::create_dir_all(&folder).ok()?;
    Some(folder)
}
