//! What a pilot pass shows: whether it pays to reuse paths, and to make images from gradients.

use std::ops::Add;

use rayon::prelude::*;

use crate::render::film::tiling::MEMBERS;
use crate::render::reuse::pilot_statistics::{Noise, PilotGroup};
use crate::render::settings::Reuse;

/// The greatest part of variance that may be of light which is not shared for gradients to pay: they lower the rest only, and
/// with them random numbers are stratified over fewer samples. With .37 to .52 they take .67 to .95 times as long to the same
/// error, with .60 .98 to 1.03 (balls and meshes, some of mirror or glass, in a room, terrain; 4 to 64 samples, lavapipe 25.0.7).
const MOST_OWN: f64 = 0.58;
/// The greatest part of variance that gradients may leave, as far as the pilot pass tells, to pay: with .72 of it images from gradients
/// take 1.13 (4 samples per pixel) to 1.01 (16) times as long to the same error, with .86 1.08 to .98, with .93 1.12 to 1.07, with
/// .96 1.20 to 1.11 (terrains of 2 thousand to 1.3 million triangles, 25.0.7); the balls and meshes in rooms above have .04 to .57.
const MOST_LEFT: f64 = 0.8;
/// The same where all pixels of a group sample lights alike: the noise of these is spread too, which the pilot pass cannot tell. With .96
/// and .93 images from gradients take 1.41 and 1.28 times as long to the same error at 4 samples, 1.22 and 1.11 at 16, with .895 1.29
/// and 1.10 (height fields under emitters), with .86 .97 and .85 (an armadillo), with .81 .76 and .73 (a dragon in a room), with .70 to .72
/// .97 to .51 (a dragon on a plane, an armadillo in a room).
const MOST_LEFT_CORRELATED: f64 = 0.87;
/// Groups that are judged together.
const GROUPS_TOGETHER: usize = 256;

/// The pilot pass of a rendering and what came of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum ReuseDecision {
    /// No paths are reused.
    Never,
    /// All are, whatever it gains.
    Always,
    /// It has not been made.
    #[default]
    Pending,
    /// What it shows.
    Over(Tally),
}

/// Variance in the pilot pass, of all pixels together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Tally {
    /// With reuse, and without.
    with: f64,
    without: f64,
    /// With reuse and gradients.
    smoothed: f64,
    /// The part of each that light has which is not shared.
    own: f64,
}

impl Tally {
    fn and(self, other: Self) -> Self {
        Self {
            with: self.with + other.with,
            without: self.without + other.without,
            smoothed: self.smoothed + other.smoothed,
            own: self.own + other.own,
        }
    }
}

/// The part of variance that gradients may leave, as far as the pilot pass tells, where all pixels of a group sample lights alike, and elsewhere.
pub(crate) fn most_left(lights_correlated: bool) -> f64 {
    if lights_correlated { MOST_LEFT_CORRELATED } else { MOST_LEFT }
}

impl ReuseDecision {
    /// Takes over further groups. They are judged in parallel, and added up in their order.
    pub fn judge(&mut self, groups: &[PilotGroup]) {
        let judged = |groups: &[PilotGroup]| groups.iter().map(judge).fold(Tally::default(), Tally::and);
        let parts: Vec<_> = groups.par_chunks(GROUPS_TOGETHER).map(judged).collect();
        let before = if let Self::Over(before) = *self { before } else { Tally::default() };
        *self = Self::Over(parts.into_iter().fold(before, Tally::and));
    }

    /// Before a rendering.
    pub fn from_mode(reuse: Reuse) -> Self {
        match reuse {
            Reuse::Auto => Self::Pending,
            Reuse::Always => Self::Always,
            Reuse::Off => Self::Never,
        }
    }

    /// Whether paths serve several pixels: if variance falls by `worth` at least, and in the pilot pass.
    pub fn pays(self, worth: f64) -> bool {
        match self {
            Self::Never => false,
            Self::Pending | Self::Always => true,
            // Samples that were not finite leave a NaN, which is not worth anything.
            Self::Over(tally) => tally.with * worth < tally.without,
        }
    }

