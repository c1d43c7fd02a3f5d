//! Hashes that are the same on every machine and in every version.

use std::hash::Hasher;

use glam::DVec3;

/// FNV-1a, 64 bits (Fowler, Noll and Vo).
pub(crate) struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Hasher for Fnv {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

impl Fnv {
    /// Adds numbers, by their bits.
    pub fn numbers(&mut self, values: &[f64]) {
        for v in values {
            self.write(&v.to_bits().to_le_bytes());
        }
    }

    /// Adds points, and how many there are.
    pub fn points(&mut self, points: &[DVec3]) {
        self.count(points.len());
        points.iter().for_each(|p| self.numbers(&p.to_array()));
    }

    /// Adds a number of things.
    pub fn count(&mut self, n: usize) {
        self.write(&(n as u64).to_le_bytes());
    }
}

/// Adds a number to a hash, faster and less well: for tables in memory. It multiplies by the golden ratio as a fraction of 2^64
/// (Knuth, The Art of Computer Programming, volume 3, section 6.4); the higher bits are the better ones. Numbers
/// that differ make different hashes of the same one.
pub(crate) fn mix(hash: u64, number: impl Into<u64>) -> u64 {
    (hash.rotate_left(5) ^ number.into()).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// The hash of some bytes, and of how many they are, eight at a time: a shader is half a megabyte, and FNV takes a millisecond for that.
pub(crate) fn digest(bytes: &[u8]) -> u64 {
    let (words, rest) = bytes.as_chunks::<8>();
    let mut last = [0; 8];
    last[..rest.len()].copy_from_slice(rest);
    let words = words.iter().chain([&last]).map(|word| u64::from_le_bytes(*word));
    words.fold(bytes.len() as u64, mix)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fnv_of_the_published_vector() {
        let mut hash = Fnv::default();
        hash.write(b"foobar");
        assert_eq!(hash.finish(), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn digests_tell_of_every_byte_of_their_order_and_of_how_many_they_are() {
        let bytes: Vec<u8> = (0..20).collect();
        let mut digests: Vec<_> = (0..=20).map(|n| digest(&bytes[..n])).collect();
        digests.extend([digest(&[0; 2]), digest(&[0; 8]), digest(&[0; 9])]);
        digests.extend((0..20).map(|i| {
            let mut changed = bytes.clone();
            changed[i] ^= 0x80;
            digest(&changed)
        }));
        digests.push(digest(&[&bytes[8..16], &bytes[..8], &bytes[16..]].concat()));
        let all = digests.len();
        digests.sort_unstable();
        digests.dedup();
        assert_eq!(digests.len(), all);
    }

    #[test]
    fn numbers_are_mixed_in_their_order() {
        assert_eq!(mix(0, 1u32), 0x9e37_79b9_7f4a_7c15);
        assert_ne!(mix(mix(0, 1u32), 2u32), mix(mix(0, 2u32), 1u32));
    }
}
