//! Which samples are taken with groups of pixels as they are, and which with shifted ones (shaders/lib/pixel_order.glsl).

use crate::render::kernel::layout::queue;
use crate::render::sampling::multiplier::Multiplier;

/// Samples of a pixel from which on neighbours can be of one group in some samples and not in others.
pub(crate) const FEWEST_SAMPLES: u32 = 2;
// A pilot pass, which gradients need, is made of as many.
const _: () = assert!(FEWEST_SAMPLES >= queue::PILOT_SAMPLES);
/// Samples after which the groups of pixels change at the latest: random numbers are stratified over as many. (With 8 the
/// squared error of 64 samples is 1.0 to 1.8 times as large.)
const LONGEST_PHASE: u32 = 64;
/// A part of a rendering with groups in one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Phase {
    /// Samples per pixel before and after it.
    pub from: u32,
    pub to: u32,
    /// Groups lie elsewhere (shaders/lib/pixel_order.glsl).
    pub shifted: bool,
    /// Samples per pixel that have been taken with the others.
    pub other_samples: u32,
}

/// Which samples are taken with groups of pixels as they are, and which with shifted ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Phases {
    /// So many samples until the groups change.
    Even(u32),
    /// One half and the other of each doubling of the samples, or shorter if these are many.
    OfDoublings,
}

impl Phases {
    /// Groups stay as they are.
    pub const NEVER_SHIFTED: Self = Self::Even(u32::MAX);

    /// Of a rendering: one half and the other, or shorter if there are many samples, or if it may end early.
    pub fn new(samples: u32, limited: bool) -> Self {
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

    /// The parts of a rendering between so many samples and so many.
    pub fn between(self, from: u32, to: u32) -> impl Iterator<Item = Phase> {
        let phase_at = move |from: u32| {
            let shifted = self.is_shifted(from);
            (from < to).then(|| Phase {
                from,
                to: self.end(from).min(to),
                shifted,
                other_samples: self.samples(from)[usize::from(!shifted)],
            })
        };
        std::iter::successors(phase_at(from), move |phase| phase_at(phase.to))
    }

    /// Samples of either kind among the first `count`.
    pub fn samples(self, count: u32) -> [u32; 2] {
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

    /// The same for a pixel with such multipliers, as far as gradients are recorded.
    pub fn recorded(self, count: u32, multipliers: [Multiplier; 2]) -> [u32; 2] {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_follow_each_other() {
        for samples in [3, 4, 5, 16, 63, 64, 65, 1000] {
            let phases = Phases::new(samples, false);
            assert!(!phases.is_shifted(1) && phases.is_shifted(samples - 1) || samples > 128, "{samples}");
        }
        for rung in [2, 4, 8, 128, 256, 512, 4096] {
            assert_eq!(Phases::OfDoublings.samples(rung), [rung / 2; 2]);
        }
        let evenly = [3, 4, 5, 16, 63, 64, 65, 1000].map(|samples| (samples, Phases::new(samples, false)));
        for (samples, phases) in evenly.into_iter().chain([(1000, Phases::OfDoublings)]) {
            for count in 0..=samples {
                let expected = [false, true].map(|p| (0..count).filter(|&s| phases.is_shifted(s) == p).count() as u32);
                assert_eq!(phases.samples(count), expected);
                assert_eq!(phases.recorded(count, Default::default()), expected);
            }
            assert!((0..samples).all(|s| (s..phases.end(s)).all(|t| phases.is_shifted(t) == phases.is_shifted(s))));
        }
        let (phases, most) = (Phases::new(1 << 29, false), queue::MOST_GRADIENTS);
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
            [
                (Phases::new(5, false), s),
                (Phases::new(16, false), s),
                (Phases::new(64, true), s),
                (Phases::OfDoublings, s),
            ]
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
}
