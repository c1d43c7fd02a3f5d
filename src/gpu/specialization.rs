//! Values of specialization constants.

use ash::vk;

/// Values of specialization constants, by id.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Specialization {
    pub(super) entries: Vec<(u32, u32)>,
}

impl Specialization {
    /// Sets an unsigned constant, which may have had another value.
    pub fn uint(&mut self, id: u32, value: u32) -> &mut Self {
        // Vulkan wants each of them once.
        match self.entries.iter_mut().find(|entry| entry.0 == id) {
            Some(entry) => entry.1 = value,
            None => self.entries.push((id, value)),
        }
        self
    }

    /// Sets a signed constant.
    pub fn int(&mut self, id: u32, value: i32) -> &mut Self {
        self.uint(id, value as u32)
    }

    /// Sets a float constant, bit for bit.
    pub fn float(&mut self, id: u32, value: f32) -> &mut Self {
        self.uint(id, value.to_bits())
    }

    /// Sets a boolean constant.
    pub fn bool(&mut self, id: u32, value: bool) -> &mut Self {
        self.uint(id, u32::from(value))
    }

    /// The value of a constant, if it is set.
    pub(super) fn value(&self, id: u32) -> Option<u32> {
        self.entries.iter().find(|&&(i, _)| i == id).map(|&(_, value)| value)
    }

    /// As Vulkan wants it: where each constant is in the data, and the data.
    pub(super) fn raw(&self) -> (Vec<vk::SpecializationMapEntry>, Vec<u8>) {
        let entry = |(i, &(id, _)): (usize, &(u32, u32))| vk::SpecializationMapEntry {
            constant_id: id,
            offset: 4 * i as u32,
            size: 4,
        };
        (
            self.entries.iter().enumerate().map(entry).collect(),
            self.entries.iter().flat_map(|&(_, value)| value.to_ne_bytes()).collect(),
        )
    }
}
