//! Error maps: which pixels differ, and by how much, as colours.

use crate::image::metrics;
use crate::image::metrics::{RELATIVE_OFFSET, flip};
use crate::image::{Image, ImageError};
use crate::scene::Transfer;

/// What a heat map shows of each pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Root mean square of the difference over the channels, radiance.
    Difference,
    /// The difference over (reference + 1e-2), root mean square over the channels.
    Relative,
    /// LDR-FLIP.
    Flip,
}

/// The quantity in each pixel; NaN where a channel of either image is not finite.
///
/// `ppd` (pixels per degree) concerns FLIP only.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn error_map(image: &Image, reference: &Image, quantity: Quantity, ppd: f64) -> Result<Vec<f64>, ImageError> {
    metrics::check_sizes(image, reference)?;
    let pixels = || image.pixels().iter().zip(reference.pixels()).map(|(x, r)| (x.map(f64::from), r.map(f64::from)));
    let finite = |x: &[f64; 3], r: &[f64; 3]| x.iter().chain(r).all(|c| c.is_finite());
    Ok(match quantity {
        Quantity::Flip => flip::flip(image, reference, ppd)?
            .into_iter()
            .zip(pixels())
            .map(|(error, (x, r))| if finite(&x, &r) { error } else { f64::NAN })
            .collect(),
        Quantity::Difference | Quantity::Relative => pixels()
            .map(|(x, r)| match quantity {
                _ if !finite(&x, &r) => f64::NAN,
                Quantity::Relative => {
                    let over = |v: [f64; 3]| [0, 1, 2].map(|c| v[c] / (r[c].abs() + RELATIVE_OFFSET));
                    metrics::pixel_error(over(x), over(r))
                }
                _ => metrics::pixel_error(x, r),
            })
            .collect(),
    })
}

/// Colours the values 0..=`max` from black over red to pale yellow (magma); NaN is green.
///
/// The image is linear: written as PNG with [`Transfer::Srgb`], it has exactly the map's colours.
///
/// # Errors
/// As for [`Image::from_pixels`].
pub fn heat_map(width: u32, height: u32, values: &[f64], max: f64) -> Result<Image, ImageError> {
    let pixels = values
        .iter()
        .map(|&value| {
            let color = if value.is_nan() { [0.0, 1.0, 0.0] } else { magma(if max > 0.0 { value / max } else { 0.0 }) };
            color.map(|c| Transfer::Srgb.decode(c) as f32)
        })
        .collect();
    Image::from_pixels(width, height, pixels)
}

/// The colour map magma of N. Smith and S. van der Walt (matplotlib, CC0), sRGB-encoded, at t clamped to 0..=1.
///
/// Every 15th of its 256 colours, with straight lines between: within 0.011 of the others.
fn magma(t: f64) -> [f64; 3] {
    const COLORS: [[f64; 3]; 18] = [
        [0.0015, 0.0005, 0.0139],
        [0.0355, 0.0284, 0.1252],
        [0.1028, 0.0630, 0.2579],
        [0.1915, 0.0648, 0.3962],
        [0.2914, 0.0646, 0.4755],
        [0.3843, 0.0979, 0.5010],
        [0.4758, 0.1346, 0.5079],
        [0.5692, 0.1675, 0.5041],
        [0.6649, 0.1981, 0.4888],
        [0.7611, 0.2312, 0.4602],
        [0.8521, 0.2761, 0.4186],
        [0.9259, 0.3468, 0.3750],
        [0.9697, 0.4469, 0.3603],
        [0.9894, 0.5579, 0.3917],
        [0.9966, 0.6683, 0.4562],
        [0.9967, 0.7768, 0.5410],
        [0.9924, 0.8843, 0.6401],
        [0.9871, 0.9914, 0.7495],
    ];
    let position = t.clamp(0.0, 1.0) * (COLORS.len() - 1) as f64;
    let index = (position as usize).min(COLORS.len() - 2);
    let weight = position - index as f64;
    [0, 1, 2].map(|c| COLORS[index][c] + weight * (COLORS[index + 1][c] - COLORS[index][c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magma_at_known_points() {
        // Entries 0, 64, 128, 191 and 255 of matplotlib's table.
        for (t, expected) in [
            (0.0, [0.001462, 0.000466, 0.013866]),
            (64.0 / 255.0, [0.316654, 0.071690, 0.485380]),
            (128.0 / 255.0, [0.716387, 0.214982, 0.475290]),
            (191.0 / 255.0, [0.985693, 0.528148, 0.379371]),
            (1.0, [0.987053, 0.991438, 0.749504]),
        ] {
            let found = magma(t);
            for c in 0..3 {
                assert!((found[c] - expected[c]).abs() < 0.011, "{t}: {found:?}, expected {expected:?}");
            }
        }
    }

    #[test]
    fn maps_hold_the_errors() {
        let reference = Image::from_pixels(3, 1, vec![[0.5; 3], [0.0; 3], [1.0; 3]]).unwrap();
        let image = Image::from_pixels(3, 1, vec![[0.5, 0.5, 0.8], [0.01; 3], [f32::NAN, 1.0, 1.0]]).unwrap();
        let difference = error_map(&image, &reference, Quantity::Difference, 67.0).unwrap();
        assert!((difference[0] - 0.3 / 3f64.sqrt()).abs() < 1e-7);
        assert!((difference[1] - 0.01).abs() < 1e-9);
        assert!(difference[2].is_nan());
        let relative = error_map(&image, &reference, Quantity::Relative, 67.0).unwrap();
        assert!((relative[0] - 0.3 / 0.51 / 3f64.sqrt()).abs() < 1e-7);
        assert!((relative[1] - 1.0).abs() < 1e-7);
        assert!(error_map(&image, &reference, Quantity::Flip, 67.0).unwrap()[2].is_nan());

        let map = heat_map(3, 1, &[0.0, 2.0, f64::NAN], 2.0).unwrap();
        let codes = map.pixels().iter().map(|p| p.map(|v| Transfer::Srgb.code(v))).collect::<Vec<_>>();
        assert_eq!(codes, [[0, 0, 4], [252, 253, 191], [0, 255, 0]]);
    }
}
