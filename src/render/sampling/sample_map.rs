//! The sample map (shaders/lib/sample_map.glsl): where an image is noisy, pixels get more samples than elsewhere.
//!
//! Of a variance v for one sample, n samples leave v/n. For as many samples in all the image has least noise if n ∝ √v (Neyman
//! allocation, J. R. Stat. Soc. 97, 1934). Powers of two come near to that, and keep random numbers stratified.

use bytemuck::{Zeroable, zeroed_vec};
use rayon::prelude::*;

use crate::render::film::{GROUP, tile_of_pixel, tiles_of_pixels, tiles_within};
use crate::render::kernel::layout::multiplier;

/// How many times as many samples as are asked for a pixel is to have: the logarithm to the base of 2, from -1 to 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Zeroable)]
pub(crate) struct Multiplier(i8);

impl Multiplier {
    /// As many.
    pub const ONE: Self = Self(0);
    pub const TWO: Self = Self(1);
    pub const FOUR: Self = Self(2);
    /// From the least to the greatest.
    pub const ALL: [Self; 7] = [Self(-1), Self(0), Self(1), Self(2), Self(3), Self(4), Self(5)];
    /// Those by which samples are allocated for a cost.
    const OF_TILES: [Self; 4] = [Self(-1), Self(0), Self(1), Self(2)];

    /// The nearest to such a logarithm.
    pub fn near(logarithm: f64) -> Self {
        Self(logarithm.round().clamp(-1.0, 5.0) as i8)
    }

    /// What it multiplies by.
    pub fn factor(self) -> f64 {
        f64::from(self.0).exp2()
    }

    /// So many times `samples`.
    pub fn of(self, samples: u32) -> u32 {
        if self.0 < 0 { samples.div_ceil(2) } else { samples.saturating_mul(1 << self.0) }
    }

    /// Its bits in the shaders.
    fn bits(self) -> u32 {
        u32::from(self.0.cast_unsigned()) & ((1 << multiplier::BITS) - 1)
    }

    /// Its place among all.
    fn index(self) -> usize {
        (self.0 + 1) as usize
    }
}

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
        let columns = self.width.next_multiple_of(32);
        let band_top = y / self.band_rows * self.band_rows;
        let rows = self.band_rows.min(self.height.next_multiple_of(64) - band_top);
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
        let columns = self.width.next_multiple_of(32) / GROUP[0];
        let group = |[x, y]: [u32; 2]| (y / GROUP[1] * columns + x / GROUP[0]) as usize;
        let groups = columns as usize * (self.height.next_multiple_of(64) / GROUP[1]) as usize;
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
    /// For such tiles, of pixels that are to have so many samples in the mean; none if not much is to be gained.
    pub fn of(tiles: &[Tile], grid: Grid, samples: u32) -> Self {
        of_tiles(tiles, grid, samples).map_or_else(Self::default, |of_tiles| {
            Self::of_pixels(grid, |at| grid.tiles(at).map(|tile| of_tiles[tile as usize]))
        })
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

    /// Samples of all `pixels` of the image, if each is to have `samples` in the mean; of either kind of groups.
    pub fn samples(&self, kind: usize, samples: u32, pixels: u64) -> u64 {
        if self.is_even() {
            return pixels * u64::from(samples);
        }
        Multiplier::ALL.iter().map(|m| self.pixels[kind][m.index()] * u64::from(m.of(samples))).sum()
    }
}

/// The multipliers of tiles, of pixels that are to have so many samples in the mean; none if not much is to be gained.
fn of_tiles(tiles: &[Tile], grid: Grid, samples: u32) -> Option<Vec<Multiplier>> {
    let Grid { width, height, .. } = grid;
    // What their neighbours tell of tiles shows whether it is true.
    let neighbours = smooth(tiles, width, height, 0.0);
    let allowance = Allowance::of(samples);
    let left = left(&without_rare(tiles, &neighbours), &divide(&neighbours, allowance));
    log::debug!("sample map: {left:.3} of the variance");
    // It may be no number.
    (left <= allowance.worth).then(|| divide(&smooth(tiles, width, height, OWN), allowance))
}

