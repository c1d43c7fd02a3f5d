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
/// (Knuth, The Art of Computer Programming, volume 3, section 6.4); the higher bits are the better ones.
pub(crate) fn mix(hash: u64, number: u32) -> u64 {
    (hash.rotate_left(5) ^ u64::from(number)).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// The hash of some bytes.
pub(crate) fn fnv(bytes: &[u8]) -> u64 {
    let mut hash = Fnv::default();
    hash.write(bytes);
    hash.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fnv_of_the_published_vector() {
        assert_eq!(fnv(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn numbers_are_mixed_in_their_order() {
        assert_eq!(mix(0, 1), 0x9e37_79b9_7f4a_7c15);
        assert_ne!(mix(mix(0, 1), 2), mix(mix(0, 2), 1));
    }
}
