//! Cuts a pass over the film into dispatches of bounded time.
//!
//! A pass brings the pixels of some spans from one number of samples to a higher one. It covers them in rounds: every
//! pixel gets the same number of new samples before any gets more, so that a rendering that is stopped is even but for a
//! round. On CPUs rounds are larger than dispatches, which cover a part of the image each: a pixel's samples cost less if
//! there are more of them in a dispatch (1.4 times less for 16 than for one, measured on lavapipe with a mesh). The cut
//! changes no bit of the image.

use crate::render::film::tiling::TILE_SLOTS;
use crate::render::plan::pace::Pace;

/// Spans of a dispatch: bounds the commands of a submission.
const MOST_SPANS: usize = 256;

/// Consecutive slots of a band of the film: whole tiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Span {
    pub band: usize,
    pub first_slot: u32,
    pub end_slot: u32,
}

impl Span {
    /// Slots in it.
    pub fn slots(&self) -> u32 {
        self.end_slot - self.first_slot
    }
}

/// Tiles, in increasing order, as few spans. Bands begin at the slots `bands`, the first at 0.
pub(crate) fn tile_spans(tiles: impl Iterator<Item = usize>, bands: &[u32]) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    for tile in tiles {
        let first_slot = TILE_SLOTS * tile as u32;
        let end_slot = first_slot + TILE_SLOTS;
        let band = bands.partition_point(|&first| first <= first_slot).saturating_sub(1);
        match spans.last_mut() {
            Some(last) if last.end_slot == first_slot && last.band == band => last.end_slot = end_slot,
            _ => spans.push(Span { band, first_slot, end_slot }),
        }
    }
    spans
}

/// What one submission does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Work {
    pub spans: Vec<Span>,
    /// Of the spans' tiles every n-th is worked on, the first one included.
    pub tile_step: u32,
    /// Samples of each pixel afterwards.
    pub target_samples: u32,
    /// Samples that a pixel may gain.
    pub new_samples: u32,
}

/// The sequence of dispatches of a pass.
#[derive(Debug)]
pub(crate) struct Plan {
    spans: Vec<Span>,
    slots: u64,
    samples: u32,
    /// Samples per pixel that are done once this round is.
    round_target: u32,
    round_samples: u32,
    /// Slots that the round has not come to.
    round_left: u64,
    /// Where the next dispatch begins.
    span: usize,
    next_slot: u32,
    repeating: bool,
    /// Samples after the first round.
    first_target: u32,
}

impl Plan {
    /// Plans to bring the pixels of `spans` from `done` samples to `samples`.
    pub fn new(spans: Vec<Span>, done: u32, samples: u32, pace: &Pace) -> Self {
        let slots = spans.iter().map(|s| u64::from(s.slots())).sum();
        let mut plan = Self {
            spans,
            slots,
            samples,
            round_target: done,
            round_samples: 0,
            round_left: 0,
            span: 0,
            next_slot: 0,
            repeating: false,
            first_target: 0,
        };
        plan.begin_round(pace);
        plan.first_target = plan.round_target;
        plan
    }

    /// The next dispatch, or `None` after the last.
    pub fn next(&mut self, pace: &Pace) -> Option<Work> {
        if self.is_over() {
            return None;
        }
        if self.round_is_over() {
            self.begin_round(pace);
        }
        let mut left = TILE_SLOTS * pace.tiles(self.slots, self.round_samples, self.round_left);
        let mut work = Work {
            spans: Vec::new(),
            tile_step: 1,
            target_samples: self.round_target,
            new_samples: self.round_samples,
        };
        while left > 0 && self.span < self.spans.len() && work.spans.len() < MOST_SPANS {
            let Span { band, end_slot, .. } = self.spans[self.span];
            let count = (end_slot - self.next_slot).min(left);
            work.spans.push(Span { band, first_slot: self.next_slot, end_slot: self.next_slot + count });
            left -= count;
            self.round_left -= u64::from(count);
            self.next_slot += count;
            if self.next_slot == end_slot {
                self.go_to(self.span + 1);
            }
        }
        Some(work)
    }

