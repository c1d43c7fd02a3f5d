//! Decides how many of the samples each part of the image gets (shaders/lib/share.glsl).

use super::super::features::Features;
use super::super::film::{TILE, pixels_in, rows_of_blocks, slot_count, slots_of_row};
use super::super::layout::queue;
use super::super::settings::{self, RenderSettings};
use super::super::shares::{Grid, Share, Shares, Tile};
use super::super::sobol::{MAX_SAMPLES, levels};
use super::Renderer;
use super::trial::{SET, Tried};

/// Levels that the sampler's table has for a rendering: enough for those pixels that get most, if paths may serve several pixels. (A
/// second one takes 1.0 to 1.05 times as long.)
pub(super) fn levels_of_table(features: &Features, settings: &RenderSettings, reuse: bool) -> u32 {
    let needed = if reuse && wants_shares(settings) { levels(most_of_pixel(settings)) } else { 0 };
    features.sobol_levels.max(needed)
}

/// Samples that the noisiest pixels get.
fn most_of_pixel(settings: &RenderSettings) -> u32 {
    settings.samples.saturating_mul(Share::MOST)
}

/// Whether pixels are to get different numbers of samples, where that pays.
fn wants_shares(settings: &RenderSettings) -> bool {
    settings.shares == settings::Shares::Auto
        && settings.adaptive.is_none()
        && settings.samples >= queue::TRIAL
        && most_of_pixel(settings) <= MAX_SAMPLES
}

impl Renderer {
    /// Whether pixels may get different numbers of samples.
    pub(super) fn may_share(&self) -> bool {
        wants_shares(&self.settings)
            // Of more samples than the renderer was made for, some pixels might need a larger table.
            && levels(most_of_pixel(&self.settings)) <= self.launch.sobol_levels
            && self.buffers.has_whole_rows(slots_of_row(self.width))
    }

    /// Decides about the shares of tiles.
    pub(super) fn divide_samples(&mut self, tried: &Tried) {
        let (reused, gradients) = (self.reuses_paths(), self.makes_gradients());
        let tiles = slot_count(self.width, self.height) as u32 / TILE as u32;
        let pixels =
            |tile: u32| pixels_in(tile * TILE as u32, (tile + 1) * TILE as u32, self.width, self.height) as f64;
        let mut tiles: Vec<_> = (0..tiles).map(|tile| Tile { pixels: pixels(tile), ..Tile::default() }).collect();
        for of_tile in tried.groups.chunk_by(|a, b| a.tile == b.tile) {
            let variances: Vec<_> = of_tile.iter().filter_map(|group| group.variance(reused, gradients)).collect();
            let known = !variances.is_empty();
            let mean = variances.iter().sum::<f64>() / variances.len() as f64;
            tiles[of_tile[0].tile as usize].variance = known.then_some(mean);
        }
        // What is known of the cost is that of a set of tiles, part of which may be noted where there is no pixel. Where samples
        // were taken again it is not known.
        for of_set in tried.groups.chunk_by(|a, b| a.tile / SET == b.tile / SET) {
            let first = of_set[0].tile / SET * SET;
            let set = &mut tiles[first as usize..][..SET as usize];
            let all: f64 = set.iter().map(|tile| tile.pixels).sum();
            let of_all = of_set.iter().map(|group| group.cost).sum::<f64>() / all.max(1.0);
            let cost = if tried.repeated { 1.0 } else { of_all };
            set.iter_mut().for_each(|tile| tile.cost = tile.pixels * cost);
        }
        self.shares = Shares::of(&tiles, self.grid(), self.settings.samples);
    }

    fn grid(&self) -> Grid {
        let band_rows = rows_of_blocks(self.buffers.bands[0].slots, self.width);
        Grid { width: self.width, height: self.height, band_rows }
    }
}
