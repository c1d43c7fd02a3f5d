//! Whether SPIR-V that the user brings is some: drivers crash at what is not.

use std::collections::HashSet;

use rspirv::dr::{Instruction, Operand, load_words};
use rspirv::spirv::ExecutionModel;

use crate::gpu::prune::{is_closed, is_well_formed};
use crate::spirv::HEADER_WORDS;

/// Versions that Vulkan 1.2 takes, as the second word of a module has them.
const VERSIONS: std::ops::RangeInclusive<u32> = 0x0001_0000..=0x0001_0500;

/// Checks that words are a module of SPIR-V whose instructions are known, complete, and refer to what is there. (Whether it keeps all
/// rules is for validation layers to say.) One of its entry points is the compute shader `main`.
///
/// # Errors
/// What was found and what was expected.
pub fn check_spirv(words: &[u32]) -> Result<(), String> {
    let &[magic, version, _, bound, _, ..] = words else {
        return Err(format!("not a SPIR-V module: {} words, expected at least {HEADER_WORDS}", words.len()));
    };
    // SPIR-V specification 1.6, section 2.3.
    if magic != 0x0723_0203 {
        return Err(format!("not a SPIR-V module: it begins with {magic:#010x}, expected 0x07230203"));
    }
    if !VERSIONS.contains(&version) {
        return Err(format!("SPIR-V of version {}.{}, expected 1.0 to 1.5", version >> 16, version >> 8 & 0xff));
    }
    if !is_well_formed(words) {
        return Err("the SPIR-V module is damaged, expected instructions that follow each other to its end".to_owned());
    }
    let module = load_words(words).map_err(|error| format!("the SPIR-V module is damaged: {error}"))?;
    let main = [Operand::ExecutionModel(ExecutionModel::GLCompute), Operand::LiteralString("main".to_owned())];
    let is_main = |entry: &Instruction| main.iter().all(|operand| entry.operands.contains(operand));
    if !module.entry_points.iter().any(is_main) || module.functions.is_empty() {
        return Err("there is no compute shader main in the SPIR-V module".to_owned());
    }
    let mut defined = HashSet::new();
    for id in module.all_inst_iter().filter_map(|instruction| instruction.result_id) {
        if id >= bound {
            return Err(format!("the SPIR-V module defines %{id}, expected one below its bound, {bound}"));
        }
        if !defined.insert(id) {
            return Err(format!("the SPIR-V module defines %{id} twice, expected once"));
        }
    }
    if !is_closed(&module, &defined) {
        return Err("the SPIR-V module uses an id that it does not define, expected all to be defined".to_owned());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use rspirv::binary::Assemble;
    use rspirv::dr::Builder;
    use rspirv::spirv::{AddressingModel, Capability, FunctionControl, MemoryModel};

    use super::*;

    fn module() -> Vec<u32> {
        let mut builder = Builder::new();
        builder.set_version(1, 5);
        builder.capability(Capability::Shader);
        builder.memory_model(AddressingModel::Logical, MemoryModel::GLSL450);
        let void = builder.type_void();
        let nullary = builder.type_function(void, []);
        let main = builder.begin_function(void, None, FunctionControl::NONE, nullary).unwrap();
        builder.entry_point(ExecutionModel::GLCompute, main, "main", []);
        builder.begin_block(None).unwrap();
        builder.ret().unwrap();
        builder.end_function().unwrap();
        builder.module().assemble()
    }

    #[test]
    fn what_is_no_module_is_refused_and_never_a_panic() {
        let good = module();
        assert_eq!(check_spirv(&good), Ok(()));
        for cut in 0..good.len() - 1 {
            assert!(check_spirv(&good[..cut]).is_err(), "{cut} words");
        }
        for (place, word, found) in [
            (0, 0x0302_2307, "0x03022307"),
            (1, 0x0001_0600, "version 1.6"),
            (1, 0, "version 0.0"),
            (3, 1, "expected one below its bound"),
            (5, 2 << 16 | 9999, ""),
            (6, 0xffff, ""),
        ] {
            let mut changed = good.clone();
            changed[place] = word;
            let error = check_spirv(&changed).unwrap_err();
            assert!(error.contains(found), "{error}");
        }
        // No change of a word is a panic.
        for place in 0..good.len() {
            for word in [0, 1, 3, u32::MAX, good[place] ^ 1, good[place] << 16] {
                let mut changed = good.clone();
                changed[place] = word;
                let _ = check_spirv(&changed);
            }
        }
    }
}
