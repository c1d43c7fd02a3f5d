//! Wider vectors for a driver that runs on the CPU.

use std::path::PathBuf;
use std::{env, fs};

use crate::cache::user_cache;

use super::manifest::{ApiVersion, lavapipe_api_version};

/// Read by Mesa's llvmpipe when it starts: bits of its vectors. Its own choice is 256 even where the CPU has 512.
const WIDTH: &str = "LP_NATIVE_VECTOR_WIDTH";
/// Mesa's shader cache. Its keys leave the width out, so that each width needs a folder of its own.
const CACHE: &str = "MESA_SHADER_CACHE_DIR";

/// Asks llvmpipe for vectors of 512 bits if the CPU has them; other drivers do not listen. Where it pays is said by
/// [`suits_wide_vectors`](crate::render::suits_wide_vectors).
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

/// What tells where vectors of 512 bits pay, before a driver is loaded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WideVectors {
    /// lavapipe is from Mesa 25.0 or later, which skips branches that no lane takes.
    pub skip_branches: bool,
    /// Lanes that follow a tree should be sixteen on this CPU. On an AMD EPYC (Zen 5), which works on 512 bits at once,
    /// meshes take .77 to .96 of the time with lavapipe 25.0.7, on a Xeon (Cascade Lake) .84 to .94. (On other Xeons,
    /// Sapphire Rapids and Granite Rapids, they take 1.0 to 1.1 times the time.) Zen 4, which works on halves, takes .94
    /// to 1.11 of the time, but less where most rays are within glass: with dragons, bunnies and armadillos in rooms .78,
    /// .92, .97 (a dragon on Granite Rapids .96 to 1.0).
    pub suit_walks: bool,
}

impl WideVectors {
    /// By what this machine's CPU and manifest of lavapipe say; `None` if the CPU has no such vectors.
    pub fn of_machine() -> Option<Self> {
        has_wide_vectors().then(|| Self {
            skip_branches: lavapipe_api_version().is_some_and(|version| version >= LAVAPIPE_25),
            suit_walks: cpu_suits_wide_walks(),
        })
    }
}

/// The version of Vulkan of lavapipe from Mesa 25.0 on.
const LAVAPIPE_25: ApiVersion = (1, 4);

/// AMD's family of CPUs from which on vectors of 512 bits are not worked on in halves: Zen 5.
#[cfg(target_arch = "x86_64")]
const ZEN_5: u32 = 0x1a;
/// Intel's family and model of the Xeons where 16 lanes were measured to follow a tree sooner than 8: Cascade Lake, and
/// Skylake and Cooper Lake, which share its number.
#[cfg(target_arch = "x86_64")]
const CASCADE_LAKE: (u32, u32) = (6, 0x55);

/// Whether this CPU, if it has vectors of 512 bits, follows a tree sooner with them.
#[cfg(target_arch = "x86_64")]
fn cpu_suits_wide_walks() -> bool {
    use std::arch::x86_64::__cpuid;
    let vendor = __cpuid(0);
    let vendor = [vendor.ebx, vendor.edx, vendor.ecx].map(u32::to_le_bytes).concat();
    suits_wide_walks(&vendor, __cpuid(1).eax)
}

/// The same for a vendor and a signature: what CPUID says for 0 and 1 (AMD64 Architecture Programmer's Manual, volume
/// 3; Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2).
#[cfg(target_arch = "x86_64")]
fn suits_wide_walks(vendor: &[u8], signature: u32) -> bool {
    let base_family = signature >> 8 & 0xf;
    let family = if base_family == 0xf { base_family + (signature >> 20 & 0xff) } else { base_family };
    // For the families in question the extended model counts.
    let model = (signature >> 12 & 0xf0) + (signature >> 4 & 0xf);
    match vendor {
        b"AuthenticAMD" => family >= ZEN_5,
        b"GenuineIntel" => (family, model) == CASCADE_LAKE,
        _ => false,
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn cpu_suits_wide_walks() -> bool {
    false
}

#[cfg(target_arch = "x86_64")]
fn has_wide_vectors() -> bool {
    is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") && is_x86_feature_detected!("avx512bw")
}

#[cfg(not(target_arch = "x86_64"))]
fn has_wide_vectors() -> bool {
    false
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::suits_wide_walks;

    #[test]
    fn cpus_are_told_apart() {
        let (amd, intel) = (b"AuthenticAMD", b"GenuineIntel");
        let [zen_4, zen_5] = [0x00a1_0f11, 0x00b0_0f21];
        let [skylake, cascade_lake, ice_lake, sapphire_rapids] = [0x0005_0654, 0x0005_0657, 0x0006_06a6, 0x0008_06f8];
        assert!(suits_wide_walks(amd, zen_5) && !suits_wide_walks(amd, zen_4));
        assert!([skylake, cascade_lake].iter().all(|cpu| suits_wide_walks(intel, *cpu)));
        assert!(![ice_lake, sapphire_rapids].iter().any(|cpu| suits_wide_walks(intel, *cpu)));
        assert!(!suits_wide_walks(intel, zen_5) && !suits_wide_walks(b"", cascade_lake));
    }
}
