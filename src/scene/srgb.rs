//! The piecewise curve of sRGB, IEC 61966-2-1. Values beyond 1 go on along it.

/// What a code stands for.
pub(crate) fn decode(code: f64) -> f64 {
    if code <= 0.040_45 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

/// The code of a linear value.
pub(crate) fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
