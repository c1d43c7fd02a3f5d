//! The kernels that the build script has made.

use std::collections::HashSet;

use rspirv::binary::Disassemble;
use rspirv::dr::{Instruction, Operand, load_words};
use rspirv::spirv::Word;

use crate::gpu::prune::prune;
use crate::gpu::specialization::Specialization;
use crate::spirv::words_of;

/// Names and words of all of them.
fn kernels() -> Vec<(&'static str, Vec<u32>)> {
    let built = include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
    built.into_iter().map(|(name, spirv)| (name, words_of(spirv))).collect()
}

#[test]
fn the_kernels_are_of_a_kind_that_is_known() {
    for (name, words) in kernels() {
        let pruned = prune(&words, &Specialization::default()).expect(name);
        // Small ones have no features.
        assert!(words.len() < 2000 || pruned.len() < words.len(), "{name}: {} of {} words", pruned.len(), words.len());
        // Nothing is left to be done, and who made it is still said.
        assert_eq!(prune(&pruned, &Specialization::default()).as_deref(), Some(&pruned[..]), "{name}");
        assert_eq!((pruned[2], pruned[4]), (words[2], words[4]), "{name}");
    }
}

/// What is decorated and stays, stays decorated: variables of the same memory, for example, are still said to be so.
#[test]
fn decorations_stay() {
    for (name, words) in kernels() {
        let whole = load_words(&words).unwrap();
        let pruned = load_words(prune(&words, &Specialization::default()).expect(name)).unwrap();
        let left: HashSet<Word> = pruned.all_inst_iter().filter_map(|i| i.result_id).collect();
        let stays = |i: &&Instruction| matches!(i.operands[0], Operand::IdRef(target) if left.contains(&target));
        let expected: Vec<_> = whole.annotations.iter().filter(stays).collect();
        assert_eq!(pruned.annotations.iter().collect::<Vec<_>>(), expected, "{name}");
    }
}

/// A device without ray queries gets nothing that names them.
#[test]
fn ray_queries_are_there_only_where_they_are_used() {
    const USES_RAY_QUERY: u32 = 60;
    const HAS_BVH: u32 = 12;
    // They do nothing else, and are given to no other device.
    const OF_QUERIES: [&str; 2] = ["ray_query", "violation"];
    let mut with = Vec::new();
    for (name, words) in kernels() {
        let named = |queries: bool| {
            let mut specialization = Specialization::default();
            specialization.bool(HAS_BVH, true).bool(USES_RAY_QUERY, queries);
            let text = load_words(prune(&words, &specialization).expect(name)).unwrap().disassemble();
            ["RayQuery", "ray_query", "AccelerationStructure"].map(|word| text.contains(word))
        };
        assert_eq!(named(false), [OF_QUERIES.contains(&name); 3], "{name}");
        if named(true) == [true; 3] {
            with.push(name);
        }
    }
    let expected = ["audit", "closest", "first_hit", "light_trace", "occlusion", "path_trace", "scatter", "traverse"];
    assert!(expected.iter().all(|name| with.contains(name)), "{with:?}");
}