    /// Variance without reuse over that with it.
    pub fn gain(self) -> Option<f64> {
        match self {
            Self::Over(tally) => Some(tally.without / tally.with).filter(|gain| gain.is_finite()),
            _ => None,
        }
    }

    /// Whether enough noise is that of light which is shared for gradients to pay, and they leave so little of it.
    pub fn suits_gradients(self, most_left: f64) -> bool {
        match self {
            Self::Over(tally) => tally.own < MOST_OWN * tally.with && tally.smoothed < most_left * tally.with,
            _ => true,
        }
    }
}

/// What a group of pixels tells after the pilot pass: how far the two samples of each are apart, and those of what they gather.
///
/// What n pixels gather from the same second hits has the noise of one path divided by n in common. (That of lights which
/// all sample alike is not divided, but spread over many pixels by gradients, by which it falls at least as much.) What
/// each has besides shows in the differences between neighbours, to which two contribute. Pixels that get more samples for
/// what they see are left out: the noise of an emitter's edge falls faster with further samples.
fn judge(group: &PilotGroup) -> Tally {
    let members = || (0..MEMBERS).filter(|member| !group.left_out[*member]);
    let left = members().map(|member| group.noise(member)).fold(Noise::default(), Noise::add).left_by_gradients();
    members().fold(Tally::default(), |tally, member| {
        let noise = group.noise(member);
        let (with, smoothed) = (noise.reused(1.0), noise.reused(left));
        tally.and(Tally { with, without: noise.alone(), smoothed, own: noise.own })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::kernel::layout::{FilmSlot, GradientSlot};

    /// Slots of pixels with so much noise of their own, in what they gather without each other, and in the differences.
    fn groups(own: f32, light: f32, difference: f32) -> Vec<PilotGroup> {
        let film = FilmSlot { pilot: own, ..FilmSlot::default() };
        let gradients = GradientSlot { pilot_light: light, pilot_down: difference, ..GradientSlot::default() };
        let group = |first_slot| PilotGroup {
            first_slot,
            film: [film; MEMBERS],
            gradients: [gradients; MEMBERS],
            left_out: [false; MEMBERS],
        };
        (0..16).map(group).collect()
    }

    #[test]
    fn what_lowers_variance_enough_is_reused() {
        let judge = |groups: &[PilotGroup]| {
            let mut pilot = ReuseDecision::Pending;
            pilot.judge(groups);
            pilot
        };
        assert!(judge(&groups(0.0, 1.0, 0.0)).pays(1.4));
        assert_eq!(judge(&groups(0.0, -1.0, 0.0)).gain(), Some(8.0));
        // 0.25 of their own, 1 to gather, of which an eighth is common, and 0.25 in the differences.
        let gain = judge(&groups(0.5, 1.0, 0.5)).gain().unwrap();
        assert!((gain - 1.25 / (0.25 + 0.125 + 0.1)).abs() < 1e-9, "{gain}");
        assert!(!judge(&groups(3.0, 1.0, 0.0)).pays(1.4));
        assert!(!judge(&groups(0.0, 0.0, 0.0)).pays(1.4));
        assert_eq!(judge(&groups(0.0, 0.0, 0.0)).gain(), None);
        assert!(!judge(&groups(f32::NAN, 1.0, 0.0)).pays(1.4));
        let suits = |own| judge(&groups(own, 1.0, 0.0)).suits_gradients(MOST_LEFT);
        assert_eq!([0.2, 0.3, 0.5].map(suits), [true, true, false]);
        let suits = |difference| {
            [true, false].map(most_left).map(|most| judge(&groups(0.1, 1.0, difference)).suits_gradients(most))
        };
        assert_eq!([0.2, 0.45, 0.8].map(suits), [[true; 2], [true, false], [false; 2]]);
        assert!(ReuseDecision::Always.suits_gradients(MOST_LEFT));
        assert!(!judge(&groups(0.0, 0.0, 0.0)).suits_gradients(MOST_LEFT));
    }
}
