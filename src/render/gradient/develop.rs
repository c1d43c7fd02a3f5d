//! Images from their gradients, where paths serve several pixels (shaders/lib/gradient.glsl).

use bytemuck::zeroed_vec;
use glam::Vec4;
use rayon::prelude::*;

use crate::render::error::RenderError;
use crate::render::film::{Film, MEMBERS, pixel_of_slot, rows_of_blocks, to_pixels};
use crate::render::gradient::screened_poisson::{Observation, System};
use crate::render::kernel::layout::queue;
use crate::render::plan::dispatch::Span;
use crate::render::renderer::Renderer;
use crate::render::renderer::pass::RenderControl;
use crate::render::renderer::pilot_statistics::PilotGroup;
use crate::render::renderer::surfaces::{CLASSES, Places, Side};
use crate::render::sampling::sample_map::Multiplier;
use crate::render::sampling::stopping::Stopping;

/// Samples of a pixel from which on neighbours can be of one group in some samples and not in others.
pub(crate) const FEWEST_SAMPLES: u32 = 2;
// A pilot pass, which gradients need, is made of as many.
const _: () = assert!(FEWEST_SAMPLES >= queue::PILOT_SAMPLES);
/// Samples after which the groups of pixels change at the latest: random numbers are stratified over as many. (With 8 the
/// squared error of 64 samples is 1.0 to 1.8 times as large.)
const LONGEST_PHASE: u32 = 64;
/// How many times as certain as a pixel's value a difference may be taken to be: more gains little, but takes more steps
/// to make use of.
const MAX_WEIGHT: f32 = 32.0;

/// Which samples are taken with groups of pixels as they are, and which with shifted ones.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phases {
    /// So many samples until the groups change.
    Even(u32),
    /// One half and the other of each doubling of the samples, or shorter if these are many.
    OfDoublings,
}

/// Where groups are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Groups {
    /// They lie elsewhere (shaders/lib/pixel_order.glsl).
    pub shifted: bool,
    /// Samples per pixel that have been taken with the others.
    pub other_samples: u32,
}

impl Phases {
    const NEVER_SHIFTED: Self = Self::Even(u32::MAX);

    /// Of a rendering: one half and the other, or shorter if there are many samples, or if it may end early.
    fn of(samples: u32, limited: bool) -> Self {
        Self::Even(samples.div_ceil(2).min(if limited { 2 } else { LONGEST_PHASE }))
    }

    /// Samples of the phase that a sample belongs to, which begins at a multiple of them.
    fn length(self, sample: u32) -> u32 {
        match self {
            Self::Even(length) => length,
            Self::OfDoublings => (1 << sample.max(2).ilog2() >> 1).min(LONGEST_PHASE),
        }
    }

    fn is_shifted(self, sample: u32) -> bool {
        sample / self.length(sample) % 2 == 1
    }

    /// The end of the samples from `sample` on that are taken with the same groups.
    fn end(self, sample: u32) -> u32 {
        let length = self.length(sample);
        (sample / length + 1).saturating_mul(length)
    }

    /// Samples of either kind among the first `count`.
    fn samples(self, count: u32) -> [u32; 2] {
        // Before the last doubling, there are as many of either kind.
        let before = match self {
            Self::OfDoublings if count > 1 => 1 << count.ilog2(),
            _ => 0,
        };
        let length = self.length(count);
        let (pairs, rest) = ((count - before) / length / 2, (count - before) % length.saturating_mul(2));
        let plain = before / 2 + pairs * length;
        [plain + rest.min(length), plain + rest.saturating_sub(length)]
    }

    /// The same for a pixel with such multipliers, as far as gradients are noted.
    fn recorded(self, count: u32, multipliers: [Multiplier; 2]) -> [u32; 2] {
        let mut left = count.min(queue::MOST_GRADIENTS);
        let (mut of_one, mut recorded) = ([0; 2], [0; 2]);
        while left > 0 {
            let done = of_one[0] + of_one[1];
            let kind = usize::from(self.is_shifted(done));
            of_one[kind] += self.end(done) - done;
            let more = (multipliers[kind].of(of_one[kind]) - recorded[kind]).min(left);
            recorded[kind] += more;
            left -= more;
        }
        recorded
    }
}

