//! Where samples look several times at lamps (shaders/lib/glance.glsl): where an image of a few glances has edges.

use rayon::prelude::*;

use super::super::error::RenderError;
use super::super::film::{SIDE, TILE, pixel_of_slot, pixels_in, slot_count, tile_of_pixel, tiles_around};
use super::super::layout::{FilmSlot, glance};
use super::super::plan::{Span, Work};
use super::super::view::Rectangle;
use super::Renderer;
use super::verdict::ReuseTrial;

/// Glances of a pixel from which edges are found.
const FIRST_GLANCES: u32 = 4;
/// How a sample with glances begins.
pub(super) const SAMPLE: u32 = glance::GLANCING | glance::PATH_FOLLOWS | (glance::GLANCES - 1);
/// What the seed is changed by (XOR) for these, so that what is found does not depend on the image's random numbers.
const SEED: u32 = 0x9216_d5d9;

/// A lamp's edge needs them if it is brighter than the rest of the image by this. Apart from each other, lamp and rest vary
/// more than the sum of both where they are alike: with n glances, if the lamp is less than 2n/(n − 1) times as bright, 2.13
/// with 16.
const CONTRAST: f64 = 2.2;
/// The rest is estimated from one sample of each pixel of every so many tiles, or of fewer if these are more than enough.
const REST_STEP: usize = 15;
const REST_TILES: usize = 128;

/// Tiles from one where lamps may be seen to the next that are looked at with them rather than left out: a dispatch each takes
/// longer.
const SHORT_GAP: usize = 8;

/// The tiles of an image that these pixels are in, in increasing order, and those in short gaps between them.
fn tiles_of(pixels: &[Rectangle], [width, height]: [u32; 2]) -> Vec<usize> {
    let [columns, rows] = [width, height].map(|size| size.div_ceil(SIDE) as usize);
    // By how many rectangles cover a tile more than what is on its left and above: a sum over those tells how many do.
    let mut more = vec![0i32; (columns + 1) * (rows + 1)];
    for [x, y] in pixels.iter().filter(|[x, y]| !x.is_empty() && !y.is_empty()) {
        let [left, top] = [x.start, y.start].map(|first| (first / SIDE) as usize);
        let [right, bottom] = [x.end, y.end].map(|end| end.div_ceil(SIDE) as usize);
        for (column, row, count) in [(left, top, 1), (right, top, -1), (left, bottom, -1), (right, bottom, 1)] {
            more[row * (columns + 1) + column] += count;
        }
    }
    let mut above = vec![0; columns];
    let mut tiles = Vec::new();
    for row in 0..rows {
        let mut sum = 0;
        for column in 0..columns {
            sum += more[row * (columns + 1) + column];
            above[column] += sum;
            if above[column] > 0 {
                tiles.push(tile_of_pixel(column as u32 * SIDE, row as u32 * SIDE, width) as usize);
            }
        }
    }
    tiles.sort_unstable();
    let up_to_next = |pair: &[usize]| pair[0]..if pair[1] - pair[0] <= SHORT_GAP { pair[1] } else { pair[0] + 1 };
    tiles.windows(2).flat_map(up_to_next).chain(tiles.last().copied()).collect()
}

/// Of so many tiles of an image every how many-th tells of the rest: an odd number, so that they are in all columns of a block.
fn rest_step(tiles: usize) -> usize {
    (tiles / REST_TILES).max(REST_STEP) | 1
}

/// Whether to look at so many tiles of an image before so many samples of each pixel. That takes about as long as half a sample of
/// these tiles: not before a single sample if they are more than half of the image.
fn pays(tiles: usize, size: [u32; 2], samples: u32) -> bool {
    let all: usize = size.iter().map(|size| size.div_ceil(SIDE) as usize).product();
    samples > 1 || 2 * tiles <= all
}

impl Renderer {
    /// The pixels, in increasing order, whose samples need glances; `None` if that was not looked for. Takes an empty film, and leaves
    /// it with samples if it was.
    pub(super) fn look_for_lamps(&mut self) -> Result<Option<Vec<usize>>, RenderError> {
        let tiles = tiles_of(&self.launch.lamp_places, [self.width, self.height]);
        if tiles.is_empty() || !pays(tiles.len(), [self.width, self.height], self.settings.samples) {
            return Ok(None);
        }
        let found = self.beforehand(|renderer| {
            renderer.push.seed ^= SEED;
            renderer.reuse = ReuseTrial::Never;
            renderer.edges_of_lamps(&tiles)
        })?;
        Ok(Some(found))
    }

    /// Pixels near the edges of bright lamps, which these tiles may show.
    fn edges_of_lamps(&mut self, tiles: &[usize]) -> Result<Vec<usize>, RenderError> {
        let (width, height) = (self.width, self.height);
        let spans = self.spans_of(tiles.iter().copied());
        self.fill_film(&spans, |_| FilmSlot::beginning(glance::GLANCING | (FIRST_GLANCES - 1)))?;
        self.sample_once(&spans)?;
        let mut seen = vec![0.0; width as usize * height as usize];
        let of_all = f64::from(glance::GLANCES / FIRST_GLANCES);
        self.read_pixels(&spans, &mut seen, |seen, slot| *seen = brightness(slot) * of_all)?;
        let pixels = pixels_around(tiles, width, height);
        if pixels.par_iter().all(|p| seen[*p] == seen[pixels[0]]) {
            return Ok(Vec::new());
        }
        let rest = self.mean_of_rest(&seen)?;
        Ok(near_edges(&seen, width as usize, &pixels, CONTRAST * rest))
    }

