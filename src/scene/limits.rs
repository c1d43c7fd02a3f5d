//! Limits of what scenes may hold.

use std::ops::RangeInclusive;

/// Largest magnitude of any number of a scene: leaves room below `f32::MAX` (3.4e38) for a sum or a product with a
/// few others, since images are rendered in single precision.
pub const MAX_MAGNITUDE: f64 = 1e30;

/// Smallest radius of a sphere: with room to spare above the smallest normal number in single precision (1.2e-38).
pub const MIN_RADIUS: f64 = 1e-30;

/// Largest width and height of an image, pixels.
pub const MAX_IMAGE_SIDE: u32 = 65_536;

/// Largest [`Integrator::max_depth`].
pub const MAX_DEPTH: u32 = 65_535;

/// Largest [`Integrator::samples`]: three bits of an index are left for the renderer's groups of pixels.
pub const MAX_SAMPLES: u32 = 1 << 29;

/// Indices of refraction that glass may have. Those of matter are within 1 and 5, or their inverse; beyond this range
/// a surface passes light at hardly any angle, or refraction is made of rounding errors.
pub const IOR_RANGE: RangeInclusive<f64> = 1e-3..=1e3;

/// [`IOR_RANGE`], for messages.
pub(super) const EXPECTED_IOR: &str = "a number from 0.001 to 1000";

/// Stops by which an image is brightened or darkened, at most.
pub(super) const MAX_EXPOSURE: f64 = 64.0;
