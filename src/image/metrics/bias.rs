//! The mean difference, with an interval.

use serde::Serialize;

use crate::image::metrics::Pair;
use crate::image::metrics::student::two_sided_quantile;
use crate::image::metrics::tiles::{TILE_SIDE, tiles};

/// Confidence level of the intervals.
pub const CONFIDENCE: f64 = 0.95;

/// Weights of linear R, G and B in luminance (ITU-R BT.709).
pub(crate) const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Fewer tiles than this, and smaller ones are taken.
const LEAST_TILES: usize = 16;

/// A mean difference, image minus reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Mean of the difference, radiance.
    pub mean: f64,
    /// Half the width of the interval of confidence [`CONFIDENCE`]; `None` for a single pixel.
    pub half_width: Option<f64>,
    /// The mean over that of the reference; `None` where the reference's mean is 0.
    pub relative: Option<f64>,
}

/// Mean differences over all finite pixels.
///
/// The intervals come from the spread of the means of tiles (Student's t), so that noise which is stratified
/// over neighbouring pixels is counted rightly. A bias that varies over the image widens them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bias {
    /// Red.
    pub r: Estimate,
    /// Green.
    pub g: Estimate,
    /// Blue.
    pub b: Estimate,
    /// Luminance (ITU-R BT.709).
    pub luminance: Estimate,
}

impl Bias {
    /// Measures; the pair has at least one finite pixel.
    pub(super) fn measure(pair: &Pair) -> Self {
        let (width, height) = (pair.image.width(), pair.image.height());
        // As wide as the blocks within which pixels have part of their noise in common, if paths are reused.
        let mut side = 4 * TILE_SIDE;
        while side > 1 && tiles(width, height, side).count() < LEAST_TILES {
            side /= 2;
        }
        let sums: Vec<TileSum> = tiles(width, height, side)
            .map(|tile| {
                let mut sum = TileSum::default();
                tile.indices().filter_map(|i| pair.finite(i)).for_each(|(x, r)| sum.add(x, r));
                sum
            })
            .filter(|sum| sum.pixels > 0.0)
            .collect();
        let [r, g, b, luminance] = [0, 1, 2, 3].map(|value| estimate(&sums, value));
        Self { r, g, b, luminance }
    }

    /// The largest absolute mean difference of any channel or the luminance.
    pub fn largest(&self) -> f64 {
        [self.r, self.g, self.b, self.luminance].iter().map(|e| e.mean.abs()).fold(0.0, f64::max)
    }
}

/// Sums over a tile of R, G, B and luminance.
#[derive(Default)]
struct TileSum {
    pixels: f64,
    difference: [f64; 4],
    reference: [f64; 4],
}

impl TileSum {
    fn add(&mut self, x: [f64; 3], r: [f64; 3]) {
        self.pixels += 1.0;
        for c in 0..3 {
            let difference = x[c] - r[c];
            self.difference[c] += difference;
            self.reference[c] += r[c];
            self.difference[3] += LUMINANCE[c] * difference;
            self.reference[3] += LUMINANCE[c] * r[c];
        }
    }
}

/// The ratio estimator of cluster sampling: tiles at the edge count by their pixels.
fn estimate(sums: &[TileSum], value: usize) -> Estimate {
    let pixels: f64 = sums.iter().map(|s| s.pixels).sum();
    let mean = sums.iter().map(|s| s.difference[value]).sum::<f64>() / pixels;
    let reference = sums.iter().map(|s| s.reference[value]).sum::<f64>() / pixels;
    let tiles = sums.len() as f64;
    let half_width = (sums.len() > 1).then(|| {
        let spread: f64 = sums.iter().map(|s| (s.difference[value] - s.pixels * mean).powi(2)).sum();
        let deviation = (tiles / (tiles - 1.0) * spread).sqrt() / pixels;
        two_sided_quantile(CONFIDENCE, tiles - 1.0) * deviation
    });
    Estimate { mean, half_width, relative: (reference != 0.0).then(|| mean / reference) }
}
