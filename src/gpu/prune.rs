//! Takes out of a shader what its specialization constants switch off, before a driver sees it.
//!
//! Drivers fold these constants too, but late: lavapipe first inlines every call of every function, whether it can be
//! reached or not, and then works on all of it. Without what a scene switches off it makes a pipeline in .4 to .6 of the
//! time, each time that the program starts. Only what is never executed goes: the constants stay as they are, and
//! results with them.

mod constants;
mod flow;

use std::collections::{HashMap, HashSet};

use rspirv::binary::Assemble;
use rspirv::dr::{Function, Instruction, Module, Operand, load_words};
use rspirv::spirv::{Capability, Op, Word};

use crate::gpu::specialization::Specialization;
use crate::hash::digest;
use crate::spirv::{HEADER_WORDS, instructions, opcode};

/// This file, its modules and what they read with: what they make of a shader may be kept.
const SOURCES: [&str; 4] = [
    include_str!("prune.rs"),
    include_str!("prune/constants.rs"),
    include_str!("prune/flow.rs"),
    include_str!("../spirv.rs"),
];

/// What is made of a shader depends on this, and on the constants: its length and its hash, and those of this code.
pub(super) fn identity(spirv: &[u8]) -> Vec<u8> {
    let mut identity = (spirv.len() as u64).to_le_bytes().to_vec();
    identity.extend(digest(spirv).to_le_bytes());
    SOURCES.iter().for_each(|source| identity.extend(digest(source.as_bytes()).to_le_bytes()));
    identity
}

/// The same shader without what these values switch off; `None` if it is not of a kind that this knows, which is then for
/// the driver to judge.
pub(super) fn prune(words: &[u32], specialization: &Specialization) -> Option<Vec<u32>> {
    if !is_well_formed(words) {
        return None;
    }
    let mut module = load_words(words).ok()?;
    // Drivers go by who made the module.
    let header = module.header.as_mut()?;
    (header.generator, header.reserved_word) = (words[2], words[4]);
    let constants = constants::of(&module, specialization)?;
    for function in &mut module.functions {
        flow::keep_reachable(function, &constants)?;
    }
    keep_called(&mut module);
    keep_needed(&mut module);
    keep_used_variables(&mut module);
    let defined = module.all_inst_iter().filter_map(|i| i.result_id).collect();
    keep_described(&mut module, &defined);
    is_closed(&module, &defined).then(|| module.assemble())
}

/// Whether instructions follow each other to the end, and none is one that rspirv would panic at.
pub(super) fn is_well_formed(words: &[u32]) -> bool {
    // An operation that is no operation, but a constant itself or a branch.
    let is_strange = |i: &[u32]| {
        opcode(i) == Op::SpecConstantOp as u32
            && i.get(3).and_then(|&op| Op::from_u32(op)).is_none_or(|op| NO_OPERATIONS.contains(&op))
    };
    let mut all = instructions(words);
    words.len() >= HEADER_WORDS && !all.any(is_strange) && all.rest().is_empty()
}

const NO_OPERATIONS: [Op; 3] = [Op::Constant, Op::SpecConstantOp, Op::Switch];

/// Drops the functions that no entry point calls, not even through others.
fn keep_called(module: &mut Module) {
    let calls: HashMap<Word, Vec<Word>> = module
        .functions
        .iter()
        .filter_map(|f| Some((f.def_id()?, f.all_inst_iter().filter_map(callee).collect())))
        .collect();
    let mut open: Vec<Word> = module.entry_points.iter().filter_map(|e| e.operands.get(1)?.id_ref_any()).collect();
    let mut called: HashSet<Word> = open.iter().copied().collect();
    while let Some(function) = open.pop() {
        for &callee in calls.get(&function).into_iter().flatten() {
            if called.insert(callee) {
                open.push(callee);
            }
        }
    }
    module.functions.retain(|f: &Function| f.def_id().is_some_and(|id| called.contains(&id)));
}

