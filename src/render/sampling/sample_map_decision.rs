//! Decides how many of the samples each pixel gets (shaders/lib/sample_map.glsl).

use crate::render::error::RenderError;
use crate::render::film::{TILE, pixel_of_slot, pixels_in, rows_of_blocks, slot_count, slots_of_row};
use crate::render::kernel::features::Features;
use crate::render::kernel::layout::{FilmSlot, queue};
use crate::render::renderer::Renderer;
use crate::render::renderer::pilot::{PilotStatistics, SET};
use crate::render::sampling::sample_map::{Grid, Multiplier, SampleMap, Tile};
use crate::render::sampling::sobol::{MAX_SAMPLES, levels};
use crate::render::settings;
use crate::render::settings::RenderSettings;

/// Samples that the first level of the sampler's table is for. Multipliers above 4 stay within: a second level makes all samples slower,
/// and where there are many the error at edges, which falls faster than elsewhere, needs no more.
const OF_FIRST_LEVEL: u32 = 1024;

/// The greatest multiplier, if so many samples per pixel are asked for.
pub(super) fn greatest_multiplier(samples: u32) -> Multiplier {
    let fits = f64::from(OF_FIRST_LEVEL / samples.max(1)).max(1.0).log2().floor();
    Multiplier::near(fits).max(Multiplier::FOUR)
}

/// Samples that any pixel gets at most.
fn most_of_pixel(samples: u32) -> u32 {
    greatest_multiplier(samples).of(samples)
}

/// Whether pixels are to get different numbers of samples, where that pays.
pub(super) fn wants_sample_map(settings: &RenderSettings) -> bool {
    settings.sample_map == settings::SampleMap::Auto && most_of_pixel(settings.samples) <= MAX_SAMPLES
}

/// Levels that the sampler's table has for a rendering, with a sample map or without.
pub(super) fn levels_of_table(features: &Features, settings: &RenderSettings, sample_map: bool) -> u32 {
    let needed = if sample_map { levels(most_of_pixel(settings.samples)) } else { 0 };
    features.sobol_levels.max(needed)
}

impl Renderer {
    /// Whether pixels may get different numbers of samples.
    pub(super) fn may_map_samples(&self) -> bool {
        self.launch.sample_map
            && wants_sample_map(&self.settings)
            // Of more samples than the renderer was made for, some pixels might need a larger table.
            && levels(most_of_pixel(self.settings.samples)) <= self.launch.sobol_levels
            && (!self.launch.reuse || self.buffers.has_whole_rows(slots_of_row(self.width)))
    }

    /// Whether samples may be allocated by noise and cost. Where sampling is adaptive they are not: it goes by what pixels show.
    pub(super) fn may_allocate(&self) -> bool {
        self.may_map_samples() && self.settings.adaptive.is_none() && self.settings.samples >= queue::PILOT_SAMPLES
    }

    /// No samples in the film, whose pixels are to have as many as the sample map says.
    pub(super) fn empty_film(&mut self) -> Result<(), RenderError> {
        self.clear_film()?;
        let (width, height) = (self.width, self.height);
        let map = std::mem::take(&mut self.sample_map);
        let spans = self.spans_of(map.tiles(width).into_iter());
        let multipliers = |slot| pixel_of_slot(slot, width, height).map_or(0, |pixel| map.bits(pixel));
        let filled = self.fill_film(&spans, |slot| FilmSlot { multipliers: multipliers(slot), ..FilmSlot::default() });
        self.sample_map = map;
        filled
    }

    /// Gives these pixels, row by row, such multipliers at least.
    pub(super) fn map_at_least(&mut self, wanted: &[Multiplier]) {
        let shared = self.reuses_paths();
        let grid = if shared { self.grid() } else { Grid { width: self.width, height: self.height, band_rows: 64 } };
        self.sample_map = std::mem::take(&mut self.sample_map).with_at_least(wanted, shared, grid);
        self.statistics.multiplied_pixels = self.sample_map.multiplied_pixels();
    }

    /// Allocates samples to tiles.
    pub(super) fn allocate_samples(&mut self, pilot_groups: &PilotStatistics) {
        let (reused, gradients) = (self.reuses_paths(), self.makes_gradients());
        let tiles = slot_count(self.width, self.height) as u32 / TILE as u32;
        let pixels =
            |tile: u32| pixels_in(tile * TILE as u32, (tile + 1) * TILE as u32, self.width, self.height) as f64;
        let mut tiles: Vec<_> = (0..tiles).map(|tile| Tile { pixels: pixels(tile), ..Tile::default() }).collect();
        for of_tile in pilot_groups.groups.chunk_by(|a, b| a.tile == b.tile) {
            let variances: Vec<_> = of_tile.iter().filter_map(|group| group.variance(reused, gradients)).collect();
            let known = !variances.is_empty();
            let mean = variances.iter().sum::<f64>() / variances.len() as f64;
            tiles[of_tile[0].tile as usize].variance = known.then_some(mean);
        }
        // What is known of the cost is that of a set of tiles, part of which may be noted where there is no pixel. Where samples
        // were taken again it is not known.
        for of_set in pilot_groups.groups.chunk_by(|a, b| a.tile / SET == b.tile / SET) {
            let first = of_set[0].tile / SET * SET;
            let set = &mut tiles[first as usize..][..SET as usize];
            let all: f64 = set.iter().map(|tile| tile.pixels).sum();
            let of_all = of_set.iter().map(|group| group.cost).sum::<f64>() / all.max(1.0);
            let cost = if pilot_groups.repeated { 1.0 } else { of_all };
            set.iter_mut().for_each(|tile| tile.cost = tile.pixels * cost);
        }
        self.sample_map = SampleMap::of(&tiles, self.grid(), self.settings.samples);
    }

    fn grid(&self) -> Grid {
        let band_rows = rows_of_blocks(self.buffers.bands[0].slots, self.width);
        Grid { width: self.width, height: self.height, band_rows }
    }
}
