//! The transfer curves of 8-bit output, in both directions.

use crate::scene::{Transfer, srgb};

impl Transfer {
    /// Encoded value of a linear one, both clamped to 0..=1; NaN becomes 0.
    ///
    /// sRGB is the piecewise curve of IEC 61966-2-1.
    pub fn encode(self, linear: f64) -> f64 {
        let linear = clamp(linear, 1.0);
        match self {
            Self::Gamma(gamma) => linear.powf(1.0 / gamma),
            Self::Srgb => srgb::encode(linear),
        }
    }

    /// Linear value of an encoded one, both clamped to 0..=1; NaN becomes 0.
    pub fn decode(self, encoded: f64) -> f64 {
        let encoded = clamp(encoded, 1.0);
        match self {
            Self::Gamma(gamma) => encoded.powf(gamma),
            Self::Srgb => srgb::decode(encoded),
        }
    }

    /// The 8-bit code nearest to the encoded value: `floor(255·encode(linear) + 0.5)`.
    pub fn code(self, linear: f32) -> u8 {
        // In 0.5..=255.5, so that the conversion (which truncates) is the floor.
        (255.0 * self.encode(f64::from(linear)) + 0.5) as u8
    }
}

/// The value clamped to 0..=`max`; NaN becomes 0 (as `f64::clamp` would not have it).
pub(super) fn clamp(value: f64, max: f64) -> f64 {
    if value > 0.0 { value.min(max) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_codes() {
        // Computed by hand: 255·0.5^(1/2.2) = 186.08, 255·0.18^(1/2.2) = 116.97; sRGB of 0.5, 0.18 and
        // 0.002 is 0.735357, 0.461356 and 0.02584 (linear part).
        for (transfer, linear, code) in [
            (Transfer::Gamma(2.2), 0.5, 186),
            (Transfer::Gamma(2.2), 0.18, 117),
            (Transfer::Gamma(1.0), 0.5, 128),
            (Transfer::Srgb, 0.5, 188),
            (Transfer::Srgb, 0.18, 118),
            (Transfer::Srgb, 0.002, 7),
            (Transfer::Srgb, 0.0, 0),
            (Transfer::Srgb, 1.0, 255),
            (Transfer::Gamma(2.2), -1.0, 0),
            (Transfer::Gamma(2.2), 7.0, 255),
            (Transfer::Gamma(2.2), f32::INFINITY, 255),
            (Transfer::Gamma(2.2), f32::NEG_INFINITY, 0),
            (Transfer::Srgb, f32::NAN, 0),
        ] {
            assert_eq!(transfer.code(linear), code, "{transfer:?} of {linear}");
        }
    }

    #[test]
    fn srgb_known_values_and_joint() {
        assert!((Transfer::Srgb.encode(0.5) - 0.735_356_983_052_449_1).abs() < 1e-12);
        assert!((Transfer::Srgb.decode(0.5) - 0.214_041_140_482_232_55).abs() < 1e-12);
        // The standard's rounded constants leave a step of less than 1e-7 where the pieces meet.
        assert!((Transfer::Srgb.encode(0.003_130_8) - Transfer::Srgb.encode(0.003_130_800_1)).abs() < 1e-7);
    }

    #[test]
    fn decode_inverts_encode_on_all_codes() {
        for transfer in [Transfer::Gamma(2.2), Transfer::Gamma(1.0), Transfer::Gamma(0.7), Transfer::Srgb] {
            for code in 0..=255u8 {
                let linear = transfer.decode(f64::from(code) / 255.0) as f32;
                assert_eq!(transfer.code(linear), code, "{transfer:?}");
            }
        }
    }
}
