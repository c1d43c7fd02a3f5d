use rspirv::binary::Assemble;
use rspirv::dr::{Builder, Module, Operand, load_words};
use rspirv::spirv::{
    AddressingModel, Capability, Decoration, ExecutionModel, FunctionControl, MemoryModel, Op, SelectionControl,
    StorageClass, Word,
};

use crate::gpu::prune::prune;
use crate::gpu::specialization::Specialization;

/// Types and a few functions that do nothing, by the order in which they were made.
struct Made {
    builder: Builder,
    void: Word,
    boolean: Word,
    uint: Word,
    callees: Vec<Word>,
}

impl Made {
    fn new(callees: usize) -> Self {
        let mut builder = Builder::new();
        builder.set_version(1, 5);
        builder.capability(Capability::Shader);
        builder.memory_model(AddressingModel::Logical, MemoryModel::GLSL450);
        let (void, boolean, uint) = (builder.type_void(), builder.type_bool(), builder.type_int(32, 0));
        let nullary = builder.type_function(void, []);
        let callees = (0..callees)
            .map(|i| {
                let function = builder.begin_function(void, None, FunctionControl::NONE, nullary).unwrap();
                builder.name(function, format!("callee {i}"));
                builder.begin_block(None).unwrap();
                builder.ret().unwrap();
                builder.end_function().unwrap();
                function
            })
            .collect();
        Self { builder, void, boolean, uint, callees }
    }

    fn specialized(&mut self, constant: Word, id: u32) -> Word {
        self.builder.decorate(constant, Decoration::SpecId, [Operand::LiteralBit32(id)]);
        constant
    }

    /// Begins `main`.
    fn main(&mut self) {
        let nullary = self.builder.type_function(self.void, []);
        let main = self.builder.begin_function(self.void, None, FunctionControl::NONE, nullary).unwrap();
        self.builder.entry_point(ExecutionModel::GLCompute, main, "main", []);
        self.builder.begin_block(None).unwrap();
    }

    fn call(&mut self, callee: usize) {
        self.builder.function_call(self.void, None, self.callees[callee], []).unwrap();
    }

    /// `if (condition) callee 0 else callee 1`, and goes on after it.
    fn choose(&mut self, condition: Word) {
        let (yes, no, end) = (self.builder.id(), self.builder.id(), self.builder.id());
        self.builder.selection_merge(end, SelectionControl::NONE).unwrap();
        self.builder.branch_conditional(condition, yes, no, []).unwrap();
        for (callee, label) in [yes, no].into_iter().enumerate() {
            self.builder.begin_block(Some(label)).unwrap();
            self.call(callee);
            self.builder.branch(end).unwrap();
        }
        self.builder.begin_block(Some(end)).unwrap();
    }

    /// Ends `main` and the module.
    fn words(mut self) -> Vec<u32> {
        self.builder.ret().unwrap();
        self.builder.end_function().unwrap();
        self.builder.module().assemble()
    }
}

/// The names of the callees that are left, and the blocks of `main`.
fn left(words: &[u32], specialization: &Specialization) -> (Vec<String>, usize) {
    let pruned = load_words(prune(words, specialization).unwrap()).unwrap();
    (names(&pruned), pruned.functions.last().unwrap().blocks.len())
}

fn names(module: &Module) -> Vec<String> {
    module.debug_names.iter().filter_map(|i| Some(i.operands.get(1)?.unwrap_literal_string().to_owned())).collect()
}

#[test]
fn branches_that_a_constant_rules_out_go_with_what_only_they_call() {
    let mut made = Made::new(3);
    let boolean = made.boolean;
    let condition = made.builder.spec_constant_true(boolean);
    let condition = made.specialized(condition, 7);
    made.main();
    made.choose(condition);
    let words = made.words();
    let with = |value| {
        let mut s = Specialization::default();
        s.bool(7, value);
        s
    };
    assert_eq!(left(&words, &with(true)), (vec!["callee 0".to_owned()], 3));
    assert_eq!(left(&words, &with(false)), (vec!["callee 1".to_owned()], 3));
    // The constant's own value.
    assert_eq!(left(&words, &Specialization::default()), (vec!["callee 0".to_owned()], 3));
}

#[test]
fn conditions_are_reckoned() {
    let mut made = Made::new(2);
    let (boolean, uint) = (made.boolean, made.uint);
    let count = made.builder.spec_constant_bit32(uint, 2);
    let count = made.specialized(count, 9);
    let three = made.builder.constant_bit32(uint, 3);
    let less = made.builder.spec_constant_op(boolean, Op::ULessThan);
    let operation = made.builder.module_mut().types_global_values.last_mut().unwrap();
    operation.operands.extend([count, three].map(Operand::IdRef));
    made.main();
    // count < 3 && !(count < 3), as a compiler may write it: a block of its own for the second half.
    let (second, end, start) = (made.builder.id(), made.builder.id(), made.builder.id());
    made.builder.branch(start).unwrap();
    made.builder.begin_block(Some(start)).unwrap();
    made.builder.selection_merge(end, SelectionControl::NONE).unwrap();
    made.builder.branch_conditional(less, second, end, []).unwrap();
    made.builder.begin_block(Some(second)).unwrap();
    let not = made.builder.logical_not(boolean, None, less).unwrap();
    made.builder.branch(end).unwrap();
    made.builder.begin_block(Some(end)).unwrap();
    let both = made.builder.phi(boolean, None, [(less, start), (not, second)]).unwrap();
    made.choose(both);
    let words = made.words();
    for value in [2, 3] {
        let mut s = Specialization::default();
        s.uint(9, value);
        let (names, blocks) = left(&words, &s);
        assert_eq!((names, blocks), (vec!["callee 1".to_owned()], if value == 2 { 6 } else { 5 }));
    }
}

