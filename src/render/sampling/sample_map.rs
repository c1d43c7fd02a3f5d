//! The sample map (shaders/lib/sample_map.glsl): where an image is noisy, pixels get more samples than elsewhere.

use bytemuck::zeroed_vec;
use rayon::prelude::*;

use crate::render::film::tiling::{BLOCK, GROUP, tile_of_pixel, tiles_of_pixels};
use crate::render::kernel::layout::multiplier;
use crate::render::sampling::multiplier::Multiplier;

/// Where a pixel's groups are (shaders/lib/pixel_order.glsl).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grid {
    /// Of the image.
    pub width: u32,
    pub height: u32,
    /// Rows in a band of the film, within which groups are shifted.
    pub band_rows: u32,
}

impl Grid {
    /// Where a pixel would be if groups as they are, and if shifted ones, began in the upper left corner.
    fn places(&self, [x, y]: [u32; 2]) -> [[u32; 2]; 2] {
        let columns = self.width.next_multiple_of(BLOCK[0]);
        let band_top = y / self.band_rows * self.band_rows;
        let rows = self.band_rows.min(self.height.next_multiple_of(BLOCK[1]) - band_top);
        // Before the first ones of a row, or of a band's rows, come the last ones.
        let column = x.checked_sub(2).unwrap_or(x + columns - 2);
        let row = (y - band_top).checked_sub(1).unwrap_or(rows - 1);
        [[x, y], [column, band_top + row]]
    }

    /// The tiles of a pixel in either case.
    fn tiles(&self, at: [u32; 2]) -> [u32; 2] {
        self.places(at).map(|[x, y]| tile_of_pixel(x, y, self.width))
    }

    /// The greatest multiplier in the groups of each pixel.
    fn greatest_of_groups(&self, of_pixels: &[Multiplier]) -> Vec<[Multiplier; 2]> {
        let columns = self.width.next_multiple_of(BLOCK[0]) / GROUP[0];
        let group = |[x, y]: [u32; 2]| (y / GROUP[1] * columns + x / GROUP[0]) as usize;
        let groups = columns as usize * (self.height.next_multiple_of(BLOCK[1]) / GROUP[1]) as usize;
        let mut greatest = [vec![Multiplier::ONE; groups], vec![Multiplier::ONE; groups]];
        let at = |pixel: usize| [pixel as u32 % self.width, pixel as u32 / self.width];
        for (pixel, &multiplier) in of_pixels.iter().enumerate().filter(|(_, m)| **m > Multiplier::ONE) {
            for (greatest, place) in greatest.iter_mut().zip(self.places(at(pixel))) {
                let of_group = &mut greatest[group(place)];
                *of_group = multiplier.max(*of_group);
            }
        }
        let [plain, shifted] = &greatest;
        let of_pixel = |pixel: usize| {
            let [a, b] = self.places(at(pixel));
            [plain[group(a)], shifted[group(b)]]
        };
        (0..of_pixels.len()).into_par_iter().map(of_pixel).collect()
    }
}

/// The multipliers of all pixels, row by row: in groups as they are, and in shifted ones. Without any, all pixels are alike.
#[derive(Debug, Clone, Default)]
pub(crate) struct SampleMap {
    of_pixels: Vec<[Multiplier; 2]>,
    /// How many pixels have each of them.
    pixels: [[u64; Multiplier::ALL.len()]; 2],
}

impl SampleMap {
    /// With these multipliers of tiles.
    pub fn from_tiles(of_tiles: &[Multiplier], grid: Grid) -> Self {
        Self::of_pixels(grid, |at| grid.tiles(at).map(|tile| of_tiles[tile as usize]))
    }

    /// With at least such a multiplier for each pixel; if paths are shared, for its groups.
    pub fn with_at_least(self, wanted: &[Multiplier], shared: bool, grid: Grid) -> Self {
        if wanted.par_iter().all(|multiplier| *multiplier == Multiplier::ONE) {
            return self;
        }
        let groups = if shared { grid.greatest_of_groups(wanted) } else { Vec::new() };
        Self::of_pixels(grid, |[x, y]| {
            let pixel = y as usize * grid.width as usize + x as usize;
            let least = groups.get(pixel).copied().unwrap_or([wanted[pixel]; 2]);
            let of_tiles = self.of_pixel(pixel);
            // Who wants no more may have less.
            [0, 1].map(
                |kind| if least[kind] > Multiplier::ONE { least[kind].max(of_tiles[kind]) } else { of_tiles[kind] },
            )
        })
    }

    /// With the multipliers that `of` gives for the pixel in each column and row.
    fn of_pixels(grid: Grid, of: impl Fn([u32; 2]) -> [Multiplier; 2] + Sync) -> Self {
        let mut of_pixels: Vec<[Multiplier; 2]> = zeroed_vec(grid.width as usize * grid.height as usize);
        type Counts = [[u64; Multiplier::ALL.len()]; 2];
        let of_row = |(y, row): (usize, &mut [[Multiplier; 2]])| {
            let mut counts = Counts::default();
            for (x, pixel) in row.iter_mut().enumerate() {
                *pixel = of([x as u32, y as u32]);
                counts.iter_mut().zip(pixel).for_each(|(counts, multiplier)| counts[multiplier.index()] += 1);
            }
            counts
        };
        let add = |a: Counts, b: Counts| [0, 1].map(|kind| std::array::from_fn(|i| a[kind][i] + b[kind][i]));
        let rows = of_pixels.par_chunks_mut(grid.width as usize).enumerate();
        let pixels = rows.map(of_row).reduce(Default::default, add);
        Self { of_pixels, pixels }
    }

