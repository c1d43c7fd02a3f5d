//! Whether it pays to let paths serve several pixels: decided from a trial (shaders/lib/reuse.glsl).

use std::mem::take;
use std::ops::{Add, Range};

use rayon::prelude::*;

use super::super::driver::{DriverFacts, Sharers};
use super::super::error::RenderError;
use super::super::features::Features;
use super::super::film::pixel_of_slot;
use super::super::layout::{mode, queue};
use super::super::plan::{Span, Work};
use super::super::settings::{RenderSettings, Reuse};
use super::super::sobol::MEMBERS;
use super::super::tiles::{TILE, half_of};
use super::Renderer;
use super::gradients::PairSums;
use super::tried::{GroupNoise, Noise, TriedGroup};

/// Whether paths may serve several pixels, in a scene that needs these features, on such a device. It depends on neither
/// scheduler nor on what else is compiled, so that the image does not.
///
/// With a tree and lamps together with glass or mirrors it hardly pays: the noise of caustics is left, and a trial that is lost
/// makes the rest slower (by 1.3). Nor where glass fills the picture (by 1.1 to 1.2, on GPUs by 4). (Where beams take most of that noise paths cannot be shared, see `beams::targets`.) Without
/// a tree rays are cheap, and lanes wait for each other instead, which does not pay where a driver executes the branches that
/// no lane takes (twice the time of one that skips them). Brute force is for comparison, not for speed.
///
/// On GPUs the host's part of it takes time: for each pixel what 100 to 600 samples take without a tree, and 30 to 100 with one.
/// Threads that choose among lights and walk a tree hold too much: with lamps a sample takes 7 to 20 times the time (H100).
pub(super) fn may_reuse(needed: &Features, settings: &RenderSettings, facts: &DriverFacts) -> bool {
    needed.can_reuse()
        && !needed.brute_force
        && match (settings.reuse, facts.reuse) {
            (Reuse::Off, _) | (Reuse::Auto, Sharers::None) => false,
            (Reuse::Always, _) => true,
            (Reuse::Auto, Sharers::Lanes) if needed.tree => !needed.reuse_is_unlikely_to_pay(),
            (Reuse::Auto, Sharers::Lanes) => facts.skips_branches,
            // Who waits for a time or a noise gets samples at once.
            (Reuse::Auto, Sharers::Threads) => {
                settings.samples >= fewest_samples(needed, settings.reuse, facts)
                    && !needed.reuse_is_unlikely_to_pay()
                    && (settings.adaptive.is_none() && settings.time_limit.is_none())
                    && !(needed.tree && needed.emitter)
            }
        }
}

/// Samples per pixel that a rendering has at least for it to be tried.
pub(super) fn fewest_samples(needed: &Features, reuse: Reuse, facts: &DriverFacts) -> u32 {
    match (reuse, facts.reuse) {
        (Reuse::Auto, Sharers::Threads) if needed.tree => 64,
        (Reuse::Auto, Sharers::Threads) => 512,
        _ => 0,
    }
}

/// By how much variance must fall in the trial for reuse to pay. With a tree a sample takes 1.4 to 2.3 times the time
/// (measured on lavapipe, scenes with meshes of 35 thousand to a million triangles); the least of these, since the noise that
/// reuse does not lower, of edges and of lamps, falls faster with further samples. Without a tree it takes 1.9 to 2.1 times the
/// time, but the kernel that could reuse paths and does not takes 1.2 times that of one that could not.
///
/// On GPUs a sample takes 2.4 to 4 times the time; a room of balls, one of glass, gains 3, one of diffuse balls and a mirror 4.1 to 8.
pub(super) fn worth(needed: &Features, facts: &DriverFacts) -> f64 {
    match facts.reuse {
        Sharers::Threads => 4.0,
        _ if needed.tree => 1.4,
        _ => 1.8,
    }
}

/// The greatest part of variance that may be of light which is not shared for gradients to pay: they lower the rest only, and
/// with them random numbers are stratified over fewer samples. With .37 to .52 they take .67 to .95 times as long to the same
/// error, with .60 .98 to 1.03 (balls and meshes, some of mirror or glass, in a room, terrain; 4 to 64 samples, lavapipe 25.0.7
/// and 22.3.6).
const MOST_OWN: f64 = 0.58;
/// The same where sampling is adaptive: with gradients all pixels get as many samples.
const MOST_OWN_ADAPTIVE: f64 = 0.35;
/// The greatest part of variance that gradients may leave, as far as the trial tells, to pay: with .72 of it images from gradients
/// take 1.13 (4 samples per pixel) to 1.01 (16) times as long to the same error, with .86 1.08 to .98, with .93 1.12 to 1.07, with
/// .96 1.20 to 1.11 (terrains of 2 thousand to 1.3 million triangles, 25.0.7); the balls and meshes in rooms above have .04 to .57.
const MOST_LEFT: f64 = 0.8;
/// The same where all pixels of a group sample lights alike: the noise of these is spread too, which the trial cannot tell. With .96
/// and .93 images from gradients take 1.41 and 1.28 times as long to the same error at 4 samples, 1.22 and 1.11 at 16 (height fields
/// under lamps), with .86 .97 and .85 (an armadillo), with .70 to .72 .97 to .51 (a dragon on a plane, an armadillo in a room).
const MOST_LEFT_ALIKE: f64 = 0.9;

