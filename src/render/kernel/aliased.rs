//! Tells drivers which variables of a shader are the same memory.
//!
//! A driver may assume that two variables are not, unless both are decorated as `Aliased` (SPIR-V specification, section
//! 2.18.2), for which GLSL has no word.
//!
//! The build script includes this file, for the built-in shaders; those of a user get the same when they are read.

use crate::spirv::{HEADER_WORDS, instructions};

/// The bindings of buffers that shaders see by more than one variable (shaders/lib/layout.glsl), by their names in
/// src/render/kernel/layout.rs, which the build script cannot see.
pub const ALIASED: [(&str, u32); 6] =
    [("FILM", 4), ("FILM_ROWS", 12), ("PATHS", 6), ("PATH_TEXELS", 8), ("GRADIENTS", 9), ("GRADIENT_ROWS", 13)];

// Opcodes and decorations are those of the SPIR-V specification 1.6, section 3.
/// OpDecorate of three words, and of four.
const DECORATE_ALIASED: u32 = 3 << 16 | 71;
const DECORATE_BINDING: u32 = 4 << 16 | 71;
const BINDING: u32 = 33;
const ALIASED_DECORATION: u32 = 20;

/// The same shader, with the variables of these bindings decorated. (Those that are already stay as they are.) Words that are no
/// instructions are kept too.
pub fn declare_aliased(words: &[u32]) -> Vec<u32> {
    let aliased_before = |variable| {
        instructions(words)
            .any(|i| matches!(*i, [DECORATE_ALIASED, decorated, ALIASED_DECORATION] if decorated == variable))
    };
    let mut declared = words[..HEADER_WORDS.min(words.len())].to_vec();
    let mut all = instructions(words);
    for instruction in all.by_ref() {
        declared.extend(instruction);
        if let [DECORATE_BINDING, variable, BINDING, number] = *instruction
            && ALIASED.iter().any(|&(_, aliased)| aliased == number)
            && !aliased_before(variable)
        {
            declared.extend([DECORATE_ALIASED, variable, ALIASED_DECORATION]);
        }
    }
    declared.extend(all.rest());
    declared
}
