//! Where samples look several times at lamps (shaders/lib/glance.glsl): where an image of a few glances has edges.

use rayon::prelude::*;

use super::super::error::RenderError;
use super::super::features::Features;
use super::super::layout::{FilmSlot, glance};
use super::super::plan::Work;
use super::super::settings::{Glances, RenderSettings};
use super::super::tables::Tables;
use super::Renderer;
use super::trial::ReuseTrial;

/// Glances of a pixel from which edges are found.
const FIRST_GLANCES: u32 = 4;
/// Renderings of fewer samples per pixel do without: finding the edges takes about as long as half a sample.
pub(super) const FEWEST_SAMPLES: u32 = 4;
/// How a sample with glances begins.
pub(super) const SAMPLE: u32 = glance::GLANCING | glance::PATH_FOLLOWS | (glance::GLANCES - 1);
/// What the seed is changed by (XOR) for these, so that what is found does not depend on the image's random numbers.
const SEED: u32 = 0x9216_d5d9;

/// A lamp's edge needs them if it is brighter than the rest of the image by this. Apart from each other, lamp and rest vary
/// more than the sum of both where they are alike: with n glances, if the lamp is less than 2n/(n − 1) times as bright, 2.13
/// with 16.
const CONTRAST: f64 = 2.2;
/// The rest is estimated from one sample of every so many tiles.
const REST_STEP: u32 = 15;

/// Glances of a sample in a scene that needs these features; 0 if nothing is to be gained.
pub(super) fn of_sample(needed: &Features, tables: &Tables, settings: &RenderSettings) -> u32 {
    let seen = tables.shows_emitters || (needed.mirror && tables.has_emitters());
    if settings.glances == Glances::Auto && seen { glance::GLANCES } else { 0 }
}

impl Renderer {
    /// The pixels, row by row, whose samples need glances; none if there are none to be made. Overwrites the film.
    pub(super) fn look_for_lamps(&mut self) -> Result<Vec<bool>, RenderError> {
        if self.glances == 0 || self.settings.samples < FEWEST_SAMPLES {
            return Ok(Vec::new());
        }
        self.beforehand(|renderer| {
            renderer.push.seed ^= SEED;
            renderer.reuse = ReuseTrial::Never;
            renderer.edges_of_lamps()
        })
    }

    /// Pixels near the edges of bright lamps.
    fn edges_of_lamps(&mut self) -> Result<Vec<bool>, RenderError> {
        self.fill_film(|_| FilmSlot::beginning(glance::GLANCING | (FIRST_GLANCES - 1)))?;
        let mean = |sum: &[f64; 3]| sum.map(|x| x * f64::from(glance::GLANCES / FIRST_GLANCES));
        let seen: Vec<_> = self.film_of_one_sample()?.sums().iter().map(mean).collect();
        if seen.iter().all(|x| *x == seen[0]) {
            return Ok(vec![false; seen.len()]);
        }
        self.clear_film()?;
        for span in self.whole_film() {
            let work = Work { spans: vec![span], tile_step: REST_STEP, target_samples: 1, new_samples: 1 };
            let (ticket, readback) = self.submit(&work)?;
            self.finish(&ticket, readback)?;
        }
        let film = self.read_film()?;
        let samples = film.sums().iter().zip(film.counts()).zip(&seen);
        let unlit = samples.filter(|((_, count), seen)| **count > 0 && **seen == [0.0; 3]);
        let (sum, count) = unlit.fold((0.0, 0), |(sum, n), ((x, _), _)| (sum + brightness(x), n + 1));
        let rest = if count > 0 { sum / f64::from(count) } else { 0.0 };
        Ok(near_edges(&seen, self.width as usize, CONTRAST * rest))
    }
}

fn brightness(color: &[f64; 3]) -> f64 {
    color.iter().sum()
}

/// Pixels that differ from one of their neighbours by more than that, those across a corner included.
fn near_edges(seen: &[[f64; 3]], width: usize, by: f64) -> Vec<bool> {
    let height = seen.len() / width;
    let around = |i: usize, end: usize| i.saturating_sub(1)..(i + 2).min(end);
    let differs = |p: usize| {
        let (x, y) = (p % width, p / width);
        let neighbours = around(y, height).flat_map(|y| around(x, width).map(move |x| y * width + x));
        neighbours.map(|q| brightness(&seen[q]) - brightness(&seen[p])).any(|difference| difference.abs() > by)
    };
    (0..seen.len()).into_par_iter().map(differs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_beside_an_edge_are_found() {
        let found = |seen: &[[f64; 3]], by| -> Vec<usize> {
            near_edges(seen, 7, by).iter().enumerate().filter(|(_, near)| **near).map(|n| n.0).collect()
        };
        let mut seen = vec![[0.5; 3]; 35];
        assert!(found(&seen, 0.0).is_empty());
        seen[2 * 7 + 3] = [2.5, 0.5, 0.5];
        assert_eq!(found(&seen, 1.9), [9, 10, 11, 16, 17, 18, 23, 24, 25]);
        assert!(found(&seen, 2.1).is_empty());
        // In a corner.
        seen[17] = [0.5; 3];
        seen[34] = [0.0; 3];
        assert_eq!(found(&seen, 1.0), [26, 27, 33, 34]);
        assert_eq!(near_edges(&[[3.0; 3]], 1, 0.0), [false]);
    }
}
