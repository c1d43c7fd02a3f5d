//! Colours.

/// Linear RGB: a reflectance (0..=1), a radiance or a power, according to use.
pub type Rgb = [f64; 3];
