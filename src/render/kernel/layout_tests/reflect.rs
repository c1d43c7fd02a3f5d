//! As much of a SPIR-V reader as the comparison with layout.rs needs. Opcodes, decorations and storage classes are
//! those of the SPIR-V specification 1.6, section 3.

use std::collections::HashMap;

use crate::spirv::words_of;

/// What a compute shader shares with its host.
#[derive(Default)]
pub struct Interface {
    /// Name (empty for the workgroup's size) and id of each specialization constant.
    pub constants: Vec<(String, u32)>,
    /// Set, number, name (of the block's type, where there is a block) and whether it is a storage buffer.
    pub bindings: Vec<(u32, u32, String, bool)>,
    /// Name and byte offset of each push constant, in order.
    pub push: Vec<(String, usize)>,
    /// Bytes of all push constants.
    pub push_bytes: usize,
    /// Name and byte offset of each member of the uniform block, in order.
    pub values: Vec<(String, usize)>,
}

#[derive(Default)]
struct Module {
    names: HashMap<u32, String>,
    member_names: HashMap<(u32, u32), String>,
    decorations: HashMap<(u32, u32), u32>,
    offsets: HashMap<(u32, u32), usize>,
    pointees: HashMap<u32, u32>,
    structs: HashMap<u32, Vec<u32>>,
    /// Bytes of scalars and vectors.
    sizes: HashMap<u32, usize>,
    constants: Vec<u32>,
    /// Type of the pointer, id, storage class.
    variables: Vec<[u32; 3]>,
}

const SPEC_ID: u32 = 1;
const BINDING: u32 = 33;
const DESCRIPTOR_SET: u32 = 34;
const OFFSET: u32 = 35;
const UNIFORM: u32 = 2;
const PUSH_CONSTANT: u32 = 9;
const STORAGE_BUFFER: u32 = 12;

/// Reads the interface of a module.
pub fn interface(binary: &[u8]) -> Interface {
    let words = words_of(binary);
    assert_eq!(words[0], 0x0723_0203, "not SPIR-V");
    let mut module = Module::default();
    let mut rest = &words[5..];
    while let Some(&first) = rest.first() {
        let (count, opcode) = ((first >> 16) as usize, first & 0xffff);
        module.read(opcode, &rest[1..count]);
        rest = &rest[count..];
    }
    module.interface()
}

impl Module {
    fn read(&mut self, opcode: u32, operands: &[u32]) {
        match (opcode, operands) {
            (5, [id, name @ ..]) => drop(self.names.insert(*id, text(name))),
            (6, [id, member, name @ ..]) => drop(self.member_names.insert((*id, *member), text(name))),
            (71, [id, decoration, value]) => drop(self.decorations.insert((*id, *decoration), *value)),
            (72, [id, member, OFFSET, value]) => drop(self.offsets.insert((*id, *member), *value as usize)),
            (21, [id, bits, _]) | (22, [id, bits]) => drop(self.sizes.insert(*id, *bits as usize / 8)),
            // Booleans have no size.
            (23, [id, component, count]) if self.sizes.contains_key(component) => {
                let bytes = self.sizes[component] * *count as usize;
                self.sizes.insert(*id, bytes);
            }
            (30, [id, members @ ..]) => drop(self.structs.insert(*id, members.to_vec())),
            (32, [id, _, pointee]) => drop(self.pointees.insert(*id, *pointee)),
            (48..=50, [_, id, ..]) => self.constants.push(*id),
            (59, [pointer, id, class, ..]) => self.variables.push([*pointer, *id, *class]),
            _ => {}
        }
    }

    fn interface(&self) -> Interface {
        let mut found = Interface::default();
        let name = |id: &u32| self.names.get(id).cloned().unwrap_or_default();
        for id in &self.constants {
            if let Some(spec_id) = self.decorations.get(&(*id, SPEC_ID)) {
                found.constants.push((name(id), *spec_id));
            }
        }
        for &[pointer, id, class] in &self.variables {
            let pointee = self.pointees[&pointer];
            if let Some(&number) = self.decorations.get(&(id, BINDING)) {
                let set = self.decorations[&(id, DESCRIPTOR_SET)];
                let shown = if self.structs.contains_key(&pointee) { name(&pointee) } else { name(&id) };
                found.bindings.push((set, number, shown, class == STORAGE_BUFFER));
            }
            let member = |i| (self.member_names[&(pointee, i)].clone(), self.offsets[&(pointee, i)]);
            if class == PUSH_CONSTANT {
                for (i, ty) in (0..).zip(&self.structs[&pointee]) {
                    found.push.push(member(i));
                    found.push_bytes = member(i).1 + self.sizes[ty];
                }
            }
            if class == UNIFORM {
                found.values = (0..self.structs[&pointee].len() as u32).map(member).collect();
            }
        }
        found.bindings.sort();
        found
    }
}

/// A literal string: bytes in little-endian words, ended by a zero.
fn text(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|&b| b != 0).collect();
    String::from_utf8(bytes).unwrap()
}
