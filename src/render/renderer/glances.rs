//! Where samples look several times at lamps (shaders/lib/glance.glsl): where an image of a few glances has edges.

use rayon::prelude::*;

use super::super::error::RenderError;
use super::super::features::Features;
use super::super::film::pixel_of_slot;
use super::super::layout::{FilmSlot, glance};
use super::super::settings::{Glances, RenderSettings};
use super::super::tables::Tables;
use super::Renderer;
use super::passes::Watch;

/// Glances of a pixel from which edges are found.
const FIRST_GLANCES: u32 = 4;
/// Renderings of fewer samples per pixel do without: finding the edges takes as long as half a sample to one.
const FEWEST_SAMPLES: u32 = 8;
/// What the seed is changed by (XOR) for these, so that what is found does not depend on the image's random numbers.
const SEED: u32 = 0x9216_d5d9;

/// Glances of a sample in a scene that needs these features; 0 if nothing is to be gained.
pub(super) fn of_sample(needed: &Features, tables: &Tables, settings: &RenderSettings, reuse: bool) -> u32 {
    let wanted = settings.glances == Glances::Auto && settings.samples >= FEWEST_SAMPLES && !reuse;
    let seen = tables.shows_emitters || (needed.mirror && tables.has_emitters());
    if wanted && seen { glance::GLANCES } else { 0 }
}

/// A slot without samples, those of which begin in a state.
fn empty_slot(state: u32) -> FilmSlot {
    FilmSlot { trial_without: f32::from_bits(state), ..FilmSlot::default() }
}

impl Renderer {
    /// Before a rendering, the film being empty: finds the pixels whose samples need glances.
    pub(super) fn look_for_lamps(&mut self, watch: &mut Watch<'_>) -> Result<(), RenderError> {
        if self.glances == 0 || self.settings.samples < FEWEST_SAMPLES {
            return Ok(());
        }
        let (width, height) = (self.width, self.height);
        self.fill_film(|_| empty_slot(glance::GLANCING | (FIRST_GLANCES - 1)))?;
        let (pace, seed) = (self.pace, self.push.seed);
        self.push.seed = seed ^ SEED;
        watch.over(|watch| self.steady_pass(&self.whole_film(), 0, 1, 0, watch))?;
        self.push.seed = seed;
        self.pace = pace;
        (self.statistics.samples, self.statistics.bad_samples) = (0, 0);
        let mut seen = vec![[0.0; 3]; width as usize * height as usize];
        self.read_slots(&self.whole_film(), |first, slots| {
            for (i, slot) in slots.iter().enumerate() {
                if let Some(pixel) = pixel_of_slot(first + i as u32, width, height) {
                    seen[pixel] = slot.sum;
                }
            }
        })?;
        let near = near_edges(&seen, width as usize);
        self.statistics.glancing_pixels = near.iter().filter(|near| **near).count() as u64;
        self.fill_film(|slot| {
            let pixel = pixel_of_slot(slot, width, height);
            empty_slot(if pixel.is_some_and(|p| near[p]) { glance::GLANCES } else { 0 })
        })
    }
}

/// Pixels that are not alike all their neighbours, those across a corner included.
fn near_edges(seen: &[[f32; 3]], width: usize) -> Vec<bool> {
    let height = seen.len() / width;
    let around = |i: usize, end: usize| i.saturating_sub(1)..(i + 2).min(end);
    let differs = |p: usize| {
        let (x, y) = (p % width, p / width);
        around(y, height).any(|y| around(x, width).any(|x| seen[y * width + x] != seen[p]))
    };
    (0..seen.len()).into_par_iter().map(differs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_beside_an_edge_are_found() {
        let mut seen = vec![[0.0; 3]; 35];
        assert!(near_edges(&seen, 7).iter().all(|n| !n));
        seen[2 * 7 + 3] = [1.0, 0.0, 0.0];
        let near: Vec<usize> = near_edges(&seen, 7).iter().enumerate().filter(|(_, n)| **n).map(|n| n.0).collect();
        assert_eq!(near, [9, 10, 11, 16, 17, 18, 23, 24, 25]);
        // In a corner, and in an image of one pixel.
        seen[17] = [0.0; 3];
        seen[34] = [0.0, f32::NAN, 0.0];
        assert_eq!(near_edges(&seen, 7).iter().filter(|n| **n).count(), 4);
        assert_eq!(near_edges(&[[3.0; 3]], 1), [false]);
    }
}
