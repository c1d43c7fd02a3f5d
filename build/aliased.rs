//! Tells drivers which variables of a shader are the same memory.
//!
//! A driver may assume that two variables are not, unless both are decorated as `Aliased` (SPIR-V specification, section
//! 2.18.2), for which GLSL has no word.

/// The bindings of buffers that shaders see by more than one variable (shaders/lib/layout.glsl), by their names in
/// src/render/layout.rs.
pub const ALIASED: [(&str, u32); 6] =
    [("FILM", 4), ("FILM_ROWS", 12), ("PATHS", 6), ("PATH_TEXELS", 8), ("GRADIENTS", 9), ("GRADIENT_ROWS", 13)];

// Opcodes and decorations are those of the SPIR-V specification 1.6, section 3.
const HEADER_WORDS: usize = 5;
const DECORATE: u32 = 71;
const BINDING: u32 = 33;
const ALIASED_DECORATION: u32 = 20;

/// The same shader, of a compiler's making, with the variables of these bindings decorated.
pub fn declare_aliased(words: &[u32]) -> Vec<u32> {
    let (header, mut rest) = words.split_at(HEADER_WORDS);
    let mut declared = header.to_vec();
    while let Some(&first) = rest.first() {
        let (instruction, after) = rest.split_at((first >> 16) as usize);
        declared.extend(instruction);
        if let [_, variable, BINDING, number] = *instruction
            && first & 0xffff == DECORATE
            && ALIASED.iter().any(|&(_, aliased)| aliased == number)
        {
            declared.extend([3 << 16 | DECORATE, variable, ALIASED_DECORATION]);
        }
        rest = after;
    }
    declared
}