#[test]
fn what_is_not_known_stays() {
    let mut made = Made::new(2);
    let boolean = made.boolean;
    let unknown = made.builder.undef(boolean, None);
    made.main();
    made.choose(unknown);
    let words = made.words();
    let all = vec!["callee 0".to_owned(), "callee 1".to_owned()];
    assert_eq!(left(&words, &Specialization::default()), (all, 4));
}

#[test]
fn shapes_that_compilers_do_not_make_are_left_to_the_driver() {
    // What leaves an `if` that is no longer there would be an `if` without an end.
    let mut made = Made::new(2);
    let boolean = made.boolean;
    let known = made.builder.spec_constant_true(boolean);
    let unknown = made.builder.undef(boolean, None);
    made.main();
    let [yes, inner, no, end] = [(); 4].map(|()| made.builder.id());
    made.builder.selection_merge(end, SelectionControl::NONE).unwrap();
    made.builder.branch_conditional(known, yes, no, []).unwrap();
    made.builder.begin_block(Some(yes)).unwrap();
    made.builder.branch_conditional(unknown, inner, end, []).unwrap();
    for label in [inner, no] {
        made.builder.begin_block(Some(label)).unwrap();
        made.builder.branch(end).unwrap();
    }
    made.builder.begin_block(Some(end)).unwrap();
    assert_eq!(prune(&made.words(), &Specialization::default()), None);

    // The end before its only way.
    let mut made = Made::new(2);
    let boolean = made.boolean;
    let known = made.builder.spec_constant_true(boolean);
    made.main();
    let [yes, no, end] = [(); 3].map(|()| made.builder.id());
    made.builder.selection_merge(end, SelectionControl::NONE).unwrap();
    made.builder.branch_conditional(known, yes, no, []).unwrap();
    made.builder.begin_block(Some(end)).unwrap();
    made.builder.ret().unwrap();
    for label in [yes, no] {
        made.builder.begin_block(Some(label)).unwrap();
        made.builder.branch(end).unwrap();
    }
    made.builder.end_function().unwrap();
    assert_eq!(prune(&made.builder.module().assemble(), &Specialization::default()), None);

    // Ids of constants by way of a group.
    let mut made = Made::new(2);
    let group = made.builder.id();
    made.builder.decoration_group();
    made.builder.decorate(group, Decoration::SpecId, [Operand::LiteralBit32(7)]);
    made.main();
    assert_eq!(prune(&made.words(), &Specialization::default()), None);
}

#[test]
fn what_is_no_spirv_is_left_to_the_driver() {
    let header = [0x0723_0203, 0x0001_0500, 0, 9, 0];
    assert_eq!(prune(&[], &Specialization::default()), None);
    assert_eq!(prune(&header[..3], &Specialization::default()), None);
    for instruction in [
        // Longer than the file; without a length; a string without an end.
        &[9 << 16 | Op::Nop as u32][..],
        &[Op::Nop as u32],
        &[6 << 16 | Op::ExtInstImport as u32, 1, 0x4c53_4c47],
        // Operations that are none.
        &[4 << 16 | Op::SpecConstantOp as u32, 1, 2, Op::Switch as u32],
        &[4 << 16 | Op::SpecConstantOp as u32, 1, 2, 0xffff],
        &[3 << 16 | Op::SpecConstantOp as u32, 1, 2],
    ] {
        assert_eq!(prune(&[&header, instruction].concat(), &Specialization::default()), None, "{instruction:x?}");
    }
}

#[test]
fn variables_that_nothing_names_any_more_go() {
    let mut made = Made::new(2);
    let (boolean, uint) = (made.boolean, made.uint);
    let condition = made.builder.spec_constant_true(boolean);
    let condition = made.specialized(condition, 7);
    let pointer = made.builder.type_pointer(None, StorageClass::Private, uint);
    let [kept, dropped] = [(); 2].map(|()| made.builder.variable(pointer, None, StorageClass::Private, None));
    for (variable, name) in [(kept, "kept"), (dropped, "dropped")] {
        made.builder.name(variable, name);
    }
    made.main();
    made.builder.module_mut().entry_points[0].operands.extend([kept, dropped].map(Operand::IdRef));
    let [yes, no, end] = [(); 3].map(|()| made.builder.id());
    made.builder.selection_merge(end, SelectionControl::NONE).unwrap();
    made.builder.branch_conditional(condition, yes, no, []).unwrap();
    for (label, variable) in [(yes, kept), (no, dropped)] {
        made.builder.begin_block(Some(label)).unwrap();
        made.builder.load(uint, None, variable, None, []).unwrap();
        made.builder.branch(end).unwrap();
    }
    made.builder.begin_block(Some(end)).unwrap();
    let pruned = load_words(prune(&made.words(), &Specialization::default()).unwrap()).unwrap();
    assert_eq!(names(&pruned), ["kept"]);
    assert_eq!(pruned.entry_points[0].operands[3..], [Operand::IdRef(kept)]);
}