    /// Whether the last dispatch has been handed out.
    pub fn is_over(&self) -> bool {
        self.round_is_over() && self.round_target == self.samples
    }

    fn round_is_over(&self) -> bool {
        self.span == self.spans.len()
    }

    /// Hands out the whole pass once more, for samples that ran out of loop budget; in smaller dispatches if it was `in_vain`
    /// the last time.
    pub fn repeat(&mut self, pace: &Pace, in_vain: bool) {
        if in_vain {
            self.round_samples = (self.round_samples / 2).max(1);
        } else if !self.repeating {
            self.round_samples = self.samples.min(pace.most_samples());
        }
        self.repeating = true;
        self.round_target = self.samples;
        self.round_left = self.slots;
        self.go_to(0);
    }

    /// Whether the pass is handed out once more; what such dispatches take says nothing about the rate.
    pub fn is_repeating(&self) -> bool {
        self.repeating
    }

    /// Whether there are no smaller dispatches than those that were handed out.
    pub fn is_finest(&self) -> bool {
        self.round_samples <= 1
    }

    /// Whether the next piece of work is of the first round.
    pub fn in_first_round(&self) -> bool {
        !self.repeating && self.round_target == self.first_target && !self.round_is_over()
    }

    fn go_to(&mut self, span: usize) {
        self.span = span;
        self.next_slot = self.spans.get(span).map_or(0, |s| s.first_slot);
    }