/// What is known of a tile before its samples are taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Tile {
    /// Those in the image.
    pub pixels: f64,
    /// What a sample of each of them takes, in any unit.
    pub cost: f64,
    /// Of a sample of a pixel, in the mean, if any have been tried.
    pub variance: Option<f64>,
}

/// What a tile's own variance counts.
const OWN: f64 = 2.0;
/// What that of a neighbour counts, to the power of the distance along the sides.
const NEIGHBOUR: f64 = 0.6;
/// How far neighbours are.
const NEIGHBOURHOOD: u32 = 2;

/// What multipliers may be.
#[derive(Debug, Clone, Copy)]
struct Allowance {
    /// From the least to the greatest.
    multipliers: &'static [Multiplier],
    /// What samples may cost, if they would cost 1 with one for each pixel.
    cost: f64,
    /// What must be left of the variance, at most, for the same cost.
    worth: f64,
}

impl Allowance {
    /// For so many samples per pixel. Of two or three no pixel can do with less: gradients need one in groups as they are and one in
    /// shifted ones (a bunny in a room with half of two: 3.9 times the variance). So there are some more in all where it is noisy, but
    /// fewer than of four.
    fn of(samples: u32) -> Self {
        let (cost, worth) = match samples {
            ..=2 => (1.4, 0.92),
            3 => (1.2, 0.92),
            _ => return Self { multipliers: &Multiplier::OF_TILES, cost: 1.0, worth: 0.92 },
        };
        Self { multipliers: &Multiplier::OF_TILES[1..], cost, worth }
    }
}

/// A tile that has more than so many times the variance that its neighbours foretell says nothing against them: a few pixels may
/// have met by chance what is rare.
const RARE: f64 = 4.0;

/// The part of the variance that such multipliers leave, for the same cost.
fn left(tiles: &[Tile], multipliers: &[Multiplier]) -> f64 {
    let (mut before, mut after) = ([0.0; 2], [0.0; 2]);
    for (tile, multiplier) in tiles.iter().zip(multipliers) {
        let (variance, factor) = (tile.pixels * tile.variance.unwrap_or_default(), multiplier.factor());
        before = [before[0] + variance, before[1] + tile.cost];
        after = [after[0] + variance / factor, after[1] + tile.cost * factor];
    }
    (after[0] * after[1]) / (before[0] * before[1])
}

/// The tiles with no more variance than their neighbours let expect.
fn without_rare(tiles: &[Tile], neighbours: &[Tile]) -> Vec<Tile> {
    let bounded = |(tile, around): (&Tile, &Tile)| {
        let most = around.variance.map_or(f64::INFINITY, |variance| RARE * variance);
        Tile { variance: tile.variance.map(|variance| variance.min(most)), ..*tile }
    };
    tiles.iter().zip(neighbours).map(bounded).collect()
}

/// The tiles with the variance of their neighbourhoods, in which they themselves count so much: few pixels tell their own. It is
/// the square of the mean deviation, which a single bright sample does not decide. (Against the mean variance of nine tiles, and no
/// map where that finds nothing to gain, a box with an emitter has .6 of the squared error, 64 emitters .8, seven other scenes .95
/// to 1.)
fn smooth(tiles: &[Tile], width: u32, height: u32, own: f64) -> Vec<Tile> {
    let deviations: Vec<_> = tiles.iter().map(|tile| tile.variance.map(f64::sqrt)).collect();
    let counts = |distance: usize| if distance == 0 { own } else { NEIGHBOUR.powi(distance as i32) };
    let counts: [f64; 2 * NEIGHBOURHOOD as usize + 1] = std::array::from_fn(counts);
    let mean = |(tile, known): (usize, &Tile)| {
        let (mut weights, mut sum) = (0.0, 0.0_f64);
        for (other, distance) in tiles_within(NEIGHBOURHOOD, tile as u32, width, height) {
            let Some(deviation) = deviations[other] else { continue };
            let weight = tiles[other].pixels * counts[distance as usize];
            weights += weight;
            sum += weight * deviation;
        }
        Tile { variance: (weights > 0.0).then(|| (sum / weights).powi(2)), ..*known }
    };
    tiles.par_iter().enumerate().map(mean).collect()
}

