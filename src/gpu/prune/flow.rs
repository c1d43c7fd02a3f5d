//! Which blocks of a function are reached.

use std::collections::{HashMap, HashSet};

use rspirv::dr::{Block, Function, Instruction, Operand};
use rspirv::spirv::{Op, Word};

use crate::gpu::prune::constants::{Constants, fold};

/// Rounds in which to find out more; what is not known by then stays.
const ROUNDS: usize = 16;

/// Drops the blocks that are never reached because of what conditions are known to be. `None` where SPIR-V of another
/// shape than compilers make of `if`, `for` and `while` would no longer be valid.
pub(super) fn keep_reachable(function: &mut Function, constants: &Constants) -> Option<()> {
    let Some(entry) = function.blocks.first() else { return Some(()) };
    let entry = entry.label_id()?;
    let blocks: HashMap<Word, &Block> =
        function.blocks.iter().map(|b| Some((b.label_id()?, b))).collect::<Option<_>>()?;

    // What is known grows, what is reached shrinks.
    let mut known = constants.clone();
    let mut reached = Reached::from(entry, &blocks, &known);
    for _ in 0..ROUNDS {
        let before = known.len();
        for block in function.blocks.iter().filter(|b| reached.contains(b)) {
            learn(block, &reached, &mut known);
        }
        if known.len() == before {
            break;
        }
        reached = Reached::from(entry, &blocks, &known);
    }

    function.blocks.retain(|b| reached.contains(b));
    for block in &mut function.blocks {
        if let Some(target) = only_way(block, &known) {
            block.instructions.truncate(block.instructions.len() - 2);
            block.instructions.push(Instruction::new(Op::Branch, None, None, vec![Operand::IdRef(target)]));
        }
        let label = block.label_id()?;
        for phi in block.instructions.iter_mut().filter(|i| i.class.opcode == Op::Phi) {
            let ways = phi.operands.chunks(2).filter(|way| reached.leads(way, label));
            phi.operands = ways.flatten().cloned().collect();
            // A value would be chosen by where control came from, and it comes from nowhere.
            if phi.operands.is_empty() {
                return None;
            }
        }
    }
    (is_structured(function) && is_ordered(function, &reached)).then_some(())
}

/// Whether each branch begins a construct of its own or leaves one that is still there.
fn is_structured(function: &Function) -> bool {
    let all_ends: HashSet<Word> = function.blocks.iter().flat_map(ends).collect();
    function.blocks.iter().all(|block| {
        let branches = block.instructions.last().is_some_and(|i| i.class.opcode == Op::BranchConditional);
        let targets = targets(block);
        !branches
            || !ends(block).is_empty()
            || targets.iter().all(|t| *t == targets[0])
            || targets.iter().any(|t| all_ends.contains(t))
    })
}

/// Whether blocks still stand after those that all ways to them go through: it suffices that some way to each comes from
/// before it.
fn is_ordered(function: &Function, reached: &Reached) -> bool {
    let mut before = HashSet::new();
    let mut ways: HashMap<Word, Vec<Word>> = HashMap::new();
    for &(from, to) in &reached.ways {
        ways.entry(to).or_default().push(from);
    }
    function.blocks.iter().filter_map(Block::label_id).all(|label| {
        let ordered = before.is_empty() || ways.get(&label).is_none_or(|from| from.iter().any(|f| before.contains(f)));
        before.insert(label);
        ordered
    })
}

/// Blocks that are kept, and the ways between them.
struct Reached {
    blocks: HashSet<Word>,
    ways: HashSet<(Word, Word)>,
}

impl Reached {
    fn from(entry: Word, blocks: &HashMap<Word, &Block>, known: &Constants) -> Self {
        let mut reached = Self { blocks: HashSet::from([entry]), ways: HashSet::new() };
        let mut open = vec![entry];
        while let Some(label) = open.pop() {
            let Some(block) = blocks.get(&label) else { continue };
            // The ends of constructs have to be there, reached or not.
            let (next, ends) = match only_way(block, known) {
                Some(target) => (vec![target], Vec::new()),
                None => (targets(block), ends(block)),
            };
            reached.ways.extend(next.iter().map(|&target| (label, target)));
            for target in next.into_iter().chain(ends) {
                if reached.blocks.insert(target) {
                    open.push(target);
                }
            }
        }
        reached
    }

    fn contains(&self, block: &Block) -> bool {
        block.label_id().is_some_and(|label| self.blocks.contains(&label))
    }

    /// Whether control comes to `label` by a way of a phi: a value and the block it comes from.
    fn leads(&self, way: &[Operand], label: Word) -> bool {
        way.get(1).and_then(Operand::id_ref_any).is_some_and(|from| self.ways.contains(&(from, label)))
    }
}

/// Records the results of a block's instructions that can be told.
fn learn(block: &Block, reached: &Reached, known: &mut Constants) {
    let Some(label) = block.label_id() else { return };
    for i in &block.instructions {
        let Some(id) = i.result_id else { continue };
        let value = if i.class.opcode == Op::Phi {
            let mut ways = i.operands.chunks(2).filter(|way| reached.leads(way, label));
            let value = |way: &[Operand]| known.get(&way.first()?.id_ref_any()?).copied();
            ways.next().and_then(value).filter(|&first| ways.all(|way| value(way) == Some(first)))
        } else {
            fold(i.class.opcode, &i.operands, known)
        };
        known.extend(value.map(|v| (id, v)));
    }
}

/// Where an `if` leads whose condition is known. (Loops may end at a known condition too; they are left alone.)
fn only_way(block: &Block, known: &Constants) -> Option<Word> {
    let [.., merge, branch] = &block.instructions[..] else { return None };
    if merge.class.opcode != Op::SelectionMerge || branch.class.opcode != Op::BranchConditional {
        return None;
    }
    let condition = known.get(&branch.operands.first()?.id_ref_any()?)?;
    branch.operands.get(if *condition != 0 { 1 } else { 2 })?.id_ref_any()
}

/// Where a block's last instruction may lead.
fn targets(block: &Block) -> Vec<Word> {
    let Some(last) = block.instructions.last() else { return Vec::new() };
    let skipped = match last.class.opcode {
        Op::Branch => 0,
        // A condition or a selector first.
        Op::BranchConditional | Op::Switch => 1,
        _ => return Vec::new(),
    };
    last.operands.iter().skip(skipped).filter_map(Operand::id_ref_any).collect()
}

/// The merge block of the construct that a block begins, and a loop's continue target.
fn ends(block: &Block) -> Vec<Word> {
    let merges = block.instructions.iter().filter(|i| matches!(i.class.opcode, Op::SelectionMerge | Op::LoopMerge));
    merges.flat_map(|i| &i.operands).filter_map(Operand::id_ref_any).collect()
}