impl Renderer {
    /// Whether a pass is to be made for gradients.
    pub(crate) fn makes_gradients(&self) -> bool {
        let samples = match &self.settings.adaptive {
            None => self.settings.samples,
            Some(adaptive) => Stopping::of_half(adaptive, self.settings.samples).most(),
        };
        self.gradients && samples >= FEWEST_SAMPLES && self.reuses_paths() && self.reuse.suits_gradients(self.most_left)
    }

    fn phases(&self) -> Phases {
        match self.settings.adaptive {
            _ if !self.makes_gradients() => Phases::NEVER_SHIFTED,
            None => Phases::of(self.settings.samples, self.settings.time_limit.is_some()),
            Some(_) => Phases::OfDoublings,
        }
    }

    /// Brings the pixels of `spans` from `done` samples to `samples`, or less far if the watch says stop, with groups of
    /// pixels as the samples want them. Returns whether it came so far.
    pub(crate) fn pass(
        &mut self,
        spans: &[Span],
        done: u32,
        samples: u32,
        watch: &mut RenderControl<'_>,
    ) -> Result<bool, RenderError> {
        let phases = self.phases();
        let (mut done, mut complete) = (done, true);
        while done < samples && complete && !watch.stop {
            let phase_end = phases.end(done).min(samples);
            self.phase_begin = done;
            let shifted = phases.is_shifted(done);
            self.groups = Groups { shifted, other_samples: phases.samples(done)[usize::from(!shifted)] };
            let result = self.steady_pass(spans, done, phase_end, watch);
            self.groups = Groups::default();
            complete = result?;
            done = phase_end;
        }
        Ok(complete && done >= samples)
    }

    /// Samples, over all pixels, of an image that has `samples` per pixel in the mean.
    pub(crate) fn samples_of_image(&self, samples: u32) -> u64 {
        let pixels = self.pixels(&self.whole_film());
        let of_kind = |(kind, n)| self.sample_map.samples(kind, n, pixels);
        self.phases().samples(samples).into_iter().enumerate().map(of_kind).sum()
    }

