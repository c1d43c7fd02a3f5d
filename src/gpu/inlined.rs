//! Drivers that inline all calls, and how large that makes a kernel.
//!
//! SwiftShader knows no calls of functions: a function that is called a hundred times is a hundred times in the code, all of
//! which is optimised at once. What is too large for that is refused, since nothing ends the compilation.

use std::collections::HashMap;

use ash::vk::DriverId;

use crate::gpu::error::GpuError;
use crate::gpu::select::DeviceInfo;
use crate::spirv::{instructions, opcode};

/// Instructions of a kernel that such a driver is known to compile within seconds.
const MOST: u64 = 40_000;

// Opcodes of the SPIR-V specification 1.6, section 3.
const ENTRY_POINT: u32 = 15;
const FUNCTION: u32 = 54;
const FUNCTION_CALL: u32 = 57;

/// Checks that a driver compiles a kernel within seconds.
///
/// # Errors
/// It inlines all calls, which makes the kernel too large.
pub(super) fn check_size(device: &DeviceInfo, kernel: &str, words: &[u32]) -> Result<(), GpuError> {
    if device.driver_id != DriverId::GOOGLE_SWIFTSHADER.as_raw() {
        return Ok(());
    }
    let instructions = inlined_instructions(words);
    log::debug!("{kernel}: {instructions} instructions where calls are inlined");
    if instructions > MOST {
        return Err(GpuError::KernelTooLarge {
            kernel: kernel.to_owned(),
            instructions,
            limit: MOST,
            device: device.name.clone(),
        });
    }
    Ok(())
}

/// Instructions of a module's functions, each as many times as it is called, on all ways.
fn inlined_instructions(words: &[u32]) -> u64 {
    let mut own: HashMap<u32, (u64, Vec<u32>)> = HashMap::new();
    let (mut entry, mut current) = (None, None);
    for instruction in instructions(words) {
        match (opcode(instruction), instruction) {
            (ENTRY_POINT, &[_, _, function, ..]) => entry = Some(function),
            (FUNCTION, &[_, _, function, ..]) => current = Some(function),
            (FUNCTION_CALL, &[_, _, _, callee, ..]) => {
                if let Some(function) = current.and_then(|f| own.get_mut(&f)) {
                    function.1.push(callee);
                }
            }
            _ => {}
        }
        if let Some(function) = current {
            own.entry(function).or_default().0 += 1;
        }
    }
    let mut all = HashMap::new();
    entry.map_or(0, |function| inlined(function, &own, &mut all))
}

/// The same of a function. (SPIR-V knows no recursion; who calls himself nevertheless counts once.)
fn inlined(function: u32, own: &HashMap<u32, (u64, Vec<u32>)>, all: &mut HashMap<u32, u64>) -> u64 {
    if let Some(&known) = all.get(&function) {
        return known;
    }
    all.insert(function, 0);
    let Some((count, callees)) = own.get(&function) else { return 0 };
    let sum = callees.iter().fold(*count, |sum, &callee| sum.saturating_add(inlined(callee, own, all)));
    all.insert(function, sum);
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spirv::HEADER_WORDS;

    #[test]
    fn a_function_counts_as_often_as_it_is_called() {
        let mut words = vec![0; HEADER_WORDS];
        words.extend([3 << 16 | ENTRY_POINT, 5, 1]);
        let end = 1 << 16 | 56;
        // 1 calls 2 twice, which calls 3 three times; 4 is not called.
        for (function, callees) in [(1, vec![2, 2]), (2, vec![3, 3, 3]), (3, vec![]), (4, vec![3])] {
            words.extend([5 << 16 | FUNCTION, 9, function, 0, 8]);
            callees.iter().for_each(|&callee| words.extend([4 << 16 | FUNCTION_CALL, 9, 0, callee]));
            words.push(end);
        }
        let (three, two) = (2, 2 + 3);
        assert_eq!(inlined_instructions(&words), 2 + 2 + 2 * (two + 3 * three));
        assert_eq!(inlined_instructions(&words[..HEADER_WORDS]), 0);
    }
}
