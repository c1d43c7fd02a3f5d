//! How far an image is from a reference: pointwise errors, bias, FLIP and a statistical test.
//!
//! All sums are in double precision and over linear radiance. Pixels with a channel that is not finite
//! in either image are counted and left out of every average.

mod bias;
pub mod flip;
mod pointwise;
pub(crate) mod student;
mod tiles;
mod welch;
mod worst;

use serde::Serialize;

pub(crate) use crate::image::metrics::bias::LUMINANCE;
pub use crate::image::metrics::bias::{Bias, CONFIDENCE, Estimate};
pub use crate::image::metrics::pointwise::{Pointwise, RELATIVE_OFFSET};
pub use crate::image::metrics::tiles::TILE_SIDE;
pub use crate::image::metrics::welch::{Family, TestedValue, Untestable, Welch};
pub use crate::image::metrics::worst::WorstPixel;

use crate::image::{Image, ImageError};

/// How to compare.
#[derive(Debug, Clone, PartialEq)]
pub struct CompareOptions {
    /// The radiance that counts as the peak signal in PSNR.
    pub psnr_peak: f64,
    /// Pixels per degree of visual angle, for FLIP.
    pub flip_ppd: f64,
    /// How many of the worst pixels to list.
    pub worst: usize,
    /// Probability that Welch's test, over a whole family, rejects images of equal expectation.
    pub alpha: f64,
}

impl Default for CompareOptions {
    fn default() -> Self {
        Self { psnr_peak: 1.0, flip_ppd: flip::DEFAULT_PPD, worst: 0, alpha: 1e-4 }
    }
}

/// Pixels that are NaN or infinite in either image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct NonFinite {
    /// How many.
    pub count: usize,
    /// Column and row of the first one.
    pub first: Option<[u32; 2]>,
}

/// The share of the mean squared error that the noise of each image explains: its mean variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseMse {
    /// Of the image, where it carries an estimate.
    pub image: Option<f64>,
    /// Of the reference, where it carries an estimate; errors below it mean nothing.
    pub reference: Option<f64>,
}

/// An image measured against a reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Pixels left out.
    pub non_finite: NonFinite,
    /// MSE and its kin.
    pub pointwise: Pointwise,
    /// Mean differences.
    pub bias: Bias,
    /// Mean LDR-FLIP, 0 (equal) to 1.
    pub flip: f64,
    /// What noise alone would do.
    pub noise_mse: NoiseMse,
    /// The worst pixels, worst first.
    pub worst: Vec<WorstPixel>,
    /// Welch's test, or why it could not be done.
    pub welch: Result<Welch, Untestable>,
}

/// Measures `image` against `reference`.
///
/// # Errors
/// [`ImageError::SizeMismatch`]; [`ImageError::NothingFinite`] when no pixel is left to compare.
pub fn compare(image: &Image, reference: &Image, options: &CompareOptions) -> Result<Comparison, ImageError> {
    let pair = Pair::new(image, reference)?;
    Ok(Comparison {
        non_finite: pair.non_finite()?,
        pointwise: Pointwise::measure(&pair, options.psnr_peak),
        bias: Bias::measure(&pair),
        flip: mean(&flip::flip(image, reference, options.flip_ppd)?),
        noise_mse: NoiseMse { image: mean_variance(image), reference: mean_variance(reference) },
        worst: worst::worst_pixels(&pair, options.worst),
        welch: Welch::test(&pair, options.alpha),
    })
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// An error unless the images have one size.
pub(super) fn check_sizes(image: &Image, reference: &Image) -> Result<(), ImageError> {
    Pair::new(image, reference).map(drop)
}

/// Root mean square of the difference over the channels.
pub(super) fn pixel_error(x: [f64; 3], r: [f64; 3]) -> f64 {
    (x.iter().zip(r).map(|(x, r)| (x - r) * (x - r)).sum::<f64>() / 3.0).sqrt()
}

fn mean_variance(image: &Image) -> Option<f64> {
    let values = image.variance()?.of_mean.as_flattened();
    Some(values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64).filter(|mean| mean.is_finite())
}

/// Two images of one size.
struct Pair<'a> {
    image: &'a Image,
    reference: &'a Image,
}

impl<'a> Pair<'a> {
    fn new(image: &'a Image, reference: &'a Image) -> Result<Self, ImageError> {
        let sizes = [image, reference].map(|i| (i.width(), i.height()));
        if sizes[0] != sizes[1] {
            return Err(ImageError::SizeMismatch { image: sizes[0], reference: sizes[1] });
        }
        Ok(Self { image, reference })
    }

    /// The pixel of both images, unless one of them is not finite.
    fn finite(&self, index: usize) -> Option<([f64; 3], [f64; 3])> {
        let pixel = |image: &Image| image.pixels()[index].map(f64::from);
        let (x, r) = (pixel(self.image), pixel(self.reference));
        x.iter().chain(&r).all(|c| c.is_finite()).then_some((x, r))
    }

    /// All finite pixels with their index.
    fn finite_pixels(&self) -> impl Iterator<Item = (usize, [f64; 3], [f64; 3])> {
        (0..self.image.pixels().len()).filter_map(|i| self.finite(i).map(|(x, r)| (i, x, r)))
    }

    /// Column and row of a pixel's index.
    fn position(&self, index: usize) -> [u32; 2] {
        let width = self.image.width() as usize;
        [(index % width) as u32, (index / width) as u32]
    }

    fn non_finite(&self) -> Result<NonFinite, ImageError> {
        let mut indices = (0..self.image.pixels().len()).filter(|&i| self.finite(i).is_none());
        let first = indices.next();
        let count = usize::from(first.is_some()) + indices.count();
        if count == self.image.pixels().len() {
            return Err(ImageError::NothingFinite);
        }
        Ok(NonFinite { count, first: first.map(|i| self.position(i)) })
    }
}

#[cfg(test)]
mod tests;
