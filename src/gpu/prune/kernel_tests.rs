//! The kernels that the build script has made.

use std::collections::{BTreeMap, BTreeSet};

use rspirv::dr::{Operand, load_words};
use rspirv::spirv::{Decoration, Op, Word};

use super::super::pipeline::Specialization;
use super::prune;

// What the build script goes by.
#[path = "../../../build/aliased.rs"]
mod aliased;
use aliased::{ALIASED, declare_aliased};

/// Names and words of all of them.
fn kernels() -> Vec<(&'static str, Vec<u32>)> {
    let built = include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
    let words = |spirv: &[u8]| spirv.chunks_exact(4).map(|w| u32::from_le_bytes(w.try_into().unwrap())).collect();
    built.into_iter().map(|(name, spirv)| (name, words(spirv))).collect()
}

#[test]
fn the_kernels_are_of_a_kind_that_is_known() {
    for (name, words) in kernels() {
        let pruned = prune(&words, &Specialization::default()).expect(name);
        assert!(pruned.len() < words.len(), "{name}: {} of {} words", pruned.len(), words.len());
        // Nothing is left to be done, and who made it is still said.
        assert_eq!(prune(&pruned, &Specialization::default()).as_deref(), Some(&pruned[..]), "{name}");
        assert_eq!((pruned[2], pruned[4]), (words[2], words[4]), "{name}");
    }
}

/// Variables that are bound, with the numbers of their bindings, and those that are said to be aliased.
fn bound_and_aliased(words: &[u32]) -> (BTreeMap<Word, u32>, BTreeSet<Word>) {
    let module = load_words(words).unwrap();
    let (mut bound, mut aliased) = (BTreeMap::new(), BTreeSet::new());
    for decoration in module.annotations.iter().filter(|i| i.class.opcode == Op::Decorate) {
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

/// Pruned or not, exactly the variables whose memory others are too are said to be so.
#[test]
fn variables_of_the_same_memory_are_said_to_be_so() {
    let numbers = BTreeSet::from(ALIASED.map(|(_, number)| number));
    for (name, words) in kernels() {
        let pruned = prune(&words, &Specialization::default()).expect(name);
        for words in [&words, &pruned] {
            let (bound, aliased) = bound_and_aliased(words);
            let expected = bound.iter().filter(|(_, number)| numbers.contains(number)).map(|(variable, _)| *variable);
            assert_eq!(aliased, expected.collect(), "{name}");
            if name.starts_with("path_") {
                assert_eq!(aliased.iter().map(|variable| bound[variable]).collect::<BTreeSet<_>>(), numbers, "{name}");
            }
        }
    }
}

/// The build script cannot see the host's numbers.
#[test]
fn bindings_of_the_same_memory_have_the_numbers_of_the_layout() {
    let layout = include_str!("../../render/layout.rs");
    for (name, number) in ALIASED {
        let line = format!("pub const {name}: u32 = {number};");
        assert!(layout.contains(&line), "layout.rs should have `{line}`");
    }
}

#[test]
fn a_decoration_follows_that_of_the_binding() {
    let decorate = |operands: &[u32]| [&[(operands.len() as u32 + 1) << 16 | Op::Decorate as u32], operands].concat();
    let (binding, set) = (Decoration::Binding as u32, Decoration::DescriptorSet as u32);
    let header = vec![0x0723_0203, 0x0001_0500, 0, 9, 0];
    // The set's number is no binding's, and another binding is that of other memory.
    let others = [decorate(&[7, set, 4]), decorate(&[8, binding, 0])].concat();
    let film = decorate(&[7, binding, 4]);
    let words = [header.clone(), film.clone(), others.clone()].concat();
    let expected = [header, film, decorate(&[7, Decoration::Aliased as u32]), others].concat();
    assert_eq!(declare_aliased(&words), expected);
}
