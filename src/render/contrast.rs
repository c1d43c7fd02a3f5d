//! Noise as an image of one sample per pixel shows it: by how much pixels, and groups of pixels, differ from those beside them.
//!
//! What the image shows differs too, but where it does by much, at edges, a pixel's samples do as well. All of it is apart for the
//! two halves of the image (tiles.rs), which are independent of each other: what one half tells may decide how many samples the pixels
//! of the other get, and the image stays exact in the mean.

use rayon::prelude::*;

use super::film::{GROUP, GROUPS, MEMBERS, slot_count, tile_corner};
use super::sample_map::Tile;
use super::tiles::{TILE, half_of_group};

/// Pairs of neighbours in a group.
const PAIRS: f64 = 10.0;

/// What a group of pixels shows.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Group {
    mean: f64,
    /// The variance of a pixel, from its differences from those beside it.
    within: f64,
}

impl Group {
    /// Of its two rows.
    fn of(upper: &[f32], lower: &[f32]) -> Self {
        let square = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2);
        let along = |row: &[f32]| row.iter().zip(&row[1..]).map(square).sum::<f64>();
        let across: f64 = upper.iter().zip(lower).map(square).sum();
        let sum: f64 = upper.iter().chain(lower).map(|v| f64::from(*v)).sum();
        Self { mean: sum / MEMBERS as f64, within: (along(upper) + along(lower) + across) / (2.0 * PAIRS) }
    }
}

/// The groups of an image that lie in it as a whole, row by row.
struct Groups {
    all: Vec<Group>,
    columns: usize,
}

impl Groups {
    /// Of an image of one number for each pixel, row by row.
    fn of(values: &[f32], width: usize) -> Self {
        let [columns, rows] = GROUP.map(|size| size as usize);
        let of_rows = |both: &[f32]| {
            let (upper, lower) = both.split_at(width);
            let pairs = upper.chunks_exact(columns).zip(lower.chunks_exact(columns));
            pairs.map(|(upper, lower)| Group::of(upper, lower)).collect::<Vec<_>>()
        };
        let all = values.par_chunks_exact(rows * width).flat_map_iter(of_rows).collect();
        Self { all, columns: width / columns }
    }

    /// The group in a column and row of groups.
    fn at(&self, column: usize, row: usize) -> Option<&Group> {
        if column < self.columns { self.all.get(row * self.columns + column) } else { None }
    }
}

/// A mean of what there is.
#[derive(Debug, Default)]
struct Mean {
    sum: f64,
    count: f64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        (self.sum, self.count) = (self.sum + value, self.count + 1.0);
    }

    fn get(&self) -> Option<f64> {
        (self.count > 0.0).then(|| self.sum / self.count)
    }
}

/// What the groups of each half of an image, of one number for each pixel, row by row, tell of the tiles' pixels of the other half:
/// first of those of half 0. All samples are taken to cost as much.
pub(crate) fn tiles_of_halves(values: &[f32], width: u32) -> [Vec<Tile>; 2] {
    let height = (values.len() / width as usize) as u32;
    let groups = Groups::of(values, width as usize);
    let tiles = (slot_count(width, height) / TILE as u64) as u32;
    let tile = |tile: u32, half: usize| {
        let corner = tile_corner(tile, width);
        let pixels = f64::from(pixels_of_half(corner, [width, height], half));
        Tile { pixels, cost: pixels, variance: variance(&groups, corner, 1 - half) }
    };
    [0, 1].map(|half| (0..tiles).into_par_iter().map(|t| tile(t, half)).collect())
}

/// The columns and rows of the groups of a half in the tile with such an upper left pixel.
fn groups_of_half(corner: [u32; 2], half: usize) -> impl Iterator<Item = [u32; 2]> {
    let first = [corner[0] / GROUP[0], corner[1] / GROUP[1]];
    let rows = first[1]..first[1] + GROUPS[1];
    let places = rows.flat_map(move |row| (first[0]..first[0] + GROUPS[0]).map(move |column| [column, row]));
    places.filter(move |[column, row]| half_of_group(*column, *row) == half)
}

/// Pixels of a half in a tile.
fn pixels_of_half(corner: [u32; 2], size: [u32; 2], half: usize) -> u32 {
    let inside = |place: u32, axis: usize| size[axis].saturating_sub(place * GROUP[axis]).min(GROUP[axis]);
    groups_of_half(corner, half).map(|[column, row]| inside(column, 0) * inside(row, 1)).sum()
}