/// Groups that are judged together.
pub(super) const GROUPS_TOGETHER: usize = 256;

/// What the seed is changed by (XOR) in the trial.
const SEED: u32 = 0x3707_3443;
/// Tiles of which one takes part in the trial, made of a group of each.
pub(super) const SET: u32 = queue::SCATTERED_TILES;
/// Slots of these.
pub(super) const SET_SLOTS: u32 = TILE as u32 * SET;
/// Slots whose trial is one dispatch: 131,072 samples.
const DISPATCH_SLOTS: u32 = 1024 * SET_SLOTS;

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

/// What came of a trial.
#[derive(Default)]
pub(super) struct Tried {
    pub reuse: ReuseTrial,
    /// Of pairs of neighbours.
    pub pairs: PairSums,
    /// Of each group, in the order of their slots.
    pub groups: Vec<GroupNoise>,
    /// Some samples were taken again: what they cost is not known.
    pub repeated: bool,
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

impl ReuseTrial {
    /// Takes over further groups. They are judged in parallel, and added up in their order.
    fn judge(&mut self, groups: &[TriedGroup]) {
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

    /// Whether enough noise is that of light which is shared for gradients to pay, and they lower it by enough, which is harder to tell
    /// if lights are sampled alike by all pixels of a group.
    pub fn suits_gradients(self, adaptive: bool, lights_alike: bool) -> bool {
        let most_own = if adaptive { MOST_OWN_ADAPTIVE } else { MOST_OWN };
        let most_left = if lights_alike { MOST_LEFT_ALIKE } else { MOST_LEFT };
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

/// How many of the eight groups of each tile take part in the trial of a rendering of so many samples per pixel: it takes a
/// sixty-fourth of the time, if these are many.
fn turns(samples: u32) -> u32 {
    (samples / 16).clamp(1, MEMBERS as u32)
}

/// The first slots of the groups of a set of tiles that take part in such turns of the trial, tile by tile, as `slot_of_tile` of
/// shaders/lib/pixel_order.glsl has them.
fn groups_of_set(first_slot: u32, turns: Range<u32>) -> impl Iterator<Item = u32> {
    let group = |tile: u32, turn: u32| tile * TILE as u32 + (tile * 3 + turn) % MEMBERS as u32;
    (0..SET).flat_map(move |tile| turns.clone().map(move |turn| first_slot + group(tile, turn)))
}

impl Renderer {
    /// A bit for each half of the image, whether its paths serve several pixels; the same for both unless each decides how the
    /// other is sampled.
    pub(super) fn reused_halves(&self) -> u32 {
        let apart = self.settings.adaptive.is_some() && !self.makes_gradients();
        let trial = if apart { self.reuse } else { self.reuse.together() };
        trial.halves(self.reuse_is_worth)
    }

    /// Before a rendering, the film being empty: tries reuse in a few groups of every tile, with other random numbers, so that nothing
    /// that is decided depends on the image's.
    pub(super) fn try_reuse(&mut self) -> Result<(), RenderError> {
        let wanted = self.reuse == ReuseTrial::Pending || (self.reuse == ReuseTrial::Always && self.makes_gradients());
        if !wanted || self.settings.samples < queue::TRIAL {
            return Ok(());
        }
        let tried = self.beforehand(|renderer| {
            renderer.push.seed ^= SEED;
            renderer.push.modes |= mode::SCATTERED;
            renderer.samples_of_trial()
        })?;
        if self.reuse == ReuseTrial::Pending {
            self.reuse = tried.reuse;
        }
        log::debug!("reuse of paths: {:?}, halves {:02b}", self.reuse, self.reused_halves());
        if self.makes_gradients() {
            self.judge_gradients(&tried.pairs);
        }
        if self.may_share() {
            self.divide_samples(&tried);
        }
        self.empty_film()
    }

    /// How many of the eight groups of each tile take part: more than one only tell which tiles are to have more samples than
    /// others.
    fn turns(&self) -> u32 {
        if self.may_share() && self.settings.time_limit.is_none() { turns(self.settings.samples) } else { 1 }
    }

    fn samples_of_trial(&mut self) -> Result<Tried, RenderError> {
        let mut spans = Vec::new();
        for span in self.whole_film() {
            let first_slot = span.first_slot;
            debug_assert!(first_slot.is_multiple_of(SET_SLOTS), "a band begins within a set of tiles");
            spans.extend((first_slot..span.end_slot).step_by(DISPATCH_SLOTS as usize).map(|first_slot| {
                let end_slot = span.end_slot.min(first_slot + DISPATCH_SLOTS);
                Span { first_slot, end_slot, ..span }
            }));
        }
        let (turns, modes) = (self.turns(), self.push.modes);
        let mut end = self.statistics.samples;
        let mut tried = Tried::default();
        for (span, turn) in spans.iter().flat_map(|span| (0..turns).map(move |turn| (span, turn))) {
            self.push.modes = modes | turn << mode::TURN_SHIFT;
            end += self.pixels_of_trial(span, turn) * u64::from(queue::TRIAL);
            let work = Work {
                spans: vec![*span],
                tile_step: SET,
                target_samples: queue::TRIAL,
                // At once, however many the others are to be: what they cost is noted for a dispatch.
                new_samples: queue::TRIAL,
            };
            tried.repeated |= self.work_until(work, end)?;
        }
        for span in spans {
            let groups = self.groups_of_span(span, turns)?;
            tried.reuse.judge(&groups);
            if !self.places.is_empty() {
                self.compare_neighbours(&groups, &mut tried.pairs);
            }
            let inside = |slot| pixel_of_slot(slot, self.width, self.height).is_some();
            tried.groups.par_extend(groups.par_iter().map(|group| group.noise_of_pixels(inside)));
        }
        Ok(tried)
    }

    /// The groups of a span after the trial.
    fn groups_of_span(&mut self, span: Span, turns: u32) -> Result<Vec<TriedGroup>, RenderError> {
        let mut groups = Vec::new();
        self.read_slots(&[span], |first, slots| {
            groups.par_extend(groups_among(slots.len(), turns).into_par_iter().map(|group| TriedGroup {
                first_slot: first + group,
                film: members_of(slots, group),
                gradients: Default::default(),
            }));
        })?;
        let mut rest = &mut groups[..];
        self.read_gradients(&[span], |_, slots| {
            let among = groups_among(slots.len(), turns);
            let (these, after) = take(&mut rest).split_at_mut(among.len());
            let pairs = these.par_iter_mut().zip(among);
            pairs.for_each(|(tried, group)| tried.gradients = members_of(slots, group));
            rest = after;
        })?;
        Ok(groups)
    }

    /// Pixels of a span that take part in a turn of the trial.
    fn pixels_of_trial(&self, span: &Span, turn: u32) -> u64 {
        let members = |first: u32| (0..MEMBERS as u32).map(move |member| first + member * MEMBERS as u32);
        let sets = (span.first_slot..span.end_slot).step_by(SET_SLOTS as usize);
        let slots = sets.flat_map(|set| groups_of_set(set, turn..turn + 1)).flat_map(members);
        let inside = |slot: &u32| *slot < span.end_slot && pixel_of_slot(*slot, self.width, self.height).is_some();
        slots.filter(inside).count() as u64
    }
}

/// The groups among so many slots, from the first of a set of tiles on, that take part in the trial: their first slots.
fn groups_among(slots: usize, turns: u32) -> Vec<u32> {
    let sets = (0..slots as u32).step_by(SET_SLOTS as usize);
    sets.flat_map(|set| groups_of_set(set, 0..turns)).filter(|group| (*group as usize) < slots).collect()
}

/// What the members of a group have, of slots that are numbered from 0 on.
fn members_of<T: Copy>(slots: &[T], group: u32) -> [T; MEMBERS] {
    std::array::from_fn(|member| slots[group as usize + member * MEMBERS])
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
        let suits = |own| [true, false].map(|adaptive| judge(&groups(own, 1.0, 0.0)).suits_gradients(adaptive, false));
        assert_eq!([0.2, 0.3, 0.5].map(suits), [[true, true], [false, true], [false, false]]);
        let suits =
            |difference| [true, false].map(|alike| judge(&groups(0.1, 1.0, difference)).suits_gradients(false, alike));
        assert_eq!([0.2, 0.5, 0.8].map(suits), [[true, true], [true, false], [false, false]]);
        assert!(ReuseTrial::Always.suits_gradients(true, false));
        assert!(!judge(&groups(0.0, 0.0, 0.0)).suits_gradients(false, false));
        let mut mixed = groups(2.0, 1.0, 0.0);
        let second = mixed.iter_mut().filter(|group| half_of(group.first_slot as usize) == 1);
        second.for_each(|group| group.gradients.iter_mut().for_each(|slot| slot.trial_light = 3.0));
        assert_eq!(judge(&mixed).halves(1.4), 0b10);
    }
}
