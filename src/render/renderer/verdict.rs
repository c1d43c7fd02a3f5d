//! What a trial shows: whether it pays to reuse paths, and to make images from gradients.

use std::ops::Add;

use rayon::prelude::*;

use super::super::film::MEMBERS;
use super::super::settings::Reuse;
use super::super::tiles::{TILE, half_of};
use super::tried::{Noise, TriedGroup};

/// The greatest part of variance that may be of light which is not shared for gradients to pay: they lower the rest only, and
/// with them random numbers are stratified over fewer samples. With .37 to .52 they take .67 to .95 times as long to the same
/// error, with .60 .98 to 1.03 (balls and meshes, some of mirror or glass, in a room, terrain; 4 to 64 samples, lavapipe 25.0.7).
const MOST_OWN: f64 = 0.58;
/// The same where sampling is adaptive: with gradients all pixels get as many samples.
const MOST_OWN_ADAPTIVE: f64 = 0.35;
/// The greatest part of variance that gradients may leave, as far as the trial tells, to pay: with .72 of it images from gradients
/// take 1.13 (4 samples per pixel) to 1.01 (16) times as long to the same error, with .86 1.08 to .98, with .93 1.12 to 1.07, with
/// .96 1.20 to 1.11 (terrains of 2 thousand to 1.3 million triangles, 25.0.7); the balls and meshes in rooms above have .04 to .57.
const MOST_LEFT: f64 = 0.8;
/// The same where all pixels of a group sample lights alike: the noise of these is spread too, which the trial cannot tell. With .96
/// and .93 images from gradients take 1.41 and 1.28 times as long to the same error at 4 samples, 1.22 and 1.11 at 16, with .895 1.29
/// and 1.10 (height fields under lamps), with .86 .97 and .85 (an armadillo), with .81 .76 and .73 (a dragon in a room), with .70 to .72
/// .97 to .51 (a dragon on a plane, an armadillo in a room).
const MOST_LEFT_ALIKE: f64 = 0.87;
/// The same where rays are aimed at glass and mirrors if images are made from gradients, which takes 1.2 to 1.4 times the time. With .79 of
/// it gradients and aimed rays together take 1.1 times as long to the same error as neither (balls of mirror and glass), with .74 and .76
/// .9 to 1.0 (meshes of them), with .10 to .58 .24 to .7 (balls, a mesh and a ball).
const MOST_LEFT_AIMED: f64 = 0.77;

/// Groups that are judged together.
const GROUPS_TOGETHER: usize = 256;

/// The trial of a rendering and what came of it, apart for the two halves of the image that adaptive sampling keeps
/// independent of each other.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum ReuseTrial {
    /// No paths are reused.
    Never,
    /// All are, whatever it gains.
    Always,
    /// It has not been made.
    #[default]
    Pending,
    /// What it shows of each half.
    Over([Tally; 2]),
}

/// Variance in the trial, of all pixels together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Tally {
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

/// The part of variance that gradients may leave, as far as the trial tells, where all pixels of a group sample lights alike, and where
/// rays are aimed as well.
pub(super) fn most_left(lights_alike: bool, aims: bool) -> f64 {
    match (aims, lights_alike) {
        (true, _) => MOST_LEFT_AIMED,
        (false, true) => MOST_LEFT_ALIKE,
        (false, false) => MOST_LEFT,
    }
}

impl ReuseTrial {
    /// Takes over further groups. They are judged in parallel, and added up in their order.
    pub fn judge(&mut self, groups: &[TriedGroup]) {
        let judged = |groups: &[TriedGroup]| {
            groups.iter().fold([Tally::default(); 2], |tallies, group| sum(tallies, judge(group)))
        };
        let parts: Vec<_> = groups.par_chunks(GROUPS_TOGETHER).map(judged).collect();
        let before = if let Self::Over(before) = *self { before } else { [Tally::default(); 2] };
        *self = Self::Over(parts.into_iter().fold(before, sum));
    }

    /// Before a rendering.
    pub fn of(reuse: Reuse) -> Self {
        match reuse {
            Reuse::Auto => Self::Pending,
            Reuse::Always => Self::Always,
            Reuse::Off => Self::Never,
        }
    }

    /// With what came of it for both halves together.
    pub fn together(self) -> Self {
        match self {
            Self::Over([a, b]) => Self::Over([a.and(b); 2]),
            same => same,
        }
    }

    /// A bit for each half, whether its paths serve several pixels: if variance falls by `worth` at least, and in the
    /// trial.
    pub fn halves(self, worth: f64) -> u32 {
        match self {
            Self::Never => 0,
            Self::Pending | Self::Always => 0b11,
            // Samples that were not finite leave a NaN, which is not worth anything.
            Self::Over(halves) => (0..2).map(|h| u32::from(halves[h].with * worth < halves[h].without) << h).sum(),
        }
    }

