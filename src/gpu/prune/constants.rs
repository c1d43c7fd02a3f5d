//! What is known before a shader runs.

use std::collections::{HashMap, HashSet};

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, Op, Word};

use crate::gpu::specialization::Specialization;

/// Values of 32-bit and boolean constants by id; true is 1.
pub(super) type Constants = HashMap<Word, u32>;

/// The constants of a module, specialised. `None` if ids may be given by way of decoration groups (deprecated).
pub(super) fn of(module: &Module, specialization: &Specialization) -> Option<Constants> {
    if module.annotations.iter().any(|i| i.class.opcode == Op::DecorationGroup) {
        return None;
    }
    let mut given = HashMap::new();
    for i in module.annotations.iter().filter(|i| i.class.opcode == Op::Decorate) {
        if let [Operand::IdRef(target), Operand::Decoration(Decoration::SpecId), Operand::LiteralBit32(id)] =
            i.operands[..]
            && let Some(value) = specialization.value(id)
        {
            given.insert(target, value);
        }
    }
    let mut constants = Constants::new();
    let mut types = HashSet::new();
    for i in &module.types_global_values {
        let Some(id) = i.result_id else { continue };
        let sized = matches!(i.class.opcode, Op::TypeInt | Op::TypeFloat);
        if i.class.opcode == Op::TypeBool || (sized && i.operands.first() == Some(&Operand::LiteralBit32(32))) {
            types.insert(id);
        }
        if i.result_type.is_none_or(|t| !types.contains(&t)) {
            continue;
        }
        let value = match i.class.opcode {
            Op::ConstantTrue => Some(1),
            Op::ConstantFalse => Some(0),
            Op::Constant => literal(i),
            Op::SpecConstantTrue => Some(given.get(&id).map_or(1, |&v| u32::from(v != 0))),
            Op::SpecConstantFalse => Some(given.get(&id).map_or(0, |&v| u32::from(v != 0))),
            Op::SpecConstant => given.get(&id).copied().or_else(|| literal(i)),
            Op::SpecConstantOp => match i.operands.split_first() {
                Some((Operand::LiteralSpecConstantOpInteger(op), operands)) => fold(*op, operands, &constants),
                _ => None,
            },
            _ => None,
        };
        constants.extend(value.map(|v| (id, v)));
    }
    Some(constants)
}

fn literal(i: &Instruction) -> Option<u32> {
    if let [Operand::LiteralBit32(value)] = i.operands[..] { Some(value) } else { None }
}

/// The value of an operation on integers or booleans, if it can be told.
pub(super) fn fold(op: Op, operands: &[Operand], constants: &Constants) -> Option<u32> {
    let value = |i: usize| constants.get(&operands.get(i)?.id_ref_any()?).copied();
    let signed = |i: usize| Some(value(i)? as i32);
    // One side may suffice.
    match op {
        Op::LogicalAnd if value(0) == Some(0) || value(1) == Some(0) => return Some(0),
        Op::LogicalOr if value(0) == Some(1) || value(1) == Some(1) => return Some(1),
        Op::Select => return value(if value(0)? != 0 { 1 } else { 2 }),
        _ => {}
    }
    Some(match op {
        Op::LogicalNot => u32::from(value(0)? == 0),
        Op::LogicalAnd => value(0)? & value(1)?,
        Op::LogicalOr => value(0)? | value(1)?,
        Op::LogicalEqual | Op::IEqual => u32::from(value(0)? == value(1)?),
        Op::LogicalNotEqual | Op::INotEqual => u32::from(value(0)? != value(1)?),
        Op::ULessThan => u32::from(value(0)? < value(1)?),
        Op::ULessThanEqual => u32::from(value(0)? <= value(1)?),
        Op::UGreaterThan => u32::from(value(0)? > value(1)?),
        Op::UGreaterThanEqual => u32::from(value(0)? >= value(1)?),
        Op::SLessThan => u32::from(signed(0)? < signed(1)?),
        Op::SLessThanEqual => u32::from(signed(0)? <= signed(1)?),
        Op::SGreaterThan => u32::from(signed(0)? > signed(1)?),
        Op::SGreaterThanEqual => u32::from(signed(0)? >= signed(1)?),
        Op::IAdd => value(0)?.wrapping_add(value(1)?),
        Op::ISub => value(0)?.wrapping_sub(value(1)?),
        Op::IMul => value(0)?.wrapping_mul(value(1)?),
        Op::BitwiseAnd => value(0)? & value(1)?,
        Op::BitwiseOr => value(0)? | value(1)?,
        Op::BitwiseXor => value(0)? ^ value(1)?,
        Op::UDiv => value(0)?.checked_div(value(1)?)?,
        Op::UMod => value(0)?.checked_rem(value(1)?)?,
        Op::ShiftLeftLogical => value(0)?.checked_shl(value(1)?)?,
        Op::ShiftRightLogical => value(0)?.checked_shr(value(1)?)?,
        _ => return None,
    })
}
