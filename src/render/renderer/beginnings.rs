//! How the samples of each pixel begin: as one path, as several, or as glances and a path (shaders/lib/glance.glsl).

use std::mem::take;

use rayon::prelude::*;

use super::super::error::RenderError;
use super::super::film::pixel_of_slot;
use super::super::layout::FilmSlot;
use super::Renderer;
use super::{glances, repeats};

impl FilmSlot {
    /// A slot that is empty, but for the state in which its samples are to begin.
    pub(super) fn beginning(state: u32) -> Self {
        Self { state, ..Self::default() }
    }
}

impl Renderer {
    /// Before a rendering, the film being empty: finds how samples should begin. It depends on no random number of the image.
    pub(super) fn find_beginnings(&mut self) -> Result<(), RenderError> {
        self.beginnings.clear();
        let near_lamps = self.look_for_lamps()?;
        if !near_lamps.is_empty() {
            self.clear_film()?;
        }
        let paths = self.look_for_glass()?;
        let count = |found: usize| found as u64;
        self.statistics.glancing_pixels = count(near_lamps.iter().filter(|near| **near).count());
        let pixels = near_lamps.len().max(paths.len());
        let near = |pixel: usize| near_lamps.get(pixel).copied().unwrap_or(false);
        let paths = |pixel: usize| paths.get(pixel).copied().unwrap_or(1);
        let begins = |pixel| if near(pixel) { glances::SAMPLE } else { repeats::sample(paths(pixel)) };
        self.beginnings = (0..pixels).into_par_iter().map(begins).collect();
        self.statistics.repeating_pixels = count((0..pixels).filter(|&p| !near(p) && paths(p) > 1).count());
        if pixels > 0 { self.empty_film() } else { Ok(()) }
    }

    /// No samples in the film, whose pixels' samples are to begin as they should, and to be as many.
    pub(super) fn empty_film(&mut self) -> Result<(), RenderError> {
        self.clear_film()?;
        if self.beginnings.is_empty() && self.shares.is_even() {
            return Ok(());
        }
        let (width, height) = (self.width, self.height);
        let (states, shares) = (take(&mut self.beginnings), take(&mut self.shares));
        let state = |pixel: usize| states.get(pixel).copied().unwrap_or(0) | shares.state(pixel);
        let filled = self.fill_film(|slot| FilmSlot::beginning(pixel_of_slot(slot, width, height).map_or(0, state)));
        (self.beginnings, self.shares) = (states, shares);
        filled
    }
}