    /// The mean brightness of the image where no lamps are `seen`, of which this is the brightness of each pixel.
    fn mean_of_rest(&mut self, seen: &[f64]) -> Result<f64, RenderError> {
        self.clear_film()?;
        let (width, height) = (self.width, self.height);
        let tiles = slot_count(width, height) as usize / TILE;
        let step = rest_step(tiles);
        for span in self.whole_film() {
            // The same tiles in however many bands.
            let first_slot = (span.first_slot as usize / TILE).next_multiple_of(step) * TILE;
            let span = Span { first_slot: first_slot as u32, ..span };
            if span.first_slot < span.end_slot {
                let of_tile = |slot: u32| pixels_in(slot, span.end_slot.min(slot + TILE as u32), width, height);
                let pixels: u64 = (span.first_slot..span.end_slot).step_by(step * TILE).map(of_tile).sum();
                let work = Work { spans: vec![span], tile_step: step as u32, target_samples: 1, new_samples: 1 };
                self.work_until(work, self.statistics.samples + pixels)?;
            }
        }
        let spans = self.spans_of((0..tiles).step_by(step));
        let (mut sum, mut count) = (0.0, 0);
        self.read_slots(&spans, |first, slots| {
            for (slot, number) in slots.iter().zip(first..) {
                let unlit = pixel_of_slot(number, width, height).is_some_and(|pixel| seen[pixel] == 0.0);
                if unlit {
                    sum += brightness(slot);
                    count += 1;
                }
            }
        })?;
        Ok(if count > 0 { sum / f64::from(count) } else { 0.0 })
    }
}

/// Of the sum of a slot's samples.
fn brightness(slot: &FilmSlot) -> f64 {
    (0..3).map(|channel| slot.total(channel)).sum()
}

/// The pixels of some tiles, which come in increasing order, and of those around.
fn pixels_around(tiles: &[usize], width: u32, height: u32) -> Vec<usize> {
    let mut around: Vec<_> = tiles.par_iter().flat_map_iter(|tile| tiles_around(*tile as u32, width, height)).collect();
    around.par_sort_unstable();
    around.dedup();
    let of_tile =
        |tile: usize| (tile * TILE..(tile + 1) * TILE).filter_map(|slot| pixel_of_slot(slot as u32, width, height));
    around.into_par_iter().flat_map_iter(of_tile).collect()
}

/// Those `among` the pixels that differ from one of their neighbours by more than that, those across a corner included; in increasing
/// order.
fn near_edges(seen: &[f64], width: usize, among: &[usize], by: f64) -> Vec<usize> {
    let height = seen.len() / width;
    let around = |i: usize, end: usize| i.saturating_sub(1)..(i + 2).min(end);
    let differs = |p: &usize| {
        let (x, y) = (p % width, p / width);
        let neighbours = around(y, height).flat_map(|y| around(x, width).map(move |x| y * width + x));
        neighbours.map(|q| seen[q] - seen[*p]).any(|difference| difference.abs() > by)
    };
    let mut found: Vec<_> = among.par_iter().copied().filter(differs).collect();
    found.par_sort_unstable();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_beside_an_edge_are_found() {
        let pixels = pixels_around(&[0], 7, 5);
        let found = |seen: &[f64], by| near_edges(seen, 7, &pixels, by);
        let mut seen = vec![1.5; 35];
        assert!(found(&seen, 0.0).is_empty());
        seen[2 * 7 + 3] = 3.5;
        assert_eq!(found(&seen, 1.9), [9, 10, 11, 16, 17, 18, 23, 24, 25]);
        assert!(found(&seen, 2.1).is_empty());
        // In a corner.
        seen[17] = 1.5;
        seen[34] = 0.0;
        assert_eq!(found(&seen, 1.0), [26, 27, 33, 34]);
        assert!(near_edges(&[9.0], 1, &[0], 0.0).is_empty());
    }

    #[test]
    fn pixels_beside_tiles_are_looked_at_too() {
        // Two columns and rows of tiles and a part of a third.
        let around = |tiles: &[usize]| pixels_around(tiles, 20, 17);
        assert_eq!(around(&[0]).len(), 16 * 16);
        assert_eq!(around(&[5]).len(), 20 * 17);
        assert!(around(&[]).is_empty());
    }

    #[test]
    fn few_tiles_tell_of_the_rest() {
        assert_eq!([1, 1024, 16_384, 1 << 20].map(rest_step), [15, 15, 129, 8193]);
    }

    #[test]
    fn one_sample_looks_for_few_lamps() {
        let pays = |size| [1, 2, u32::MAX].map(|samples| pays(32, size, samples));
        assert_eq!(pays([64, 32]), [false, true, true]);
        assert_eq!(pays([64, 56]), [false, true, true]);
        assert_eq!(pays([64, 57]), [true; 3]);
    }

    #[test]
    fn tiles_of_lamps_are_those_of_their_pixels() {
        // Four columns of tiles in a block of eight rows, which is 32 columns and 64 rows of pixels.
        let of = |pixels: &[Rectangle]| tiles_of(pixels, [60, 70]);
        assert!(of(&[]).is_empty() && of(&[[3..3, 0..9]]).is_empty());
        assert_eq!(of(&[[0..1, 0..1]]), [0]);
        assert_eq!(of(&[[7..9, 8..10]]), [4, 5]);
        // Twice the same, and one that ends where the image does: gaps of a row are filled, others are not.
        assert_eq!(of(&[[0..8, 0..16], [0..8, 0..16], [56..60, 69..70]]), [0, 1, 2, 3, 4, 99]);
        let all = of(&[[0..60, 0..70]]);
        assert!(all.len() >= 8 * 9 && all.is_sorted_by(|a, b| a < b));
    }
}
