//! The pixels that differ most.

use serde::Serialize;

use crate::image::metrics::Pair;

/// A pixel that differs much.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WorstPixel {
    /// Column.
    pub x: u32,
    /// Row; 0 is the top.
    pub y: u32,
    /// Root mean square over the channels of the difference, radiance.
    pub error: f64,
    /// The image's radiance.
    pub image: [f32; 3],
    /// The reference's radiance.
    pub reference: [f32; 3],
}

/// The `count` finite pixels with the largest error, worst first; among equals the first in the image.
pub(super) fn worst_pixels(pair: &Pair, count: usize) -> Vec<WorstPixel> {
    let mut errors: Vec<(f64, usize)> = if count == 0 {
        Vec::new()
    } else {
        pair.finite_pixels().map(|(i, x, r)| (crate::image::metrics::pixel_error(x, r), i)).collect()
    };
    let worse = |a: &(f64, usize), b: &(f64, usize)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    if count < errors.len() {
        errors.select_nth_unstable_by(count, worse);
        errors.truncate(count);
    }
    errors.sort_unstable_by(worse);
    errors
        .into_iter()
        .map(|(error, i)| {
            let [x, y] = pair.position(i);
            WorstPixel { x, y, error, image: pair.image.pixels()[i], reference: pair.reference.pixels()[i] }
        })
        .collect()
}
