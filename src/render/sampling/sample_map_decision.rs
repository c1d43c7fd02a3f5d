//! Decides how many of the samples each pixel gets (shaders/lib/sample_map.glsl).

use crate::render::engine::Engine;
use crate::render::error::RenderError;
use crate::render::film::tiling::{SET, TILE, pixel_of_slot, pixels_in, slot_count};
use crate::render::kernel::features::Features;
use crate::render::kernel::layout::FilmSlot;
use crate::render::kernel::sobol::{MAX_SAMPLES, levels};
use crate::render::reuse::pilot::PilotStatistics;
use crate::render::sampling::allocation::{Tile, allocate};
use crate::render::sampling::multiplier::Multiplier;
use crate::render::sampling::sample_map::{Grid, SampleMap};
use crate::render::settings;
use crate::render::settings::RenderSettings;

/// Samples that the first level of the sampler's table is for. Multipliers above 4 stay within: a second level makes all samples slower,
/// and where there are many the error at edges, which falls faster than elsewhere, needs no more.
const OF_FIRST_LEVEL: u32 = 1024;

/// The greatest multiplier, if so many samples per pixel are asked for.
pub(crate) fn greatest_multiplier(samples: u32) -> Multiplier {
    let fits = f64::from(OF_FIRST_LEVEL / samples.max(1)).max(1.0).log2().floor();
    Multiplier::near(fits).max(Multiplier::FOUR)
}

/// Samples that any pixel gets at most.
fn most_of_pixel(settings: &RenderSettings) -> u32 {
    greatest_multiplier(settings.planned_samples()).of(settings.samples)
}

/// Whether pixels are to get different numbers of samples, where that pays.
pub(crate) fn wants_sample_map(settings: &RenderSettings) -> bool {
    settings.sample_map == settings::SampleMap::Auto && most_of_pixel(settings) <= MAX_SAMPLES
}

/// Levels that the sampler's table has for a rendering, with a sample map or without.
pub(crate) fn levels_of_table(features: &Features, settings: &RenderSettings, sample_map: bool) -> u32 {
    let needed = if sample_map { levels(most_of_pixel(settings)) } else { 0 };
    features.sobol_levels.max(needed)
}

/// Whether pixels may get different numbers of samples with a kernel that is made for that, whose sampler's table has so many levels.
pub(crate) fn fits_sample_map(settings: &RenderSettings, table_levels: u32) -> bool {
    // Of more samples than the renderer was made for, some pixels might need a larger table.
    wants_sample_map(settings) && levels(most_of_pixel(settings)) <= table_levels
}

/// No samples in the film, whose pixels are to have as many as the map says.
///
/// # Errors
/// The device fails.
pub(crate) fn empty_film(engine: &mut Engine, map: &SampleMap) -> Result<(), RenderError> {
    engine.clear_film()?;
    let [width, height] = engine.size();
    let spans = engine.spans_of(map.tiles(width).into_iter());
    let multipliers = |slot| pixel_of_slot(slot, width, height).map_or(0, |pixel| map.bits(pixel));
    engine.fill_film(&spans, |slot| FilmSlot { multipliers: multipliers(slot), ..FilmSlot::default() })
}

/// Allocates samples to tiles by what a pilot pass shows, for a rendering of so many per pixel in which paths are `reused` and differences
/// between neighbours made use of (`gradients`).
pub(crate) fn allocate_samples(
    pilot: &PilotStatistics,
    [reused, gradients]: [bool; 2],
    grid: Grid,
    samples: u32,
) -> SampleMap {
    let Grid { width, height, .. } = grid;
    let tiles = slot_count(width, height) as u32 / TILE as u32;
    let pixels = |tile: u32| pixels_in(tile * TILE as u32, (tile + 1) * TILE as u32, width, height) as f64;
    let mut tiles: Vec<_> = (0..tiles).map(|tile| Tile { pixels: pixels(tile), ..Tile::default() }).collect();
    for of_tile in pilot.groups.chunk_by(|a, b| a.tile == b.tile) {
        let variances: Vec<_> = of_tile.iter().filter_map(|group| group.variance(reused, gradients)).collect();
        let known = !variances.is_empty();
        let mean = variances.iter().sum::<f64>() / variances.len() as f64;
        tiles[of_tile[0].tile as usize].variance = known.then_some(mean);
    }
    // What is known of the cost is that of a set of tiles, part of which may be recorded where there is no pixel. Where samples
    // were taken again it is not known.
    for of_set in pilot.groups.chunk_by(|a, b| a.tile / SET == b.tile / SET) {
        let first = of_set[0].tile / SET * SET;
        let set = &mut tiles[first as usize..][..SET as usize];
        let all: f64 = set.iter().map(|tile| tile.pixels).sum();
        let of_all = of_set.iter().map(|group| group.cost).sum::<f64>() / all.max(1.0);
        let cost = if pilot.repeated { 1.0 } else { of_all };
        set.iter_mut().for_each(|tile| tile.cost = tile.pixels * cost);
    }
    allocate(&tiles, [width, height], samples)
        .map_or_else(SampleMap::default, |of_tiles| SampleMap::from_tiles(&of_tiles, grid))
}
