//! The film on the host: exact sums of samples, per pixel.

pub(crate) mod checkpoint;
pub(crate) mod tiling;

use rayon::prelude::*;

use crate::render::film::tiling::to_pixels;
use crate::render::kernel::layout::FilmSlot;

/// Sums of samples, row 0 at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    sums: Vec<[f64; 3]>,
    counts: Vec<u32>,
    variance: Option<Vec<[f32; 3]>>,
}

impl Film {
    /// A film without samples.
    pub fn new(width: u32, height: u32) -> Self {
        let pixels = width as usize * height as usize;
        Self { width, height, sums: vec![[0.0; 3]; pixels], counts: vec![0; pixels], variance: None }
    }

    /// Pixels in a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Samples of each pixel.
    pub fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// Sum of the samples of each pixel, linear RGB radiance.
    pub fn sums(&self) -> &[[f64; 3]] {
        &self.sums
    }

    /// Mean radiance of each pixel; black where there is no sample.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        let mean = |(sum, &n): (&[f64; 3], &u32)| sum.map(|s| if n > 0 { (s / f64::from(n)) as f32 } else { 0.0 });
        self.sums.iter().zip(&self.counts).map(mean).collect()
    }

    /// Estimated variance of the mean of each pixel, (radiance)², if the film was rendered in two halves
    /// ([`Adaptive`](crate::render::Adaptive)): the square of half their difference, if both count the same.
    pub fn variance(&self) -> Option<&[[f32; 3]]> {
        self.variance.as_deref()
    }

    /// Takes over the variance of the mean of each pixel.
    pub(crate) fn set_variance(&mut self, variance: Vec<[f32; 3]>) {
        self.variance = Some(variance);
    }

    /// Takes over a pixel: the sum of its samples, and how many they are.
    pub(crate) fn put(&mut self, pixel: usize, sum: [f64; 3], count: u32) {
        self.sums[pixel] = sum;
        self.counts[pixel] = count;
    }

    /// Adds something to the mean of each pixel, which is told its number and its count of samples.
    pub(crate) fn add(&mut self, correction: impl Fn(usize, u32) -> [f32; 3] + Sync) {
        self.sums.par_iter_mut().zip(&self.counts).enumerate().for_each(|(pixel, (sum, &n))| {
            for (s, c) in sum.iter_mut().zip(correction(pixel, n)) {
                *s += f64::from(n) * f64::from(c);
            }
        });
    }

    /// Takes over slots of the device's film, the first of which is slot `first`.
    pub(crate) fn read_slots(&mut self, first: u32, slots: &[FilmSlot]) {
        let width = self.width;
        to_pixels(first, slots, &mut self.sums, width, |sum, slot| *sum = std::array::from_fn(|c| slot.total(c)));
        to_pixels(first, slots, &mut self.counts, width, |count, slot| *count = slot.count);
    }
}