    fn begin_round(&mut self, pace: &Pace) {
        let left = self.samples - self.round_target;
        if left == 0 {
            self.go_to(self.spans.len());
            return;
        }
        self.round_samples = pace.round(self.slots, self.round_target).min(left);
        self.round_target += self.round_samples;
        self.round_left = self.slots;
        self.go_to(0);
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::render::plan::pace::Rounds;

    const CPU: Rounds = Rounds { seconds: 1.0, first_samples: 1048576.0, most_doubled: 32, least_tiles: 8 };

    /// All dispatches on a device that takes `seconds` for so many samples.
    fn cover_on(
        pace: &mut Pace,
        spans: &[Span],
        done: u32,
        samples: u32,
        seconds: impl Fn(&Work, u64) -> f64,
    ) -> Vec<Work> {
        let mut plan = Plan::new(spans.to_vec(), done, samples, pace);
        let mut all = Vec::new();
        while let Some(work) = plan.next(pace) {
            let slots: u32 = work.spans.iter().map(Span::slots).sum();
            let made = u64::from(slots * work.new_samples);
            pace.measured(made, seconds(&work, made));
            all.push(work);
        }
        all
    }

    fn cover(spans: &[Span], done: u32, samples: u32, fixed: Option<u32>, rate: f64) -> Vec<Work> {
        cover_on(&mut Pace::new(fixed, 1 << 20, CPU), spans, done, samples, |_, made| made as f64 / rate)
    }

    #[test]
    fn neighbouring_tiles_of_a_band_are_one_span() {
        let span = |band, first_slot, end_slot| Span { band, first_slot, end_slot };
        let spans = tile_spans([0, 1, 3, 4, 5, 6, 9].into_iter(), &[0, 320, 576]);
        assert_eq!(spans, [span(0, 0, 128), span(0, 192, 320), span(1, 320, 448), span(2, 576, 640)]);
        assert!(tile_spans(std::iter::empty(), &[0]).is_empty());
    }

    #[test]
    fn the_first_round_ends_when_every_slot_has_its_first_samples() {
        let pace = Pace::new(Some(1), 16, CPU);
        let mut plan = Plan::new(vec![Span { band: 0, first_slot: 0, end_slot: 640 }], 0, 2, &pace);
        let mut slots = 0;
        while plan.in_first_round() {
            slots += plan.next(&pace).unwrap().spans.iter().map(Span::slots).sum::<u32>();
        }
        assert_eq!(slots, 640);
        assert!(!plan.is_over());
        // A rendering of one round ends with it.
        let mut plan = Plan::new(vec![Span { band: 0, first_slot: 0, end_slot: 64 }], 0, 1, &pace);
        assert!(plan.in_first_round() && plan.next(&pace).is_some());
        assert!(!plan.in_first_round() && plan.is_over());
    }

    #[test]
    fn rounds_last_a_second_or_double() {
        let spans = [Span { band: 0, first_slot: 0, end_slot: 64_000 }];
        let rounds = |rate: f64, samples| {
            let mut rounds: Vec<u32> = cover(&spans, 0, samples, None, rate).iter().map(|w| w.target_samples).collect();
            rounds.dedup();
            rounds
        };
        // The rate is not known at first. Then ten samples a second and pixel: as many as before, in up to four seconds.
        assert_eq!(rounds(640_000.0, 200), [16, 32, 64, 96, 128, 160, 192, 200]);
        assert_eq!(rounds(64_000.0, 40), [16, 20, 24, 28, 32, 36, 40]);
        assert_eq!(rounds(6_400_000.0, 200), [16, 116, 200]);
        // A dispatch covers a part of the image, about a quarter of a second.
        let works = cover(&spans, 0, 200, None, 640_000.0);
        assert!(works.iter().skip(4).all(|w| w.spans[0].slots() * w.new_samples < 2 * 160_000), "{works:?}");
    }

    #[test]
    fn rounds_are_short_for_a_short_limit() {
        let mut pace = Pace::new(None, 1000, Rounds::on_cpu(2, Some(Duration::from_secs(2))));
        pace.measured(640, 0.1);
        // 6400 samples a second, a quarter of a second, 640 pixels.
        assert_eq!(pace.round(640, 100), 2);
    }

    #[test]
    fn a_device_that_takes_as_long_for_less_is_kept_busy() {
        let spans = [Span { band: 0, first_slot: 0, end_slot: 65_536 }];
        // A millisecond a sample, however many pixels there are.
        let wide = |work: &Work, _| 1e-3 * f64::from(work.new_samples);
        let total = |rounds| {
            let works = cover_on(&mut Pace::new(None, 1 << 20, rounds), &spans, 0, 4096, wide);
            works.iter().map(|work| wide(work, 0)).sum::<f64>()
        };
        assert!(total(Rounds::on_gpu()) < 4.2, "{}", total(Rounds::on_gpu()));
        assert!(total(Rounds::on_cpu(1024, None)) < 4.2, "{}", total(Rounds::on_cpu(1024, None)));
    }

    #[test]
    fn every_slot_of_the_spans_gets_every_sample_once() {
        let whole =
            vec![Span { band: 0, first_slot: 0, end_slot: 6400 }, Span { band: 1, first_slot: 6400, end_slot: 7040 }];
        // Every third tile.
        let scattered: Vec<_> =
            (0..36).map(|i| Span { band: 0, first_slot: 192 * i, end_slot: 192 * i + 64 }).collect();
        for spans in [whole, scattered] {
            for (before, samples, fixed, rate) in
                [(0, 1, None, 1e6), (0, 64, None, 1e6), (32, 100, Some(7), 1e5), (2, 3, None, 1e2), (0, 17, None, 1e12)]
            {
                let mut done = vec![before; 7040];
                for work in cover(&spans, before, samples, fixed, rate) {
                    for work_item in &work.spans {
                        assert!(spans.iter().any(|s| s.band == work_item.band
                            && s.first_slot <= work_item.first_slot
                            && work_item.end_slot <= s.end_slot));
                        for slot in &mut done[work_item.first_slot as usize..work_item.end_slot as usize] {
                            *slot += work.new_samples;
                            assert_eq!(*slot, work.target_samples);
                        }
                    }
                }
                let in_spans = |slot: u32| spans.iter().any(|s| s.first_slot <= slot && slot < s.end_slot);
                for (slot, &n) in done.iter().enumerate() {
                    let expected = if in_spans(slot as u32) { samples } else { before };
                    assert_eq!(n, expected, "slot {slot}, {before} to {samples}, {fixed:?} {rate}");
                }
            }
        }
    }
}