    /// After a pilot pass that shows that gradients pay: surveys what pixels show, and takes over what the pilot pass shows of such neighbours.
    pub(crate) fn judge_gradients(&mut self, pilot_groups: &[PilotPair]) -> Result<(), RenderError> {
        self.survey()?;
        // In parallel, and added up in their order.
        let add = |mut a: PairSums, b: PairSums| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = [a[0] + b[0], a[1] + b[1]]);
            a
        };
        let sum = |pairs: &[PilotPair]| {
            let mut sums = PairSums::default();
            for pair in pairs {
                let Some(class) = self.places.class(pair.pixel, pair.side) else { continue };
                sums[class] = [sums[class][0] + pair.values, sums[class][1] + pair.difference];
            }
            sums
        };
        let parts: Vec<_> = pilot_groups.par_chunks(PAIRS_TOGETHER).map(sum).collect();
        self.weights = weights(&parts.into_iter().fold(PairSums::default(), add));
        log::debug!("certainty of differences: {:?}", self.weights);
        Ok(())
    }

    /// The neighbours in groups after the pilot pass, in their order.
    pub(crate) fn pairs_of(&self, pilot_groups: &[&PilotGroup]) -> Vec<PilotPair> {
        pilot_groups.par_iter().flat_map_iter(|group| self.pairs_in(group)).collect()
    }

    /// Those in one group. Samples that were not finite tell nothing.
    fn pairs_in(&self, group: &PilotGroup) -> impl Iterator<Item = PilotPair> {
        let square = |x: f32| f64::from(x).powi(2);
        let of_member = move |member: usize| {
            let slot = &group.gradients[member];
            // The neighbours on the right and below are the next member of the group, and the fourth.
            let right = (member % 4 < 3).then_some((Side::Right, member + 1, slot.pilot_right));
            let down = (member < 4).then_some((Side::Down, member + 4, slot.pilot_down));
            let pixel = pixel_of_slot(group.slot(member), self.width, self.height);
            right.into_iter().chain(down).filter_map(move |(side, neighbour, difference)| {
                let values = (square(slot.pilot_light) + square(group.gradients[neighbour].pilot_light)) / 2.0;
                let difference = square(difference);
                let finite = values.is_finite() && difference.is_finite();
                pixel.filter(|_| finite).map(|pixel| PilotPair { pixel, side, values, difference })
            })
        };
        (0..MEMBERS).flat_map(of_member)
    }

    /// Reads the whole film, and makes use of its gradients if there are any.
    pub(crate) fn develop(&mut self) -> Result<Film, RenderError> {
        let mut film = self.read_film()?;
        if self.makes_gradients() {
            self.use_gradients(&mut film)?;
        }
        Ok(film)
    }

    /// Makes use of the gradients of a film.
    fn use_gradients(&mut self, film: &mut Film) -> Result<(), RenderError> {
        let (width, height) = (self.width, self.height);
        let pixels = width as usize * height as usize;
        // Memory that the system hands out when it is written, by many threads.
        let mut slots = zeroed_vec::<[Vec4; 3]>(pixels);
        self.read_gradients(&self.whole_film(), |first, of_device| {
            to_pixels(first, of_device, &mut slots, width, |pixel, slot| *pixel = bytemuck::cast(*slot));
        })?;
        let phases = self.phases();
        let pixels = slots.par_iter_mut().zip(film.counts()).enumerate();
        let phases = pixels.map(|(pixel, ([light, ..], &count))| {
            let recorded = phases.recorded(count, self.sample_map.of_pixel(pixel));
            *light /= recorded_count(recorded);
            recorded
        });
        let phases = phases.collect();
        let band_rows = rows_of_blocks(self.buffers.bands[0].slots, width) as usize;
        let recorded = Recorded { pixels: slots, phases, places: &self.places, weights: self.weights, band_rows };
        let system = recorded.system();
        let Recorded { mut pixels, phases, .. } = recorded;
        let corrections = system.solve(&mut pixels);
        let share = |p: usize, count: u32| phases[p].iter().sum::<u32>() as f32 / count.max(1) as f32;
        film.add(|p, count| finite(share(p, count) * corrections[p]));
        self.statistics.gradients = phases.iter().any(|[_, shifted]| *shifted > 0);
        Ok(())
    }
}

/// A colour, or none if it is too large for a number.
fn finite(c: Vec4) -> [f32; 3] {
    if c.is_finite() { c.truncate().to_array() } else { [0.0; 3] }
}

/// How many times as certain the differences of each class are as the pixels' own values.
pub(crate) type ClassWeights = [f32; CLASSES];

/// What two neighbours of a group show after the pilot pass.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PilotPair {
    pixel: usize,
    /// Where its neighbour is.
    side: Side,
    /// Squares: of their values, in the mean, and of the difference.
    values: f64,
    difference: f64,
}

/// Pairs that are added up together.
const PAIRS_TOGETHER: usize = 2048;

/// Sums of squares over the pairs of each class: of values, and of differences.
type PairSums = [[f64; 2]; CLASSES];

/// The inverse of the variance of differences, that of values being 1.
fn weights(sums: &PairSums) -> ClassWeights {
    let all = sums.iter().fold([0.0; 2], |[a, b], sum| [a + sum[0], b + sum[1]]);
    // Where there are few pairs, as in all.
    sums.map(|[values, difference]| {
        let weight = (values + 0.01 * all[0]) / (difference + 0.01 * all[1]);
        if weight.is_nan() { 0.0 } else { (weight as f32).min(MAX_WEIGHT) }
    })
}

/// What is known of the pixels of an image, row by row.
struct Recorded<'a> {
    /// The mean of the light of the samples that were noted, and the sums of its differences from that on the right and below. (What
    /// else is there means nothing.)
    pixels: Vec<[Vec4; 3]>,
    /// Samples that were noted, with groups as they are and shifted.
    phases: Vec<[u32; 2]>,
    places: &'a Places,
    weights: ClassWeights,
    /// Rows of pixels in a band of the film, within which groups are shifted.
    band_rows: usize,
}

