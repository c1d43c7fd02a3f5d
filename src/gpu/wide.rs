//! Wider vectors for a driver that runs on the CPU.

use std::path::PathBuf;
use std::{env, fs};

use crate::cache::user_cache;

/// Read by Mesa's llvmpipe when it starts: bits of its vectors. Its own choice is 256 even where the CPU has 512.
const WIDTH: &str = "LP_NATIVE_VECTOR_WIDTH";
/// Mesa's shader cache. Its keys leave the width out, so that each width needs a folder of its own.
const CACHE: &str = "MESA_SHADER_CACHE_DIR";

/// Asks llvmpipe for vectors of 512 bits if the CPU has them; other drivers do not listen. It pays where lanes compute
/// (a room of spheres: 4 to 40% less time), not where they follow the tree, whose accesses are scalar.
///
/// This sets environment variables of the process, unless the user has. Call it before the first
/// [`Context`](super::Context).
///
/// # Safety
/// No other thread reads or changes the environment meanwhile (see [`std::env::set_var`]).
pub unsafe fn prefer_wide_vectors() {
    if !has_wide_vectors() || env::var_os(WIDTH).is_some() || env::var_os(CACHE).is_some() {
        return;
    }
    let Some(folder) = cache_of_width("512") else { return };
    // SAFETY: by the contract of this function.
    unsafe {
        env::set_var(WIDTH, "512");
        env::set_var(CACHE, &folder);
    }
}

/// If the user has asked llvmpipe for vectors of some width and for no shader cache, chooses one for that width: code for other
/// vectors from the common cache would run without a message, and make a wrong image.
///
/// This sets an environment variable of the process. Call it before the first [`Context`](super::Context).
///
/// # Safety
/// As [`prefer_wide_vectors`].
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

#[cfg(target_arch = "x86_64")]
fn has_wide_vectors() -> bool {
    is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") && is_x86_feature_detected!("avx512bw")
}

#[cfg(not(target_arch = "x86_64"))]
fn has_wide_vectors() -> bool {
    false
}
