//! SPIR-V as words: the instructions of a module, one after another.
//!
//! The build script includes this file.

/// The words before the first instruction (SPIR-V specification 1.6, section 2.3).
pub const HEADER_WORDS: usize = 5;

/// The words of SPIR-V, whatever the alignment of its bytes.
pub fn words_of(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
}

/// What an instruction does: the lower half of its first word.
pub fn opcode(instruction: &[u32]) -> u32 {
    instruction[0] & 0xffff
}

/// The instructions of a module, each with its first word, up to the first that does not end within it.
pub fn instructions(words: &[u32]) -> Instructions<'_> {
    Instructions { rest: words.get(HEADER_WORDS..).unwrap_or_default() }
}

/// See [`instructions`].
#[derive(Clone)]
pub struct Instructions<'a> {
    rest: &'a [u32],
}

impl<'a> Instructions<'a> {
    /// What has not been read: at the end, words that are no instructions.
    pub fn rest(&self) -> &'a [u32] {
        self.rest
    }
}

impl<'a> Iterator for Instructions<'a> {
    type Item = &'a [u32];

    fn next(&mut self) -> Option<&'a [u32]> {
        // The upper half of the first word counts the words.
        let count = (self.rest.first()? >> 16) as usize;
        let (instruction, rest) = self.rest.split_at_checked(count).filter(|_| count > 0)?;
        self.rest = rest;
        Some(instruction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_instruction_is_left_over() {
        let header = [7; HEADER_WORDS];
        let whole = [3 << 16 | 71, 1, 20, 1 << 16 | 56];
        let mut all = instructions(&[&header[..], &whole].concat()).map(<[u32]>::to_vec).collect::<Vec<_>>();
        assert_eq!((all.pop(), all.pop(), all.pop()), (Some(vec![1 << 16 | 56]), Some(whole[..3].to_vec()), None));
        for strange in [&[71, 1][..], &[3 << 16 | 71, 1]] {
            let words = [&header[..], &whole, strange].concat();
            let mut read = instructions(&words);
            assert_eq!(read.by_ref().count(), 2);
            assert_eq!(read.rest(), strange);
        }
        assert_eq!(instructions(&header[..3]).count(), 0);
        assert_eq!(opcode(&whole), 71);
        assert_eq!(words_of(&[1, 0, 0, 0, 0, 2, 0, 0, 9]), [1, 0x200]);
    }
}
