//! Cuts a rendering into dispatches of bounded time.
//!
//! The image is covered in rounds: every pixel gets the same number of new samples before any gets more, so that a
//! rendering that is stopped is even. The cut changes no bit of the image.

/// Device time that a dispatch should take: short enough for progress, interruption and watchdogs, long enough that
/// the idle lanes at its end do not matter.
const DISPATCH_SECONDS: f64 = 0.1;
/// Samples of the first dispatch, before anything is measured.
const FIRST_SAMPLES: f64 = 262_144.0;

/// One dispatch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Work {
    pub band: usize,
    pub first_slot: u32,
    pub end_slot: u32,
    /// Samples of each pixel after this dispatch.
    pub target_samples: u32,
    /// Samples that a pixel may gain in this dispatch.
    pub new_samples: u32,
}

/// The sequence of dispatches.
#[derive(Debug)]
pub(crate) struct Plan {
    bands: Vec<(u32, u32)>,
    slots: u64,
    samples: u32,
    fixed_samples: Option<u32>,
    /// Samples per pixel that a dispatch can do at most.
    most_samples: u32,
    /// Samples per second, measured.
    rate: Option<f64>,
    /// Samples per pixel that are done once this round is.
    round_target: u32,
    round_samples: u32,
    band: usize,
    /// Next slot of the band.
    next_slot: u32,
    repeating: bool,
}

impl Plan {
    /// Plans `samples` per pixel over bands of (first slot, number of slots), with at most `most_samples` a dispatch.
    pub fn new(bands: &[(u32, u32)], samples: u32, fixed_samples: Option<u32>, most_samples: u32) -> Self {
        let slots = bands.iter().map(|b| u64::from(b.1)).sum();
        let mut plan = Self {
            bands: bands.to_vec(),
            slots,
            samples,
            fixed_samples: fixed_samples.map(|n| n.max(1)),
            most_samples,
            rate: None,
            round_target: 0,
            round_samples: 0,
            band: 0,
            next_slot: 0,
            repeating: false,
        };
        plan.begin_round();
        plan
    }

    /// The next dispatch, or `None` after the last.
    pub fn next(&mut self) -> Option<Work> {
        if self.is_over() {
            return None;
        }
        let (first, slots) = self.bands[self.band];
        let first_slot = first + self.next_slot;
        let budget = self.samples_per_dispatch();
        // Whole tiles, at least one.
        let wanted = (budget / f64::from(self.round_samples) / 64.0).ceil().max(1.0) * 64.0;
        let count = (f64::from(slots - self.next_slot)).min(wanted) as u32;
        let work = Work {
            band: self.band,
            first_slot,
            end_slot: first_slot + count,
            target_samples: self.round_target,
            new_samples: self.round_samples,
        };
        self.next_slot += count;
        if self.next_slot == slots {
            self.band += 1;
            self.next_slot = 0;
        }
        if self.band == self.bands.len() {
            self.begin_round();
        }
        Some(work)
    }

    /// Whether the last dispatch has been handed out.
    pub fn is_over(&self) -> bool {
        self.band == self.bands.len()
    }

    /// Hands out the whole image once more, for samples that ran out of loop budget.
    pub fn repeat(&mut self) {
        self.repeating = true;
        self.band = 0;
        self.next_slot = 0;
        self.round_target = self.samples;
        self.round_samples = self.samples.min(self.most_samples);
    }

    /// Learns from a finished dispatch.
    pub fn measured(&mut self, work: &Work, seconds: f64) {
        if seconds > 0.0 && !self.repeating {
            let samples = f64::from(work.end_slot - work.first_slot) * f64::from(work.new_samples);
            // The latest dispatch counts half: rates differ between parts of an image.
            let rate = samples / seconds;
            self.rate = Some(self.rate.map_or(rate, |r| 0.5 * (r + rate)));
        }
    }

    fn samples_per_dispatch(&self) -> f64 {
        match (self.fixed_samples, self.rate) {
            (Some(n), _) => self.slots as f64 * f64::from(n),
            (None, Some(rate)) => rate * DISPATCH_SECONDS,
            (None, None) => FIRST_SAMPLES,
        }
    }

    fn begin_round(&mut self) {
        let left = self.samples - self.round_target;
        if left == 0 || self.repeating {
            self.band = self.bands.len();
            return;
        }
        let fit = self.samples_per_dispatch() / self.slots as f64;
        self.round_samples = (fit.floor().max(1.0) as u32).min(left).min(self.most_samples);
        self.round_target += self.round_samples;
        self.band = 0;
        self.next_slot = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cover(bands: &[(u32, u32)], samples: u32, fixed: Option<u32>, rate: f64) -> Vec<Work> {
        let mut plan = Plan::new(bands, samples, fixed, 16);
        let mut all = Vec::new();
        while let Some(work) = plan.next() {
            let n = f64::from((work.end_slot - work.first_slot) * work.new_samples);
            plan.measured(&work, n / rate);
            all.push(work);
        }
        all
    }

    #[test]
    fn every_slot_gets_every_sample_once() {
        let bands = [(0, 6400), (6400, 640)];
        for (samples, fixed, rate) in
            [(1, None, 1e6), (64, None, 1e6), (100, Some(7), 1e5), (3, None, 1e2), (17, None, 1e12)]
        {
            let mut done = vec![0u32; 7040];
            for work in cover(&bands, samples, fixed, rate) {
                let (first, slots) = bands[work.band];
                assert!(work.first_slot >= first && work.end_slot <= first + slots);
                for slot in &mut done[work.first_slot as usize..work.end_slot as usize] {
                    *slot += work.new_samples;
                    assert_eq!(*slot, work.target_samples);
                }
            }
            assert!(done.iter().all(|&n| n == samples), "{samples} {fixed:?} {rate}");
        }
    }
}
