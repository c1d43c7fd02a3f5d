//! How much fits into a dispatch: learnt from those that have ended.

use std::time::Duration;

use crate::render::film::tiling::{BLOCK_TILES, TILE_SLOTS};

/// Device time that a dispatch should take: short enough for progress, interruption and watchdogs, long enough that
/// the idle lanes at its end do not matter.
const DISPATCH_SECONDS: f64 = 0.25;
/// Samples of the first dispatch, before anything is measured.
const FIRST_SAMPLES: f64 = 262_144.0;
/// Tiles that keep a GPU busy: a dispatch of fewer takes as long.
const GPU_TILES: u32 = 4096;

/// How large rounds are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rounds {
    /// Device time that one may take.
    pub(super) seconds: f64,
    /// Samples, over all pixels, of the first, if nothing has been measured before.
    pub(super) first_samples: f64,
    /// Samples per pixel up to which one may be as large as all before it, in up to four times the time.
    pub(super) most_doubled: u32,
    /// Tiles that a dispatch has at least, if there are as many.
    pub(super) least_tiles: u32,
}

impl Rounds {
    /// On a CPU with so many threads, for a rendering with a time limit or without.
    pub fn on_cpu(threads: u32, limit: Option<Duration>) -> Self {
        // Each thread gets an equal share of a dispatch: several tiles, which differ in cost.
        let least_tiles = 4 * threads;
        match limit {
            None => Self { seconds: 1.0, first_samples: 4.0 * FIRST_SAMPLES, most_doubled: 32, least_tiles },
            // What ends at a time will end within a round.
            Some(limit) => Self {
                seconds: (limit.as_secs_f64() / 8.0).min(1.0),
                first_samples: FIRST_SAMPLES,
                most_doubled: 0,
                least_tiles,
            },
        }
    }

    /// On a GPU, where a dispatch of a part of the image may take as long as one of all: a round is one dispatch, unless
    /// the image is large.
    pub fn on_gpu() -> Self {
        Self { seconds: DISPATCH_SECONDS, first_samples: FIRST_SAMPLES, most_doubled: 0, least_tiles: GPU_TILES }
    }
}

/// How much fits into a dispatch; learnt as the rendering goes on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pace {
    fixed_samples: Option<u32>,
    /// Samples per pixel that a dispatch can do at most.
    most_samples: u32,
    rounds: Rounds,
    /// Samples per second, measured.
    rate: Option<f64>,
}

impl Pace {
    /// At most `most_samples` per pixel in a dispatch; all dispatches of `fixed_samples` per pixel if that is given.
    pub fn new(fixed_samples: Option<u32>, most_samples: u32, rounds: Rounds) -> Self {
        Self { fixed_samples: fixed_samples.map(|n| n.max(1)), most_samples, rounds, rate: None }
    }

    /// Samples per pixel that a dispatch may do.
    pub fn most_samples(&self) -> u32 {
        self.fixed_samples.unwrap_or(u32::MAX).min(self.most_samples)
    }

    /// Whether anything has been learnt.
    pub fn is_known(&self) -> bool {
        self.rate.is_some() || self.fixed_samples.is_some()
    }

    /// Learns from a finished dispatch and the samples, over all pixels, that it made.
    pub fn measured(&mut self, samples: u64, seconds: f64) {
        if seconds > 0.0 && samples > 0 {
            // The latest dispatch counts half: rates differ between parts of an image.
            let rate = samples as f64 / seconds;
            self.rate = Some(self.rate.map_or(rate, |r| 0.5 * (r + rate)));
        }
    }

    /// Samples per pixel of a round in a pass over `slots` that have `done` samples each.
    pub fn round(&self, slots: u64, done: u32) -> u32 {
        let fit = match (self.fixed_samples, self.rate) {
            (Some(n), _) => n,
            (None, Some(rate)) => {
                // Saturates.
                let timely = ((rate * self.rounds.seconds / slots as f64) as u32).max(1);
                timely.max(done.min(self.rounds.most_doubled).min(timely.saturating_mul(4)))
            }
            (None, None) => (self.rounds.first_samples / slots as f64) as u32,
        };
        fit.clamp(1, self.most_samples)
    }

    /// Tiles of the next dispatch of a round of `samples` per pixel in a pass over `slots`, of which `left` are not done.
    pub fn tiles(&self, slots: u64, samples: u32, left: u64) -> u32 {
        let fit = self.samples(slots) / f64::from(samples) / f64::from(TILE_SLOTS);
        let left = left.div_ceil(u64::from(TILE_SLOTS)) as f64;
        // Equal parts: a remnant would keep few threads busy.
        let parts = (left / fit.max(f64::from(self.rounds.least_tiles))).ceil().max(1.0);
        let tiles = (left / parts).ceil() as u32;
        // Whole blocks, so that workgroups may take several tiles of one.
        if tiles < 8 * BLOCK_TILES { tiles } else { tiles.next_multiple_of(BLOCK_TILES) }
    }

    /// Samples, over all pixels, of a dispatch in a pass over `slots`.
    fn samples(&self, slots: u64) -> f64 {
        match (self.fixed_samples, self.rate) {
            (Some(n), _) => slots as f64 * f64::from(n),
            (None, Some(rate)) => rate * DISPATCH_SECONDS,
            (None, None) => FIRST_SAMPLES,
        }
    }
}
