//! Variables of the same memory are said to be so.

use std::collections::{BTreeMap, BTreeSet};

use rspirv::dr::{Operand, load_words};
use rspirv::spirv::{Decoration, Word};

use crate::spirv::words_of;

use crate::render::kernel;
use crate::render::kernel::aliased::{ALIASED, declare_aliased};
use crate::render::kernel::layout::binding;
use crate::render::kernel::{FIRST_HIT, Kernel, LIGHT_TRACE, PATH_KERNELS, TRAVERSE};
use crate::render::settings::RenderSettings;

/// Words of a module's header.
const HEADER: usize = 5;

/// Variables that are bound, with the numbers of their bindings, and those that are said to be aliased.
fn bound_and_aliased(words: &[u32]) -> (BTreeMap<Word, u32>, BTreeSet<Word>) {
    let module = load_words(words).unwrap();
    let (mut bound, mut aliased) = (BTreeMap::new(), BTreeSet::new());
    for decoration in &module.annotations {
        match decoration.operands[..] {
            [Operand::IdRef(variable), Operand::Decoration(Decoration::Binding), Operand::LiteralBit32(number)] => {
                assert_eq!(bound.insert(variable, number), None, "{variable} is bound twice");
            }
            [Operand::IdRef(variable), Operand::Decoration(Decoration::Aliased)] => {
                assert!(aliased.insert(variable), "{variable} is decorated twice");
            }
            _ => {}
        }
    }
    (bound, aliased)
}

fn all_kernels() -> impl Iterator<Item = Kernel> {
    PATH_KERNELS.into_iter().chain([LIGHT_TRACE, FIRST_HIT, TRAVERSE])
}

#[test]
fn bindings_have_the_numbers_of_the_layout() {
    let expected = [
        ("FILM", binding::FILM),
        ("FILM_ROWS", binding::FILM_ROWS),
        ("PATHS", binding::PATHS),
        ("PATH_TEXELS", binding::PATH_TEXELS),
        ("GRADIENTS", binding::GRADIENTS),
        ("GRADIENT_ROWS", binding::GRADIENT_ROWS),
    ];
    assert_eq!(ALIASED, expected);
}

#[test]
fn exactly_the_variables_of_the_same_memory_are_said_to_be_so() {
    let numbers = BTreeSet::from(ALIASED.map(|(_, number)| number));
    for kernel in all_kernels() {
        let words = words_of(kernel.spirv);
        assert_eq!(crate::gpu::check_spirv(&words), Ok(()), "{}", kernel.name);
        let (bound, aliased) = bound_and_aliased(&words);
        let expected = bound.iter().filter(|(_, number)| numbers.contains(number)).map(|(variable, _)| *variable);
        assert_eq!(aliased, expected.collect(), "{}", kernel.name);
        if kernel.name.starts_with("path_") {
            assert_eq!(
                aliased.iter().map(|variable| bound[variable]).collect::<BTreeSet<_>>(),
                numbers,
                "{}",
                kernel.name
            );
        }
    }
}

/// A compiler's, of the same source, without what the build script has added to it.
fn as_compiled(spirv: &[u8]) -> Vec<u8> {
    let mut module = load_words(words_of(spirv)).unwrap();
    module.annotations.retain(|i| i.operands.get(1) != Some(&Operand::Decoration(Decoration::Aliased)));
    rspirv::binary::Assemble::assemble(&module).into_iter().flat_map(u32::to_le_bytes).collect()
}

#[test]
fn the_shader_of_a_user_becomes_the_built_in_one() {
    let folder = tempfile::tempdir().unwrap();
    let settings = RenderSettings { spirv_folder: Some(folder.path().to_owned()), ..RenderSettings::default() };
    for kernel in all_kernels() {
        let path = folder.path().join(kernel.name).with_extension("spv");
        for (what, spirv) in [("as compiled", as_compiled(kernel.spirv)), ("decorated", kernel.spirv.to_vec())] {
            std::fs::write(&path, spirv).unwrap();
            let read = kernel::spirv(&kernel, &settings).unwrap();
            let (read, built_in) = (words_of(&read), words_of(kernel.spirv));
            // A reader that passes a module on may write another generator.
            assert_eq!(read[HEADER..], built_in[HEADER..], "{}: {what}", kernel.name);
        }
    }
}

#[test]
fn words_that_are_no_instructions_stay() {
    let film = [4 << 16 | 71, 7, 33, binding::FILM];
    let declared = [3 << 16 | 71, 7, 20];
    let header = [0x0723_0203, 0x0001_0500, 0, 9, 0];
    for rest in [&[][..], &[0, film[0]], &[9 << 16 | 71, 7, 33], &[u32::MAX]] {
        let given = [&header[..], &film, rest].concat();
        assert_eq!(declare_aliased(&given), [&header[..], &film, &declared, rest].concat(), "{rest:?}");
    }
    assert_eq!(declare_aliased(&header[..3]), header[..3]);
}
