//! What a driver was given, kept for those who mend it.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::gpu::code::{Code, pruned};
use crate::gpu::kept_layout::BindingKind;

/// Bytes of a buffer that are kept; of longer ones only their beginning.
const MOST_BYTES: usize = 32 << 20;
/// Shaders and buffers that are kept: the last ones.
const MOST: usize = 24;

/// The last shaders that a driver was given, and the last contents of buffers.
#[derive(Debug, Clone, Default)]
pub struct Capture {
    /// Shaders in the order in which they were made.
    pub shaders: Vec<CapturedShader>,
    /// Buffers by name; of a name the last.
    pub buffers: Vec<CapturedBuffer>,
}

/// A shader as the driver got it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CapturedShader {
    /// What it is called.
    pub name: String,
    /// Its SPIR-V, without what its constants switch off.
    pub spirv: Vec<u8>,
    /// Values of specialization constants by id, as bits.
    pub constants: Vec<(u32, u32)>,
    /// Numbers of its bindings, and what they are.
    pub bindings: Vec<(u32, &'static str)>,
    /// Bytes of its push constants.
    pub push_bytes: u32,
}

/// What a buffer held.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CapturedBuffer {
    /// What it is called.
    pub name: String,
    /// Its bytes, or the first of them.
    pub bytes: Vec<u8>,
    /// All of its bytes.
    pub length: usize,
}

/// A [`Capture`] that several threads add to.
#[derive(Default)]
pub(crate) struct Captures(Mutex<Capture>);

impl Captures {
    /// Keeps a shader that is about to be compiled.
    pub(super) fn shader(&self, code: &Code<'_>, bindings: &[(u32, BindingKind)], push_bytes: u32) {
        let spirv = bytemuck::cast_slice(&pruned(code)).to_vec();
        let shader = CapturedShader {
            name: code.name.to_owned(),
            spirv,
            constants: code.specialization.entries.clone(),
            bindings: bindings.iter().map(|&(number, kind)| (number, kind.word())).collect(),
            push_bytes,
        };
        let mut all = self.lock();
        all.shaders.retain(|known| *known != shader);
        all.shaders.push(shader);
        if all.shaders.len() > MOST {
            all.shaders.remove(0);
        }
    }

    /// Keeps what a buffer holds.
    pub fn buffer(&self, name: &str, bytes: &[u8]) {
        let kept = bytes[..bytes.len().min(MOST_BYTES)].to_vec();
        let buffer = CapturedBuffer { name: name.to_owned(), bytes: kept, length: bytes.len() };
        let mut all = self.lock();
        all.buffers.retain(|known| known.name != name);
        all.buffers.push(buffer);
        if all.buffers.len() > MOST {
            all.buffers.remove(0);
        }
    }

    /// All that is kept, of which nothing is left.
    pub fn take(&self) -> Capture {
        std::mem::take(&mut *self.lock())
    }

    fn lock(&self) -> MutexGuard<'_, Capture> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_name_the_last_is_kept_and_of_all_the_last_ones() {
        let captures = Captures::default();
        for i in 0..MOST + 3 {
            captures.buffer(&format!("b{i}"), &[i as u8]);
        }
        captures.buffer("b9", b"again");
        let taken = captures.take();
        let names: Vec<_> = taken.buffers.iter().map(|b| b.name.as_str()).collect();
        assert_eq!((names.len(), names[0], names[MOST - 1]), (MOST, "b3", "b9"));
        assert_eq!((&taken.buffers[MOST - 1].bytes[..], taken.buffers[MOST - 1].length), (&b"again"[..], 5));
        assert!(captures.take().buffers.is_empty());
    }
}
