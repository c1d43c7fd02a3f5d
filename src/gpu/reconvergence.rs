//! Lanes of a subgroup that have parted, at a branch or in a loop, are together again behind it.
//!
//! Kernels whose lanes work for each other rely on that and say so: `[[maximally_reconverges]]`
//! (GL_EXT_maximal_reconvergence). Vulkan promises it with VK_KHR_shader_maximal_reconvergence only. A device without it is
//! given the same shader without these words: there it is what drivers do, as far as they have been tried.

use std::borrow::Cow;
use std::ffi::CStr;

use ash::{khr, vk};

use crate::gpu::instance::Instance;
use crate::spirv::{HEADER_WORDS, instructions, opcode, words_of};

/// The extension that makes the promise.
pub(super) const EXTENSION: &CStr = khr::shader_maximal_reconvergence::NAME;

/// The first validation layer that surely knows the extension, of Vulkan and of SPIR-V.
const LAYER_VERSION: u32 = vk::make_api_version(0, 1, 3, 280);

/// Whether the device promises it, and all that stands between knows of it.
pub(super) fn is_promised(instance: &Instance, physical: vk::PhysicalDevice) -> bool {
    if instance.layer_version.is_some_and(|version| version < LAYER_VERSION) {
        return false;
    }
    if !instance.has_extension(physical, EXTENSION) {
        return false;
    }
    let mut promised = vk::PhysicalDeviceShaderMaximalReconvergenceFeaturesKHR::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut promised);
    // SAFETY: the device knows the extension that the structure is of.
    unsafe { instance.raw.get_physical_device_features2(physical, &mut features) };
    promised.shader_maximal_reconvergence == vk::TRUE
}

/// SPIR-V as a device gets it that promises this or does not.
pub(super) fn as_promised(spirv: &[u8], promised: bool) -> Cow<'_, [u8]> {
    if promised {
        return Cow::Borrowed(spirv);
    }
    let words = words_of(spirv);
    match without(&words) {
        Some(others) => Cow::Owned(bytemuck::cast_slice(&others).to_vec()),
        None => Cow::Borrowed(spirv),
    }
}

// Numbers of the SPIR-V specification 1.6, section 3.
const EXTENSION_OPCODE: u32 = 10;
const EXECUTION_MODE_OPCODE: u32 = 16;
const FUNCTION_OPCODE: u32 = 54;
const MAXIMALLY_RECONVERGES: u32 = 6023;
const SPIRV_EXTENSION: &[u8] = b"SPV_KHR_maximal_reconvergence\0";

/// The module without the words that ask for it; `None` if it has none. Words that are no instructions are kept.
fn without(words: &[u32]) -> Option<Vec<u32>> {
    let mut kept = words.get(..HEADER_WORDS)?.to_vec();
    let mut rest = words.get(HEADER_WORDS..)?;
    let mut all = instructions(words);
    // All that is said of a module precedes its functions.
    while let Some(instruction) = all.next().filter(|i| opcode(i) != FUNCTION_OPCODE) {
        let asks = match opcode(instruction) {
            EXTENSION_OPCODE => bytemuck::cast_slice::<_, u8>(&instruction[1..]).starts_with(SPIRV_EXTENSION),
            EXECUTION_MODE_OPCODE => instruction.get(2) == Some(&MAXIMALLY_RECONVERGES),
            _ => false,
        };
        if !asks {
            kept.extend(instruction);
        }
        rest = all.rest();
    }
    kept.extend(rest);
    (kept.len() < words.len()).then_some(kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names and SPIR-V of all built-in shaders.
    fn kernels() -> Vec<(&'static str, &'static [u8])> {
        include!(concat!(env!("OUT_DIR"), "/kernels.rs")).to_vec()
    }

    fn asks(spirv: &[u8]) -> bool {
        without(&words_of(spirv)).is_some()
    }

    #[test]
    fn kernels_whose_lanes_work_together_ask_for_it() {
        for (name, spirv) in kernels() {
            let works_together = name.starts_with("path_") || ["light_trace", "first_hit", "lanes"].contains(&name);
            assert_eq!(asks(spirv), works_together, "{name}");
        }
    }

    #[test]
    fn nothing_else_goes() {
        for (name, spirv) in kernels().into_iter().filter(|(_, spirv)| asks(spirv)) {
            assert_eq!(as_promised(spirv, true), spirv);
            let left = as_promised(spirv, false);
            // An instruction of nine words, one of three.
            assert_eq!(left.len() + 4 * (9 + 3), spirv.len(), "{name}");
            assert!(!asks(&left), "{name}");
            let module = rspirv::dr::load_bytes(&left).unwrap();
            let mut asking = rspirv::dr::load_bytes(spirv).unwrap();
            asking.extensions.retain(|i| !format!("{i:?}").contains("maximal_reconvergence"));
            asking.execution_modes.retain(|i| !format!("{i:?}").contains("MaximallyReconverges"));
            assert_eq!(
                module.all_inst_iter().collect::<Vec<_>>(),
                asking.all_inst_iter().collect::<Vec<_>>(),
                "{name}"
            );
        }
    }

    #[test]
    fn what_is_no_module_stays() {
        let (_, spirv) = kernels().into_iter().find(|(_, spirv)| asks(spirv)).unwrap();
        let words = words_of(spirv);
        for cut in [0, 3, HEADER_WORDS] {
            assert_eq!(without(&words[..cut]), None, "{cut} words");
        }
        let header = &words[..HEADER_WORDS];
        for strange in [&[0, 1, 2][..], &[7 << 16 | EXTENSION_OPCODE, 5], &[2 << 16 | EXECUTION_MODE_OPCODE, 1]] {
            assert_eq!(without(&[header, strange].concat()), None, "{strange:?}");
        }
        assert_eq!(as_promised(b"no words", false), &b"no words"[..]);
    }
}
