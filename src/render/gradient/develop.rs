//! Images from their gradients, where paths serve several pixels (shaders/lib/gradient.glsl).

use bytemuck::zeroed_vec;
use glam::Vec4;
use rayon::prelude::*;

use crate::render::film::Film;
use crate::render::film::tiling::to_pixels;
use crate::render::gradient::phases::Phases;
use crate::render::gradient::screened_poisson::{Observation, System};
use crate::render::gradient::surfaces::{DiffusePlaces, Side};
use crate::render::gradient::weights::ClassWeights;
use crate::render::kernel::layout::GradientSlot;
use crate::render::sampling::sample_map::SampleMap;

/// What is decided about gradients before a rendering.
#[derive(Debug, Clone)]
pub(crate) struct GradientPlan {
    /// Where groups of pixels are.
    pub phases: Phases,
    /// What pixels show.
    pub places: DiffusePlaces,
    /// How certain differences between pixels are, by their class.
    pub weights: ClassWeights,
    /// Rows of pixels in a band of the film, within which groups are shifted.
    pub band_rows: usize,
}

/// What slots of gradients say of the pixels of an image, row by row: the sum of the light of the samples that were recorded, and the sums of
/// its differences from that on the right and below. (What else is there means nothing.)
#[derive(Debug, Clone)]
pub(crate) struct GradientSums {
    width: u32,
    pixels: Vec<[Vec4; 3]>,
}

impl GradientSums {
    /// Of an image of such a size, without samples.
    pub fn new([width, height]: [u32; 2]) -> Self {
        // Memory that the system hands out when it is written, by many threads.
        Self { width, pixels: zeroed_vec(width as usize * height as usize) }
    }

    /// Takes over slots, the first of which is slot `first`.
    pub fn read_slots(&mut self, first: u32, slots: &[GradientSlot]) {
        to_pixels(first, slots, &mut self.pixels, self.width, |pixel, slot| *pixel = bytemuck::cast(*slot));
    }
}

/// Makes use of the gradients of a film whose pixels have as many samples as the map says. Returns whether there are any of shifted groups.
pub(crate) fn use_gradients(film: &mut Film, sums: GradientSums, plan: &GradientPlan, map: &SampleMap) -> bool {
    let mut pixels = sums.pixels;
    let counted = pixels.par_iter_mut().zip(film.counts()).enumerate();
    let phases = counted.map(|(pixel, ([light, ..], &count))| {
        let recorded = plan.phases.recorded(count, map.of_pixel(pixel));
        *light /= recorded_count(recorded);
        recorded
    });
    let phases = phases.collect();
    let GradientPlan { places, weights, band_rows, .. } = plan;
    let recorded = Recorded { pixels, phases, places, weights: *weights, band_rows: *band_rows };
    let system = recorded.system();
    let Recorded { mut pixels, phases, .. } = recorded;
    let corrections = system.solve(&mut pixels);
    let share = |p: usize, count: u32| phases[p].iter().sum::<u32>() as f32 / count.max(1) as f32;
    film.add(|p, count| finite(share(p, count) * corrections[p]));
    phases.iter().any(|[_, shifted]| *shifted > 0)
}

/// A colour, or none if it is too large for a number.
fn finite(c: Vec4) -> [f32; 3] {
    if c.is_finite() { c.truncate().to_array() } else { [0.0; 3] }
}

/// What is known of the pixels of an image, row by row.
struct Recorded<'a> {
    /// The mean of the light of the samples that were recorded, and the sums of its differences from that on the right and below. (What
    /// else is there means nothing.)
    pixels: Vec<[Vec4; 3]>,
    /// Samples that were recorded, with groups as they are and shifted.
    phases: Vec<[u32; 2]>,
    places: &'a DiffusePlaces,
    weights: ClassWeights,
    /// Rows of pixels in a band of the film, within which groups are shifted.
    band_rows: usize,
}

/// Samples that were recorded of a pixel, or 1 if there are none.
fn recorded_count(phases: [u32; 2]) -> f32 {
    phases.iter().sum::<u32>().max(1) as f32
}

