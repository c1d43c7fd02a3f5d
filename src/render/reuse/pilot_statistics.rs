//! What the pilot pass tells of a group of pixels (shaders/lib/gradient.glsl).

use std::ops::Add;

use crate::render::film::tiling::{MEMBERS, TILE, TILE_GROUPS, pixel_of_slot};
use crate::render::gradient::surfaces::Side;
use crate::render::kernel::layout::{FilmSlot, GradientSlot};

/// Neighbours on the right and below that a pixel has in its group, in the mean.
const PAIRS: f64 = 1.25;
/// How much of the noise that a group has in common is spread over other groups where differences between neighbours have little
/// noise.
const SPREAD: f64 = 0.2;

/// A group of pixels after the pilot pass.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PilotGroup {
    /// The slot of its first member; the others follow at distances of eight.
    pub first_slot: u32,
    pub film: [FilmSlot; MEMBERS],
    pub gradients: [GradientSlot; MEMBERS],
    /// Those that are outside the image, or get more samples for what they see.
    pub left_out: [bool; MEMBERS],
}

/// What the samples of a pixel have of variance, as far as two of them can tell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Noise {
    /// Of light that is not shared.
    pub own: f64,
    /// Of the other light, without reuse.
    pub light: f64,
    /// Half of that of its differences from a neighbour.
    pub differences: f64,
}

impl Noise {
    /// The variance without reuse.
    pub fn alone(&self) -> f64 {
        self.own + self.light
    }

    /// The same with reuse, if `left` is left of what a group has in common.
    pub fn reused(&self, left: f64) -> f64 {
        self.own + self.light / MEMBERS as f64 * left + self.differences
    }

    /// The part of what a group has in common that differences between neighbours leave, this being what its pixels have together.
    pub fn left_by_gradients(&self) -> f64 {
        let light = self.light / MEMBERS as f64;
        let left = self.differences / (self.differences + SPREAD * light);
        // Where there is no noise at all, or no finite one, nothing is known to be gained.
        if left.is_nan() { 1.0 } else { left }
    }
}

impl Add for Noise {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            own: self.own + other.own,
            light: self.light + other.light,
            differences: self.differences + other.differences,
        }
    }
}

impl PilotGroup {
    /// That it is in.
    pub fn tile(&self) -> u32 {
        self.first_slot / TILE as u32
    }

    /// The slot of a member.
    pub fn slot(&self, member: usize) -> u32 {
        self.first_slot + member as u32 * TILE_GROUPS
    }

    /// What a member's samples have of variance.
    pub fn noise(&self, member: usize) -> Noise {
        let square = |x: f32| f64::from(x).powi(2);
        let gradient = &self.gradients[member];
        Noise {
            own: square(self.film[member].pilot),
            light: square(gradient.pilot_light),
            differences: (square(gradient.pilot_right) + square(gradient.pilot_down)) / (2.0 * PAIRS),
        }
    }

    /// The neighbours in it, in an image of such a size. Samples that were not finite tell nothing.
    pub fn pairs(&self, [width, height]: [u32; 2]) -> impl Iterator<Item = PilotPair> {
        let square = |x: f32| f64::from(x).powi(2);
        let of_member = move |member: usize| {
            let slot = &self.gradients[member];
            // The neighbours on the right and below are the next member of the group, and the fourth.
            let right = (member % 4 < 3).then_some((Side::Right, member + 1, slot.pilot_right));
            let down = (member < 4).then_some((Side::Down, member + 4, slot.pilot_down));
            let pixel = pixel_of_slot(self.slot(member), width, height);
            right.into_iter().chain(down).filter_map(move |(side, neighbour, difference)| {
                let values = (square(slot.pilot_light) + square(self.gradients[neighbour].pilot_light)) / 2.0;
                let difference = square(difference);
                let finite = values.is_finite() && difference.is_finite();
                pixel.filter(|_| finite).map(|pixel| PilotPair { pixel, side, values, difference })
            })
        };
        (0..MEMBERS).flat_map(of_member)
    }

    /// What samples are allocated by.
    pub fn noise_of_pixels(&self) -> GroupNoise {
        let members = || (0..MEMBERS).filter(|member| !self.left_out[*member]);
        let pixels = members().count();
        let noise = members().map(|member| self.noise(member)).fold(Noise::default(), Noise::add);
        let cost = self.film.iter().map(|slot| f64::from(slot.sum[0].to_bits())).sum();
        GroupNoise { tile: self.tile(), pixels: pixels as u32, noise, cost }
    }
}

/// What two neighbours of a group show after the pilot pass.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PilotPair {
    pub pixel: usize,
    /// Where its neighbour is.
    pub side: Side,
    /// Squares: of their values, in the mean, and of the difference.
    pub values: f64,
    pub difference: f64,
}

/// What the samples of a group's pixels have of variance, and what they cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GroupNoise {
    /// That it is in.
    pub tile: u32,
    /// Those that are not left out.
    pixels: u32,
    /// Of all together.
    noise: Noise,
    /// What its slots were told of the cost of samples: of a set of tiles all together, that of these.
    pub cost: f64,
}

impl GroupNoise {
    /// The variance that a sample of its pixels leaves in an image for which paths are `reused` and, if `gradients`,
    /// differences between neighbours made use of, in the mean; `None` without pixels.
    pub fn variance(&self, reused: bool, gradients: bool) -> Option<f64> {
        let noise = &self.noise;
        let variance = match (reused, gradients) {
            (true, true) => noise.reused(noise.left_by_gradients()),
            (true, false) => noise.reused(1.0),
            (false, _) => noise.alone(),
        };
        // Samples that were not finite tell nothing.
        let known = if variance.is_finite() { variance } else { 0.0 };
        (self.pixels > 0).then(|| known / f64::from(self.pixels))
    }
}
