//! How the samples of each pixel begin: as one path, as several, or as glances and a path (shaders/lib/glance.glsl).

use std::mem::take;

use rayon::prelude::*;

use super::super::error::RenderError;
use super::super::film::{TILE, pixel_of_slot, slot_count, tiles_of_pixels};
use super::super::layout::{FilmSlot, glance};
use super::Renderer;
use super::{glances, repeats};

impl FilmSlot {
    /// A slot that is empty, but for the state in which its samples are to begin.
    pub(super) fn beginning(state: u32) -> Self {
        Self { state, ..Self::default() }
    }
}

/// How the samples of pixels begin, where not as one path.
#[derive(Debug, Clone, Default)]
pub(super) struct Beginnings {
    /// The state of each pixel, row by row; empty if all are 0.
    states: Vec<u32>,
    /// The tiles where it may be another, in increasing order.
    tiles: Vec<usize>,
}

impl Renderer {
    /// Before a rendering, the film being empty: finds how samples should begin. It depends on no random number of the image.
    pub(super) fn find_beginnings(&mut self) -> Result<(), RenderError> {
        self.beginnings = Beginnings::default();
        let (near_lamps, paths) = (self.look_for_lamps()?, self.look_for_glass()?);
        if near_lamps.is_none() && paths.is_none() {
            return Ok(());
        }
        let near_lamps = near_lamps.unwrap_or_default();
        self.statistics.glancing_pixels = near_lamps.len() as u64;
        let (tiles, mut states): (Vec<_>, Vec<_>) = match &paths {
            None => {
                let pixels = self.width as usize * self.height as usize;
                (tiles_of_pixels(&near_lamps, self.width), vec![0; pixels])
            }
            Some(paths) => {
                let tiles = slot_count(self.width, self.height) as usize / TILE;
                ((0..tiles).collect(), paths.par_iter().map(|n| repeats::sample(*n)).collect())
            }
        };
        near_lamps.iter().for_each(|pixel| states[*pixel] = glances::SAMPLE);
        if paths.is_some() {
            let repeats = |state: &&u32| **state & glance::REPEATED != 0;
            self.statistics.repeating_pixels = states.par_iter().filter(repeats).count() as u64;
        }
        self.beginnings = Beginnings { states, tiles };
        self.empty_film()
    }

    /// No samples in the film, whose pixels' samples are to begin as they should, and to be as many.
    pub(super) fn empty_film(&mut self) -> Result<(), RenderError> {
        self.clear_film()?;
        let (width, height) = (self.width, self.height);
        let (beginnings, shares) = (take(&mut self.beginnings), take(&mut self.shares));
        let tiles = beginnings.tiles.iter().copied();
        let spans = if shares.is_even() { self.spans_of(tiles) } else { self.whole_film() };
        let state = |pixel: usize| beginnings.states.get(pixel).copied().unwrap_or(0) | shares.state(pixel);
        let slot = |slot| FilmSlot::beginning(pixel_of_slot(slot, width, height).map_or(0, state));
        let filled = self.fill_film(&spans, slot);
        (self.beginnings, self.shares) = (beginnings, shares);
        filled
    }
}