    /// Variance without reuse over that with it, in both halves together.
    pub fn gain(self) -> Option<f64> {
        match self {
            Self::Over([a, b]) => Some(a.and(b)).map(|sum| sum.without / sum.with).filter(|gain| gain.is_finite()),
            _ => None,
        }
    }

    /// Whether enough noise is that of light which is shared for gradients to pay, and they leave so little of it.
    pub fn suits_gradients(self, adaptive: bool, most_left: f64) -> bool {
        let most_own = if adaptive { MOST_OWN_ADAPTIVE } else { MOST_OWN };
        let suits = |sum: Tally| sum.own < most_own * sum.with && sum.smoothed < most_left * sum.with;
        match self {
            Self::Over([a, b]) => suits(a.and(b)),
            _ => true,
        }
    }
}

/// What a group of pixels tells after the trial, apart for the two halves: how far the two samples of each are apart, and those of
/// what they gather.
///
/// What n pixels gather from the same second hits has the noise of one path divided by n in common. (That of lights which
/// all sample alike is not divided, but spread over many pixels by gradients, by which it falls at least as much.) What
/// each has besides shows in the differences between neighbours, to which two contribute. Pixels with glances are left
/// out: the noise of a lamp's edge falls faster with further samples.
fn judge(group: &TriedGroup) -> [Tally; 2] {
    let mut tallies = [Tally::default(); 2];
    let members = || (0..MEMBERS).filter(|member| group.film[*member].state == 0);
    let left = members().map(|member| group.noise(member)).fold(Noise::default(), Noise::add).left_by_gradients();
    for member in members() {
        let tally = &mut tallies[half_of(group.slot(member) as usize % TILE)];
        let noise = group.noise(member);
        *tally = tally.and(Tally {
            with: noise.reused(1.0),
            without: noise.alone(),
            smoothed: noise.reused(left),
            own: noise.own,
        });
    }
    tallies
}

fn sum(a: [Tally; 2], b: [Tally; 2]) -> [Tally; 2] {
    [a[0].and(b[0]), a[1].and(b[1])]
}

#[cfg(test)]
mod tests {
    use super::super::super::layout::{FilmSlot, GradientSlot};
    use super::*;

    /// Slots of pixels with so much noise of their own, in what they gather without each other, and in the differences.
    fn groups(own: f32, light: f32, difference: f32) -> Vec<TriedGroup> {
        let film = FilmSlot { trial: own, ..FilmSlot::default() };
        let gradients = GradientSlot { trial_light: light, trial_down: difference, ..GradientSlot::default() };
        let group = |first_slot| TriedGroup { first_slot, film: [film; MEMBERS], gradients: [gradients; MEMBERS] };
        (0..16).map(group).collect()
    }

    #[test]
    fn what_lowers_variance_enough_is_reused() {
        let judge = |groups: &[TriedGroup]| {
            let mut trial = ReuseTrial::Pending;
            trial.judge(groups);
            trial
        };
        assert_eq!(judge(&groups(0.0, 1.0, 0.0)).halves(1.4), 0b11);
        assert_eq!(judge(&groups(0.0, -1.0, 0.0)).gain(), Some(8.0));
        // 0.25 of their own, 1 to gather, of which an eighth is common, and 0.25 in the differences.
        let gain = judge(&groups(0.5, 1.0, 0.5)).gain().unwrap();
        assert!((gain - 1.25 / (0.25 + 0.125 + 0.1)).abs() < 1e-9, "{gain}");
        assert_eq!(judge(&groups(3.0, 1.0, 0.0)).halves(1.4), 0);
        assert_eq!(judge(&groups(0.0, 0.0, 0.0)).halves(1.4), 0);
        assert_eq!(judge(&groups(0.0, 0.0, 0.0)).gain(), None);
        assert_eq!(judge(&groups(f32::NAN, 1.0, 0.0)).halves(1.4), 0);
        let suits =
            |own| [true, false].map(|adaptive| judge(&groups(own, 1.0, 0.0)).suits_gradients(adaptive, MOST_LEFT));
        assert_eq!([0.2, 0.3, 0.5].map(suits), [[true, true], [false, true], [false, false]]);
        let suits = |difference| {
            [most_left(true, false), most_left(false, false), most_left(true, true)]
                .map(|most| judge(&groups(0.1, 1.0, difference)).suits_gradients(false, most))
        };
        assert_eq!([0.2, 0.45, 0.8].map(suits), [[true; 3], [true, false, false], [false; 3]]);
        assert!(ReuseTrial::Always.suits_gradients(true, MOST_LEFT));
        assert!(!judge(&groups(0.0, 0.0, 0.0)).suits_gradients(false, MOST_LEFT));
        let mut mixed = groups(2.0, 1.0, 0.0);
        let second = mixed.iter_mut().filter(|group| half_of(group.first_slot as usize) == 1);
        second.for_each(|group| group.gradients.iter_mut().for_each(|slot| slot.trial_light = 3.0));
        assert_eq!(judge(&mixed).halves(1.4), 0b10);
    }
}
