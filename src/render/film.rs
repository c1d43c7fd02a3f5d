//! The film on the host: exact sums of samples, per pixel.

use super::layout::FilmSlot;

/// Sums of samples, row 0 at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    sums: Vec<[f64; 3]>,
    counts: Vec<u32>,
}

impl Film {
    /// A film without samples.
    pub fn new(width: u32, height: u32) -> Self {
        let pixels = width as usize * height as usize;
        Self { width, height, sums: vec![[0.0; 3]; pixels], counts: vec![0; pixels] }
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

    /// Takes over a pixel: the sum of its samples, and how many they are.
    pub(crate) fn put(&mut self, pixel: usize, sum: [f64; 3], count: u32) {
        self.sums[pixel] = sum;
        self.counts[pixel] = count;
    }

    /// Takes over slots of the device's film, the first of which is slot `first`.
    pub(crate) fn read_slots(&mut self, first: u32, slots: &[FilmSlot]) {
        for (i, slot) in slots.iter().enumerate() {
            if let Some(pixel) = pixel_of_slot(first + i as u32, self.width, self.height) {
                self.put(pixel, std::array::from_fn(|c| slot.total(c)), slot.count);
            }
        }
    }
}

/// Slots of an image: its pixels in tiles of 8×8, padded; see shaders/lib/pixel_order.glsl.
pub(crate) fn slot_count(width: u32, height: u32) -> u64 {
    64 * u64::from(width.div_ceil(8)) * u64::from(height.div_ceil(8))
}

/// Pixels of whole tiles from slot `first` to slot `end`, which is not one of them.
pub(crate) fn pixels_in(first: u32, end: u32, width: u32, height: u32) -> u64 {
    let tiles_x = width.div_ceil(8);
    let pixels = |tile: u32| {
        let side = |size: u32, i: u32| u64::from((size - 8 * i).min(8));
        side(width, tile % tiles_x) * side(height, tile / tiles_x)
    };
    (first / 64..end / 64).map(pixels).sum()
}

/// The pixel of a slot, row by row from the top left; `None` for padding.
pub(crate) fn pixel_of_slot(slot: u32, width: u32, height: u32) -> Option<usize> {
    let tiles_x = width.div_ceil(8);
    let (tile, within) = (slot / 64, slot % 64);
    let x = tile % tiles_x * 8 + within % 8;
    let y = tile / tiles_x * 8 + within / 8;
    (x < width && y < height).then(|| y as usize * width as usize + x as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_cover_every_pixel_once() {
        for (w, h) in [(1, 1), (8, 8), (13, 21), (64, 3)] {
            let mut seen = vec![0; (w * h) as usize];
            for slot in 0..slot_count(w, h) as u32 {
                if let Some(p) = pixel_of_slot(slot, w, h) {
                    seen[p] += 1;
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{w}×{h}");
            let slots = slot_count(w, h) as u32;
            assert_eq!(pixels_in(0, slots, w, h), u64::from(w * h));
            let inside = |slot: &u32| pixel_of_slot(*slot, w, h).is_some();
            let last = (slots - 64..slots).filter(inside).count() as u64;
            assert_eq!(pixels_in(slots - 64, slots, w, h), last, "{w}×{h}");
        }
    }
}