impl Recorded<'_> {
    /// The neighbour on a side of the pixel in column x and row y, if both can be of one group.
    fn neighbour(&self, [x, y]: [usize; 2], side: Side) -> Option<usize> {
        let width = self.places.width;
        match side {
            Side::Right => (x + 1 < width).then_some(y * width + x + 1),
            Side::Down => {
                let below = (y + 1) * width + x;
                (below < self.pixels.len() && !(y + 1).is_multiple_of(self.band_rows)).then_some(below)
            }
        }
    }

    /// Samples in which the pixel in column x and row y and its neighbour on a side were of one group: 4×2 pixels, shifted by 2 and 1.
    fn shared(&self, [x, y]: [usize; 2], side: Side) -> u32 {
        let [a, b] = self.phases[y * self.places.width + x];
        let (plain, shifted) = match side {
            Side::Right => (x % 4 != 3, x % 4 != 1),
            Side::Down => (y % 2 == 0, y % 2 == 1),
        };
        u32::from(plain) * a + u32::from(shifted) * b
    }

    /// Whose solution is to be added to the mean of each pixel, over those samples that were recorded.
    fn system(&self) -> System {
        let pair = |at: [usize; 2], p: usize, side: Side| {
            let samples = self.shared(at, side);
            let q = self.neighbour(at, side).filter(|_| samples > 0)?;
            let weight = self.weights[self.places.class_of_pair(p, q, side)?];
            let [light, right, down] = self.pixels[p];
            let difference = if side == Side::Right { right } else { down };
            let residual = (difference - samples as f32 * (light - self.pixels[q][0])).truncate();
            let pair = (weight * samples as f32, (weight * residual).extend(0.0));
            Some(pair).filter(|(_, residual)| residual.is_finite())
        };
        let width = self.places.width;
        System::of([width, self.pixels.len() / width], |[x, y]| {
            let p = y * width + x;
            let [(right, residual_right), (down, residual_down)] =
                [Side::Right, Side::Down].map(|side| pair([x, y], p, side).unwrap_or_default());
            Observation { weight: recorded_count(self.phases[p]), right, down, residual_right, residual_down }
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::render::gradient::surfaces::CLASSES;

    /// A plane of 8×8 pixels, seen so that its differences are exact: what only one group has too much of is spread.
    #[test]
    fn noise_of_a_group_is_spread_over_alike_neighbours() {
        let (width, samples) = (8, 4);
        let mut slots = vec![[Vec4::ZERO; 3]; 64];
        for (p, [light, ..]) in slots.iter_mut().enumerate() {
            // Half of the samples are of one group with what is right of it, half of another.
            let too_much = if p % 8 < 4 && p / 8 < 2 { 1.0 } else { 0.0 };
            *light = Vec4::splat(2.0 + too_much / samples as f32);
        }
        let all: Vec<_> = (0..64).map(|p| Vec3::new((p % 8) as f32, (p / 8) as f32, 1.0)).collect();
        let places = DiffusePlaces::new(width, all.clone());
        let phases = vec![Phases::new(samples, false).samples(samples); 64];
        let corrections = |places: &DiffusePlaces, band_rows: usize| {
            let (phases, weights) = (phases.clone(), [30.0; CLASSES]);
            let mut recorded = Recorded { pixels: slots.clone(), phases, places, weights, band_rows };
            recorded.system().solve(&mut recorded.pixels).to_vec()
        };
        let found = corrections(&places, 64);
        let total: f32 = found.iter().map(|c| c.x).sum();
        // But for the last steps of the iteration.
        assert!(total.abs() < 0.02, "{total}");
        assert!(found[0].x < -0.1 && found[63].x > 0.0, "{} and {}", found[0].x, found[63].x);
        // Nothing is spread to where there is no surface.
        let apart = all.into_iter().map(|place| if place.x >= 4.0 { Vec3::ZERO } else { place }).collect();
        let found = corrections(&DiffusePlaces::new(width, apart), 64);
        assert!(found.iter().enumerate().all(|(p, c)| p % 8 < 4 || *c == Vec4::ZERO));
        // Nor from one band to the next, where shifted groups are others.
        let found = corrections(&places, 2);
        assert!(found.iter().enumerate().all(|(p, c)| p / 8 < 2 || *c == Vec4::ZERO));
    }
}