/// The multipliers of tiles, so that their samples cost as much as they may, or a little less.
fn divide(tiles: &[Tile], allowance: Allowance) -> Vec<Multiplier> {
    // Where nothing is known, as beyond the edge of the image, all is as it was; so it is where no light was found all around, since
    // the pilot pass may have missed an emitter of a few pixels.
    let known = |tile: &Tile| tile.variance.filter(|variance| tile.pixels > 0.0 && *variance > 0.0);
    let wanted = |tile: &Tile| Some(0.5 * (known(tile)? / (tile.cost / tile.pixels).max(1e-9)).log2());
    let wanted: Vec<_> = tiles.iter().map(wanted).collect();
    // From those that want most on, what they and those before cost.
    let mut wishes: Vec<_> =
        tiles.iter().zip(&wanted).filter_map(|(tile, wanted)| Some(((*wanted)?, tile.cost))).collect();
    wishes.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    let mut costs = vec![0.0];
    costs.extend(wishes.iter().scan(0.0, |sum, wish| {
        *sum += wish.1;
        Some(*sum)
    }));
    let all = costs[wishes.len()];
    let of_those_above = |least: f64| costs[wishes.partition_point(|wish| wish.0 >= least)];
    let Allowance { multipliers, cost: may_cost, .. } = allowance;
    // Each has the least, or steps up to greater ones.
    let more = |step: &[Multiplier], scale: f64| {
        (step[1].factor() - step[0].factor()) * of_those_above(f64::from(step[0].0) + 0.5 - scale)
    };
    let cost =
        |scale: f64| all * multipliers[0].factor() + multipliers.windows(2).map(|step| more(step, scale)).sum::<f64>();
    // The logarithms of numbers lie between these.
    let (mut low, mut high) = (-1100.0, 1100.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if cost(middle) <= may_cost * all { low = middle } else { high = middle }
    }
    let (least, most) = (multipliers[0], multipliers[multipliers.len() - 1]);
    let multiplier = |wanted: f64| Multiplier::near(wanted + low).clamp(least, most);
    wanted.into_iter().map(|wanted| wanted.map_or(Multiplier::ONE, multiplier)).collect()
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;
    use crate::render::film::place_of_tile;

    const GRID: Grid = Grid { width: 64, height: 64, band_rows: 64 };

    /// Tiles of an image of 64 × 64 pixels, of which those in the left half have so many times the variance of the others.
    fn tiles(contrast: f64, cost: f64) -> Vec<Tile> {
        let tile = |tile: u32| {
            let left = place_of_tile(tile, GRID.width)[0] < 4;
            Tile {
                pixels: 64.0,
                cost: if left { 64.0 * cost } else { 64.0 },
                variance: Some(if left { contrast } else { 1.0 }),
            }
        };
        (0..64).map(tile).collect()
    }

    #[test]
    fn multipliers_are_powers_of_two() {
        let of = |samples: u32| [-1.2, 0.1, 1.0, 7.0].map(|logarithm| Multiplier::near(logarithm).of(samples));
        assert_eq!((of(8), of(1), of(0)), ([4, 8, 16, 256], [1, 1, 2, 32], [0; 4]));
        assert_eq!(Multiplier::ALL.map(Multiplier::factor), [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0]);
        assert_eq!(Multiplier::ALL.map(Multiplier::bits), [15, 0, 1, 2, 3, 4, 5]);
        assert_eq!([f64::NEG_INFINITY, f64::NAN].map(Multiplier::near), [Multiplier(-1), Multiplier(0)]);
    }

    #[test]
    fn noise_gets_samples_within_the_cost() {
        let contrasts = [(1.0, 1.0), (16.0, 1.0), (16.0, 5.0), (1e6, 1.0), (1e-6, 3.0), (0.0, 1.0)];
        for ((contrast, cost), samples) in contrasts.into_iter().flat_map(|c| [2, 3, 4].map(|samples| (c, samples))) {
            let tiles = tiles(contrast, cost);
            let map = divide(&tiles, Allowance::of(samples));
            let taken: f64 = tiles.iter().zip(&map).map(|(tile, multiplier)| tile.cost * multiplier.factor()).sum();
            let all: f64 = tiles.iter().map(|tile| tile.cost).sum();
            assert!(taken <= Allowance::of(samples).cost * all, "{contrast} {cost} {samples}");
            assert!(left(&tiles, &map) <= 1.0, "{contrast} {cost} {samples}");
            assert!(samples >= 4 || map.iter().all(|multiplier| *multiplier >= Multiplier(0)));
        }
        // Where all is alike nothing is to be gained, nor where nothing is known.
        assert!(SampleMap::of(&tiles(1.0, 1.0), GRID, 4).is_even());
        assert!(SampleMap::of(&vec![Tile::default(); 64], GRID, 4).is_even());
        assert!(SampleMap::of(&tiles(f64::NAN, 1.0), GRID, 4).is_even());
    }

    #[test]
    fn one_bright_sample_does_not_decide() {
        let mut some = tiles(64.0, 1.0);
        let dark = tile_of_pixel(60, 36, GRID.width) as usize;
        some[dark].variance = Some(2e3);
        // In the mean variance it would be all that counts.
        let map = SampleMap::of(&some, GRID, 4);
        assert!(!map.is_even());
        let factor = |x: usize, y: usize| map.of_pixel(y * 64 + x)[0].factor();
        assert!(factor(4, 4) > factor(60, 4));
    }

    #[test]
    fn tiles_where_no_light_was_found_stay_as_they_are() {
        let mut some = tiles(1.0, 1.0);
        let in_columns =
            |tile: usize, columns: Range<u32>| columns.contains(&place_of_tile(tile as u32, GRID.width)[0]);
        for (tile, of_tile) in some.iter_mut().enumerate() {
            of_tile.variance = Some(if in_columns(tile, 0..2) { 256.0 } else { 1.0 });
            if in_columns(tile, 4..8) {
                (of_tile.variance, of_tile.cost) = (Some(0.0), 0.0);
            }
        }
        let map = SampleMap::of(&some, GRID, 4);
        let factors = [0, 24, 60].map(|x| map.of_pixel(32 * 64 + x)[0].factor());
        assert!(factors[0] > 1.0 && factors[1] < 1.0 && factors[2] == 1.0, "{factors:?}");
    }

    #[test]
    fn tiles_of_which_nothing_is_known_follow_their_neighbours() {
        let mut some = tiles(64.0, 1.0);
        let inner = tile_of_pixel(12, 12, GRID.width) as usize;
        some[inner].variance = None;
        assert_eq!(smooth(&some, GRID.width, GRID.height, 1.0)[inner].variance, Some(64.0));
        let pixel = 12 * 64 + 12;
        // Those beyond the edge of the image have the multiplier that all pixels would have otherwise.
        some[inner] = Tile::default();
        assert_eq!(divide(&some, Allowance::of(4))[inner], Multiplier(0));
        assert_eq!(SampleMap::of(&some, GRID, 4).of_pixel(pixel)[0], Multiplier(0));
    }

    #[test]
    fn pixels_have_the_multipliers_of_their_tiles() {
        let map = SampleMap::of(&tiles(64.0, 1.0), GRID, 4);
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
        let halved = SampleMap::of(&tiles(1e-6, 1.0), GRID, 4);
        assert!(halved.of_pixel(0)[0] < one);
        let both = halved.with_at_least(&wanted, true, GRID);
        assert_eq!((both.of_pixel(0), both.of_pixel(8)[0] < one), ([four; 2], true));
    }
}
