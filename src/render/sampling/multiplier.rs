//! How many samples pixels get of those that are asked for.

use bytemuck::Zeroable;

use crate::render::kernel::layout::multiplier;

/// How many times as many samples as are asked for a pixel is to have: the logarithm to the base of 2, from -1 to 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Zeroable)]
pub(crate) struct Multiplier(pub(super) i8);

impl Multiplier {
    /// As many.
    pub const ONE: Self = Self(0);
    pub const TWO: Self = Self(1);
    pub const FOUR: Self = Self(2);
    /// From the least to the greatest.
    pub const ALL: [Self; 7] = [Self(-1), Self(0), Self(1), Self(2), Self(3), Self(4), Self(5)];
    /// Those by which samples are allocated for a cost.
    pub const OF_TILES: [Self; 4] = [Self(-1), Self(0), Self(1), Self(2)];

    /// The nearest to such a logarithm.
    pub fn near(logarithm: f64) -> Self {
        Self(logarithm.round().clamp(-1.0, 5.0) as i8)
    }

    /// What it multiplies by.
    pub fn factor(self) -> f64 {
        f64::from(self.0).exp2()
    }

    /// So many times `samples`.
    pub fn of(self, samples: u32) -> u32 {
        if self.0 < 0 { samples.div_ceil(2) } else { samples.saturating_mul(1 << self.0) }
    }

    /// Its bits in the shaders.
    pub fn bits(self) -> u32 {
        u32::from(self.0.cast_unsigned()) & ((1 << multiplier::BITS) - 1)
    }

    /// Its place among all.
    pub fn index(self) -> usize {
        (self.0 + 1) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multipliers_are_powers_of_two() {
        let of = |samples: u32| [-1.2, 0.1, 1.0, 7.0].map(|logarithm| Multiplier::near(logarithm).of(samples));
        assert_eq!((of(8), of(1), of(0)), ([4, 8, 16, 256], [1, 1, 2, 32], [0; 4]));
        assert_eq!(Multiplier::ALL.map(Multiplier::factor), [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0]);
        assert_eq!(Multiplier::ALL.map(Multiplier::bits), [15, 0, 1, 2, 3, 4, 5]);
        assert_eq!([f64::NEG_INFINITY, f64::NAN].map(Multiplier::near), [Multiplier(-1), Multiplier(0)]);
    }
}