fn callee(instruction: &Instruction) -> Option<Word> {
    (instruction.class.opcode == Op::FunctionCall).then(|| instruction.operands.first()?.id_ref_any())?
}

/// Drops capabilities that nothing needs: a device may lack them.
fn keep_needed(module: &mut Module) {
    let uses = |module: &Module, needs: &[Op]| module.all_inst_iter().any(|i| needs.contains(&i.class.opcode));
    if !uses(module, &[Op::GroupNonUniformShuffle, Op::GroupNonUniformShuffleXor]) {
        drop_capability(module, Capability::GroupNonUniformShuffle);
    }
    if !uses(module, &[Op::RayQueryInitializeKHR]) {
        drop_capability(module, Capability::RayQueryKHR);
        let names_them = |i: &Instruction| {
            i.operands.iter().any(|o| matches!(o, Operand::LiteralString(name) if name.ends_with("_ray_query")))
        };
        module.extensions.retain(|i| !names_them(i));
        module.debug_string_source.retain(|i| !names_them(i));
        drop_ray_query_types(module);
    }
}

fn drop_capability(module: &mut Module, capability: Capability) {
    module.capabilities.retain(|i| i.operands != [Operand::Capability(capability)]);
}

/// Drops acceleration structures and queries, with all that is of their types.
fn drop_ray_query_types(module: &mut Module) {
    let mut dropped = HashSet::new();
    module.types_global_values.retain(|i| {
        let is_one = [Op::TypeRayQueryKHR, Op::TypeAccelerationStructureKHR].contains(&i.class.opcode);
        let mut named = i.operands.iter().filter_map(Operand::id_ref_any).chain(i.result_type);
        let is_dropped = is_one || named.any(|id| dropped.contains(&id));
        dropped.extend(i.result_id.filter(|_| is_dropped));
        !is_dropped
    });
    for entry in &mut module.entry_points {
        entry.operands.retain(|operand| operand.id_ref_any().is_none_or(|id| !dropped.contains(&id)));
    }
}

/// Drops global variables that no function names: of a table that is seen as texels or as an array, one is left.
fn keep_used_variables(module: &mut Module) {
    let in_functions = module.functions.iter().flat_map(Function::all_inst_iter);
    let used: HashSet<Word> = in_functions.flat_map(|i| &i.operands).filter_map(Operand::id_ref_any).collect();
    let is_unused =
        |i: &Instruction| i.class.opcode == Op::Variable && i.result_id.is_some_and(|id| !used.contains(&id));
    let unused: HashSet<Word> =
        module.types_global_values.iter().filter(|i| is_unused(i)).filter_map(|i| i.result_id).collect();
    module.types_global_values.retain(|i| !is_unused(i));
    for entry in &mut module.entry_points {
        // Model, function and name come first, then the variables.
        let (mut place, interface) = (0, 3);
        entry.operands.retain(|operand| {
            place += 1;
            place <= interface || operand.id_ref_any().is_none_or(|id| !unused.contains(&id))
        });
    }
}

/// Drops names and decorations of what is no longer there.
fn keep_described(module: &mut Module, defined: &HashSet<Word>) {
    let of_defined = |i: &Instruction| {
        i.operands.first().and_then(Operand::id_ref_any).is_none_or(|target| defined.contains(&target))
    };
    module.debug_names.retain(of_defined);
    module.annotations.retain(of_defined);
}

/// Whether everything that is used is still there. It is, unless values of one block are used in another that does not
/// depend on it being executed.
pub(super) fn is_closed(module: &Module, defined: &HashSet<Word>) -> bool {
    module.all_inst_iter().flat_map(|i| &i.operands).filter_map(Operand::id_ref_any).all(|id| defined.contains(&id))
}

#[cfg(test)]
mod kernel_tests;
#[cfg(test)]
mod tests;
