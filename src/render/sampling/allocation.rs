//! Which tiles get more samples than others.
//!
//! Of a variance v for one sample, n samples leave v/n. For as many samples in all the image has least noise if n ∝ √v (Neyman
//! allocation, J. R. Stat. Soc. 97, 1934). Powers of two come near to that, and keep random numbers stratified.

use rayon::prelude::*;

use crate::render::film::tiling::tiles_within;
use crate::render::sampling::multiplier::Multiplier;

/// The multipliers of tiles, of pixels that are to have so many samples in the mean; none if not much is to be gained.
pub(crate) fn allocate(tiles: &[Tile], [width, height]: [u32; 2], samples: u32) -> Option<Vec<Multiplier>> {
    // What their neighbours tell of tiles shows whether it is true.
    let neighbours = smooth(tiles, width, height, 0.0);
    let allowance = Allowance::for_samples(samples);
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
    fn for_samples(samples: u32) -> Self {
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
    use crate::render::film::tiling::{place_of_tile, tile_of_pixel};
    use crate::render::sampling::sample_map::{Grid, SampleMap};

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

    /// The sample map of four samples per pixel.
    fn map_of(tiles: &[Tile]) -> SampleMap {
        allocate(tiles, [GRID.width, GRID.height], 4)
            .map_or_else(SampleMap::default, |of_tiles| SampleMap::from_tiles(&of_tiles, GRID))
    }

    #[test]
    fn noise_gets_samples_within_the_cost() {
        let contrasts = [(1.0, 1.0), (16.0, 1.0), (16.0, 5.0), (1e6, 1.0), (1e-6, 3.0), (0.0, 1.0)];
        for ((contrast, cost), samples) in contrasts.into_iter().flat_map(|c| [2, 3, 4].map(|samples| (c, samples))) {
            let tiles = tiles(contrast, cost);
            let map = divide(&tiles, Allowance::for_samples(samples));
            let taken: f64 = tiles.iter().zip(&map).map(|(tile, multiplier)| tile.cost * multiplier.factor()).sum();
            let all: f64 = tiles.iter().map(|tile| tile.cost).sum();
            assert!(taken <= Allowance::for_samples(samples).cost * all, "{contrast} {cost} {samples}");
            assert!(left(&tiles, &map) <= 1.0, "{contrast} {cost} {samples}");
            assert!(samples >= 4 || map.iter().all(|multiplier| *multiplier >= Multiplier(0)));
        }
        // Where all is alike nothing is to be gained, nor where nothing is known.
        assert!(map_of(&tiles(1.0, 1.0)).is_even());
        assert!(map_of(&vec![Tile::default(); 64]).is_even());
        assert!(map_of(&tiles(f64::NAN, 1.0)).is_even());
    }

    #[test]
    fn one_bright_sample_does_not_decide() {
        let mut some = tiles(64.0, 1.0);
        let dark = tile_of_pixel(60, 36, GRID.width) as usize;
        some[dark].variance = Some(2e3);
        // In the mean variance it would be all that counts.
        let map = map_of(&some);
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
        let map = map_of(&some);
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
        assert_eq!(divide(&some, Allowance::for_samples(4))[inner], Multiplier(0));
        assert_eq!(map_of(&some).of_pixel(pixel)[0], Multiplier(0));
    }
}