/// The variance of a pixel of a tile, as the groups of a half show it: what each pixel has of its own, in the differences within
/// groups, and what a group has in common, in those between the next two groups of that half.
fn variance(groups: &Groups, corner: [u32; 2], half: usize) -> Option<f64> {
    let (mut within, mut between) = (Mean::default(), Mean::default());
    for [column, row] in groups_of_half(corner, half) {
        let at = |column: u32, row: u32| groups.at(column as usize, row as usize);
        let Some(group) = at(column, row) else { continue };
        within.add(group.within);
        // Those that touch its lower corners.
        let below = [column.checked_sub(1), Some(column + 1)].into_iter().flatten().filter_map(|c| at(c, row + 1));
        below.for_each(|other| between.add((group.mean - other.mean).powi(2) / 2.0));
    }
    // Samples that were not finite tell nothing.
    within.get().map(|within| within + between.get().unwrap_or_default()).filter(|variance| variance.is_finite())
}

#[cfg(test)]
mod tests {
    use super::super::sample_map::{Grid, SampleMap};
    use super::*;

    const WIDTH: u32 = 64;

    fn image(value: impl Fn(u32, u32) -> f32) -> Vec<f32> {
        (0..WIDTH * 64).map(|p| value(p % WIDTH, p / WIDTH)).collect()
    }

    /// Evenly distributed numbers, with a variance of 1.
    fn random(n: u32) -> f32 {
        let mixed = (n ^ 0x9e37_79b9).wrapping_mul(0x85eb_ca6b);
        let mixed = (mixed ^ mixed >> 15).wrapping_mul(0xc2b2_ae35);
        ((mixed ^ mixed >> 13) as f32 / u32::MAX as f32 - 0.5) * 12_f32.sqrt()
    }

    /// The mean variance of the tiles for the pixels of a half.
    fn mean_variance(values: &[f32], half: usize) -> f64 {
        let tiles = &tiles_of_halves(values, WIDTH)[half];
        tiles.iter().map(|tile| tile.variance.unwrap()).sum::<f64>() / tiles.len() as f64
    }

    #[test]
    fn noise_of_pixels_and_of_groups_is_found() {
        assert!(mean_variance(&image(|_, _| 3.0), 0) == 0.0);
        // A group's mean of eight has an eighth of its pixels' variance.
        let of_pixels = image(|x, y| random(y * WIDTH + x));
        let of_groups = image(|x, y| random(y / 2 * WIDTH + x / 4));
        for half in 0..2 {
            let found = [&of_pixels, &of_groups].map(|values| mean_variance(values, half));
            assert!((found[0] - 1.125).abs() < 0.1 && (found[1] - 1.0).abs() < 0.2, "{found:?}");
        }
    }

    #[test]
    fn halves_tell_of_each_other_only() {
        let half = |x: u32, y: u32| half_of_group(x / 4, y / 2);
        let noise = image(|x, y| if half(x, y) == 1 { random(y * WIDTH + x) } else { 0.0 });
        assert!(mean_variance(&noise, 0) > 0.9 && mean_variance(&noise, 1) == 0.0);
    }

    #[test]
    fn noise_of_a_half_brings_samples_to_the_other() {
        let grid = Grid { width: WIDTH, height: 64, band_rows: 64 };
        for noisy in 0..2 {
            // In a corner; elsewhere it is a hundred times weaker.
            let noise = |x: u32, y: u32| {
                let strength = if x < 24 && y < 24 { 1.0 } else { 0.01 };
                let own = half_of_group(x / 4, y / 2) == noisy;
                if own { strength * random(y * WIDTH + x) } else { 1.0 }
            };
            let [a, b] = tiles_of_halves(&image(noise), WIDTH);
            let map = SampleMap::of_halves([&a, &b], grid);
            let more = |p: usize| map.of_pixel(p) != SampleMap::default().of_pixel(p);
            let half = |p: usize| half_of_group(p as u32 % WIDTH / 4, p as u32 / WIDTH / 2);
            assert!((0..4096).any(more) && (0..4096).filter(|p| more(*p)).all(|p| half(p) != noisy && p % 64 < 40));
        }
    }

    #[test]
    fn tiles_at_the_edge_have_fewer_pixels() {
        // Of 13 × 9 pixels; the blocks have more tiles.
        let [a, b] = tiles_of_halves(&[1.0; 117], 13);
        let pixels = |tiles: &[Tile]| tiles.iter().map(|tile| tile.pixels).sum::<f64>();
        assert_eq!((pixels(&a) + pixels(&b), a[0].pixels, a[1].pixels), (117.0, 32.0, 20.0));
        assert_eq!((a[0].variance, a[31], a[31].variance), (Some(0.0), Tile::default(), None));
        // A group that is not in the image as a whole tells nothing, nor does what is not finite.
        assert_eq!(tiles_of_halves(&[f32::NAN; 117], 13)[0][0].variance, None);
        assert_eq!(tiles_of_halves(&[1.0; 3], 3)[0][0].variance, None);
    }
}
