//! The image itself: pixels of linear radiance and, where known, how uncertain they are.

use crate::image::ImageError;

/// Largest width and height, pixels.
pub const MAX_SIDE: u32 = 65_536;

/// How far the noise of rendering may have carried each pixel from its expectation.
#[derive(Debug, Clone, PartialEq)]
pub struct Variance {
    /// Estimated variance of each pixel's mean per channel, (radiance)²; row 0 at the top.
    pub of_mean: Vec<[f32; 3]>,
    /// Number of independent batches (or samples) behind each estimate, at least 2.
    pub batches: u32,
}

/// A rectangle of linear RGB radiance; row 0 is at the top.
///
/// Values are neither clamped nor checked: they may be negative, infinite or NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 3]>,
    variance: Option<Variance>,
    counts: Option<Vec<u32>>,
    alpha: Option<Vec<f32>>,
}

impl Image {
    /// A black image.
    ///
    /// # Errors
    /// [`ImageError::Size`] unless both sides are in 1..=[`MAX_SIDE`].
    pub fn new(width: u32, height: u32) -> Result<Self, ImageError> {
        check_size(width, height)?;
        let pixels = vec![[0.0; 3]; width as usize * height as usize];
        Self::from_pixels(width, height, pixels)
    }

    /// An image of the given pixels, row by row from the top left.
    ///
    /// # Errors
    /// [`ImageError::Size`] as for [`Image::new`]; [`ImageError::Count`] unless there are `width·height` pixels.
    pub fn from_pixels(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Result<Self, ImageError> {
        check_size(width, height)?;
        check_count("pixels", width, height, pixels.len())?;
        Ok(Self { width, height, pixels, variance: None, counts: None, alpha: None })
    }

    /// An image with `f(x, y)` in each pixel; (0, 0) is the top left.
    ///
    /// # Errors
    /// [`ImageError::Size`] as for [`Image::new`].
    pub fn from_fn(width: u32, height: u32, mut f: impl FnMut(u32, u32) -> [f32; 3]) -> Result<Self, ImageError> {
        check_size(width, height)?;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| f(x, y)).collect();
        Self::from_pixels(width, height, pixels)
    }

    /// The same image with an estimate of its noise.
    ///
    /// # Errors
    /// [`ImageError::Count`] unless there is one value for each pixel; [`ImageError::Batches`] below two batches.
    pub fn with_variance(mut self, variance: Variance) -> Result<Self, ImageError> {
        check_count("variances", self.width, self.height, variance.of_mean.len())?;
        if variance.batches < 2 {
            return Err(ImageError::Batches { found: variance.batches });
        }
        self.variance = Some(variance);
        Ok(self)
    }

    /// The same image with the number of samples behind each pixel.
    ///
    /// # Errors
    /// [`ImageError::Count`] unless there is one value for each pixel.
    pub fn with_counts(mut self, counts: Vec<u32>) -> Result<Self, ImageError> {
        check_count("counts", self.width, self.height, counts.len())?;
        self.counts = Some(counts);
        Ok(self)
    }

    /// The same image, whose pixels are what is seen of what covers this part of them, and nothing of the rest.
    ///
    /// # Errors
    /// [`ImageError::Count`] unless there is one value for each pixel.
    pub fn with_alpha(mut self, alpha: Vec<f32>) -> Result<Self, ImageError> {
        check_count("alpha values", self.width, self.height, alpha.len())?;
        self.alpha = Some(alpha);
        Ok(self)
    }

    /// Pixels in a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Linear radiance, row by row from the top left.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// Linear radiance, to be changed in place.
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.pixels
    }

    /// One pixel; (0, 0) is the top left. `None` outside the image.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[f32; 3]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        self.pixels.get(y as usize * self.width as usize + x as usize).copied()
    }

    /// The estimate of the noise, where there is one.
    pub fn variance(&self) -> Option<&Variance> {
        self.variance.as_ref()
    }

    /// The part of each pixel that is covered, where the background is left out; row 0 at the top.
    pub fn alpha(&self) -> Option<&[f32]> {
        self.alpha.as_deref()
    }

    /// Samples behind each pixel, where known; row 0 at the top.
    pub fn counts(&self) -> Option<&[u32]> {
        self.counts.as_deref()
    }
}

pub(super) fn check_size(width: u32, height: u32) -> Result<(), ImageError> {
    if (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height) {
        Ok(())
    } else {
        Err(ImageError::Size { width, height })
    }
}

pub(super) fn check_count(what: &'static str, width: u32, height: u32, found: usize) -> Result<(), ImageError> {
    let expected = width as usize * height as usize;
    if found == expected { Ok(()) } else { Err(ImageError::Count { what, width, height, expected, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image_counts(count: usize) -> Result<Image, ImageError> {
        Image::new(2, 2).unwrap().with_counts(vec![7; count])
    }

    #[test]
    fn sizes_and_counts_are_checked() {
        assert!(matches!(Image::new(0, 1), Err(ImageError::Size { .. })));
        assert!(matches!(Image::new(1, MAX_SIDE + 1), Err(ImageError::Size { .. })));
        assert!(matches!(
            Image::from_pixels(2, 2, vec![[0.0; 3]; 3]),
            Err(ImageError::Count { expected: 4, found: 3, .. })
        ));
        let image = Image::new(2, 2).unwrap();
        assert!(matches!(image_counts(3), Err(ImageError::Count { what: "counts", expected: 4, found: 3, .. })));
        assert_eq!(image_counts(4).unwrap().counts(), Some(&[7; 4][..]));
        let short = Variance { of_mean: vec![[0.0; 3]; 3], batches: 2 };
        assert!(matches!(image.clone().with_variance(short), Err(ImageError::Count { .. })));
        let lone = Variance { of_mean: vec![[0.0; 3]; 4], batches: 1 };
        assert!(matches!(image.with_variance(lone), Err(ImageError::Batches { found: 1 })));
    }

    #[test]
    fn row_zero_is_the_top() {
        let image = Image::from_fn(3, 2, |x, y| [x as f32, y as f32, 0.0]).unwrap();
        assert_eq!(image.pixels()[0], [0.0, 0.0, 0.0]);
        assert_eq!(image.pixels()[3], [0.0, 1.0, 0.0]);
        assert_eq!(image.pixel(2, 1), Some([2.0, 1.0, 0.0]));
        assert_eq!(image.pixel(3, 0), None);
    }
}