    /// Whether all pixels are alike.
    pub fn is_even(&self) -> bool {
        self.of_pixels.is_empty()
    }

    /// A pixel's multipliers.
    pub fn of_pixel(&self, pixel: usize) -> [Multiplier; 2] {
        self.of_pixels.get(pixel).copied().unwrap_or_default()
    }

    /// The same for its slot in the film.
    pub fn bits(&self, pixel: usize) -> u32 {
        let [plain, shifted] = self.of_pixel(pixel);
        plain.bits() << multiplier::PLAIN | shifted.bits() << multiplier::SHIFTED
    }

    /// The tiles of an image of such a width with pixels that do not get as many samples as are asked for, in increasing order.
    pub fn tiles(&self, width: u32) -> Vec<usize> {
        let uneven =
            |(pixel, of_pixel): (usize, &[Multiplier; 2])| (*of_pixel != [Multiplier::ONE; 2]).then_some(pixel);
        tiles_of_pixels(&self.of_pixels.par_iter().enumerate().filter_map(uneven).collect::<Vec<_>>(), width)
    }

    /// The greatest multiplier.
    pub fn most(&self) -> Multiplier {
        let is_there = |m: &&Multiplier| self.pixels.iter().any(|counts| counts[m.index()] > 0);
        Multiplier::ALL.iter().rev().find(is_there).copied().unwrap_or_default()
    }

    /// Pixels that get more samples than are asked for, in groups as they are.
    pub fn multiplied_pixels(&self) -> u64 {
        self.pixels[0][Multiplier::ONE.index() + 1..].iter().sum()
    }

    /// How many times as many samples as are asked for a pixel gets at most, not less than 1.
    pub fn most_factor(&self) -> u32 {
        self.most().of(1)
    }

    /// Samples of all `pixels` of the image, if each is to have `samples` in the mean; of either kind of groups.
    pub fn samples(&self, kind: usize, samples: u32, pixels: u64) -> u64 {
        if self.is_even() {
            return pixels * u64::from(samples);
        }
        Multiplier::ALL.iter().map(|m| self.pixels[kind][m.index()] * u64::from(m.of(samples))).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::film::tiling::place_of_tile;

    const GRID: Grid = Grid { width: 64, height: 64, band_rows: 64 };

    /// Multipliers of tiles of an image of 64 × 64 pixels: of those in its left half, and of the others.
    fn tiles([left, right]: [Multiplier; 2]) -> Vec<Multiplier> {
        (0..64).map(|tile| if place_of_tile(tile, GRID.width)[0] < 4 { left } else { right }).collect()
    }

    #[test]
    fn pixels_have_the_multipliers_of_their_tiles() {
        let map = SampleMap::from_tiles(&tiles([Multiplier::ONE, Multiplier(-1)]), GRID);
        let [far, near] = [0, 63].map(|x| map.of_pixel(32 * 64 + x));
        assert!(far[0].factor() > near[0].factor() && !map.is_even());
        // Shifted, the first columns are in the last tile.
        assert_eq!((far[1], map.of_pixel(32 * 64 + 2)[1]), (near[1], far[0]));
        assert_eq!(map.bits(0) & !0xff, 0);
        for kind in 0..2 {
            let samples: u64 = (0..4096).map(|p| u64::from(map.of_pixel(p)[kind].of(10))).sum();
            assert_eq!(map.samples(kind, 10, 4096), samples);
            assert!(samples <= 40960);
        }
        assert_eq!(SampleMap::default().samples(1, 10, 4096), 40960);
    }

    #[test]
    fn groups_have_the_greatest_of_their_pixels() {
        let mut wanted = vec![Multiplier::ONE; 4096];
        wanted[5 * 64 + 9] = Multiplier::FOUR;
        let with = |shared| SampleMap::default().with_at_least(&wanted, shared, GRID);
        assert!(SampleMap::default().with_at_least(&[Multiplier::ONE; 4096], true, GRID).is_even());
        assert_eq!((with(false).multiplied_pixels(), with(false).most()), (1, Multiplier::FOUR));
        let map = with(true);
        let of = |x: usize, y: usize| map.of_pixel(y * 64 + x);
        let (one, four) = (Multiplier::ONE, Multiplier::FOUR);
        // A group of columns 8 to 11 and rows 4 and 5; shifted, one of columns 6 to 9 and rows 5 and 6.
        assert_eq!((of(9, 5), of(11, 4), of(6, 6), of(9, 7)), ([four; 2], [four, one], [one, four], [one; 2]));
        assert_eq!((map.multiplied_pixels(), map.tiles(64)), (8, vec![0, 1]));
        assert_eq!([0, 1].map(|kind| map.samples(kind, 10, 4096)), [40960 + 8 * 30; 2]);
        // Shifted, the first pixel is in a group with the last ones of its row and its column.
        wanted.fill(one);
        wanted[0] = four;
        let map = SampleMap::default().with_at_least(&wanted, true, GRID);
        assert_eq!(map.of_pixel(63 * 64 + 63), [one, four]);
        // What is halved elsewhere is not where there is a wish.
        let halved = SampleMap::from_tiles(&tiles([Multiplier(-1), Multiplier::ONE]), GRID);
        assert!(halved.of_pixel(0)[0] < one);
        let both = halved.with_at_least(&wanted, true, GRID);
        assert_eq!((both.of_pixel(0), both.of_pixel(8)[0] < one), ([four; 2], true));
    }
}