/// Samples that were noted of a pixel, or 1 if there are none.
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

    /// Whose solution is to be added to the mean of each pixel, over those samples that were noted.
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

    #[test]
    fn phases_follow_each_other() {
        for samples in [3, 4, 5, 16, 63, 64, 65, 1000] {
            let phases = Phases::of(samples, false);
            assert!(!phases.is_shifted(1) && phases.is_shifted(samples - 1) || samples > 128, "{samples}");
        }
        for rung in [2, 4, 8, 128, 256, 512, 4096] {
            assert_eq!(Phases::OfDoublings.samples(rung), [rung / 2; 2]);
        }
        let evenly = [3, 4, 5, 16, 63, 64, 65, 1000].map(|samples| (samples, Phases::of(samples, false)));
        for (samples, phases) in evenly.into_iter().chain([(1000, Phases::OfDoublings)]) {
            for count in 0..=samples {
                let expected = [false, true].map(|p| (0..count).filter(|&s| phases.is_shifted(s) == p).count() as u32);
                assert_eq!(phases.samples(count), expected);
                assert_eq!(phases.recorded(count, Default::default()), expected);
            }
            assert!((0..samples).all(|s| (s..phases.end(s)).all(|t| phases.is_shifted(t) == phases.is_shifted(s))));
        }
        let (phases, most) = (Phases::of(1 << 29, false), queue::MOST_GRADIENTS);
        assert_eq!(phases.samples(most), [most / 2; 2]);
        assert_eq!(phases.recorded(u32::MAX, Default::default()), [most / 2; 2]);
        assert_eq!(Phases::NEVER_SHIFTED.samples(1 << 30), [1 << 30, 0]);
        assert_eq!((Phases::NEVER_SHIFTED.end(1 << 30), Phases::NEVER_SHIFTED.is_shifted(1 << 30)), (u32::MAX, false));
    }

    #[test]
    fn multipliers_of_phases_are_taken_one_after_the_other() {
        let all = Multiplier::ALL;
        let pairs = all.iter().flat_map(|plain| all.map(|shifted| [*plain, shifted]));
        for (phases, multipliers) in pairs.flat_map(|s| {
            [(Phases::of(5, false), s), (Phases::of(16, false), s), (Phases::of(64, true), s), (Phases::OfDoublings, s)]
        }) {
            // Sample by sample that is asked for, the pixel takes its multiple of all of that kind.
            let (mut asked, mut taken) = ([0; 2], Vec::new());
            for sample in 0..64 {
                let kind = usize::from(phases.is_shifted(sample));
                asked[kind] += 1;
                let of_kind = taken.iter().filter(|k| **k == kind).count() as u32;
                taken.extend((of_kind..multipliers[kind].of(asked[kind])).map(|_| kind));
            }
            for count in 0..=taken.len() {
                let expected = [0, 1].map(|kind| taken[..count].iter().filter(|k| **k == kind).count() as u32);
                assert_eq!(phases.recorded(count as u32, multipliers), expected, "{phases:?} {multipliers:?} {count}");
            }
        }
    }

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
        let places = Places::new(width, all.clone());
        let phases = vec![Phases::of(samples, false).samples(samples); 64];
        let corrections = |places: &Places, band_rows: usize| {
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
        let found = corrections(&Places::new(width, apart), 64);
        assert!(found.iter().enumerate().all(|(p, c)| p % 8 < 4 || *c == Vec4::ZERO));
        // Nor from one band to the next, where shifted groups are others.
        let found = corrections(&places, 2);
        assert!(found.iter().enumerate().all(|(p, c)| p / 8 < 2 || *c == Vec4::ZERO));
    }

    #[test]
    fn certainty_is_variance_of_values_over_that_of_differences() {
        let mut sums = [[0.0; 2]; CLASSES];
        assert_eq!(weights(&sums), [0.0; CLASSES]);
        sums[0] = [100.0, 0.0];
        assert_eq!(weights(&sums), [MAX_WEIGHT; CLASSES]);
        sums[1] = [100.0, 25.0];
        let found = weights(&sums);
        assert!((found[1] - 102.0 / 25.25).abs() < 1e-5 && found[2] == 8.0, "{found:?}");
    }
}
