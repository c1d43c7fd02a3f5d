//! Random numbers that the shaders do not share.

/// PCG XSL RR 128/64 (O'Neill, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms
/// for Random Number Generation", 2014).
#[derive(Debug, Clone)]
pub struct Pcg64 {
    state: u128,
    increment: u128,
}

impl Pcg64 {
    const MULTIPLIER: u128 = 0x2360_ed05_1fc6_5da4_4385_df64_9fcc_f645;

    /// Seeds as the reference implementation does.
    pub fn new(state: u128, stream: u128) -> Self {
        let mut rng = Self { state: 0, increment: (stream << 1) | 1 };
        rng.next_u64();
        rng.state = rng.state.wrapping_add(state);
        rng.next_u64();
        rng
    }

    /// An independent sequence for each pair: streams alone are correlated, so the start is hashed as well.
    pub fn for_pixel(seed: u64, pixel: u64) -> Self {
        let high = split_mix(split_mix(seed) ^ pixel);
        let low = split_mix(high);
        Self::new(u128::from(high) << 64 | u128::from(low), u128::from(pixel))
    }

    /// 64 random bits.
    pub fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_mul(Self::MULTIPLIER).wrapping_add(self.increment);
        let folded = (self.state >> 64) as u64 ^ self.state as u64;
        folded.rotate_right((self.state >> 122) as u32)
    }

    /// Uniform in [0, 1), a multiple of 2⁻⁵³.
    pub fn uniform(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (0.5 * f64::EPSILON)
    }
}

/// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014): a bijective hash.
fn split_mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::Pcg64;

    /// The first outputs of `pcg64` seeded with 42, 54, from the author's test suite (check-pcg64.out).
    #[test]
    fn agrees_with_the_reference_implementation() {
        let mut rng = Pcg64::new(42, 54);
        let expected = [
            0x86b1_da1d_7206_2b68,
            0x1304_aa46_c985_3d39,
            0xa367_0e9e_0dd5_0358,
            0xf909_0e52_9a7d_ae00,
            0xc85b_9fd8_3799_6f2c,
            0x6061_21f8_e391_9196,
        ];
        assert_eq!(expected.map(|_| rng.next_u64()), expected);
    }
}
