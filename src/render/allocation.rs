//! Where samples do most good: decides, tile by tile, which counts of samples bring an image to a wanted noise.
//!
//! The noise of an image is the root of its mean relative variance, Σ v/n over tiles, v being the variance of a sample
//! relative to its pixel and n the samples per pixel. The cheapest counts with a given sum have n ∝ √v (Neyman's
//! allocation, J. R. Stat. Soc. 97, 1934), that is √v/n alike everywhere. Counts with equal noise everywhere, n ∝ v,
//! would reach the same sum no sooner than uniform sampling does.
//!
//! Counts lie on a ladder of powers of two, where Sobol points are best. A tile climbs one rung at a time, so that no
//! decision rests on an estimate from much fewer samples than it spends.

/// A first decision is not made before so many samples per pixel.
const FIRST_DECISION: u32 = 16;

/// Counts of samples per pixel that a tile may have, increasing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Ladder {
    counts: Vec<u32>,
    /// The rung from which on decisions are made.
    pub base: usize,
}

impl Ladder {
    /// Up to `most` samples per pixel, at least 2; decisions begin at half of `mean` at the latest.
    pub fn new(most: u32, mean: Option<u32>) -> Self {
        let first = FIRST_DECISION.min(most).min(mean.map_or(u32::MAX, |n| 1 << (n / 2).max(1).ilog2()));
        let mut counts: Vec<u32> = [first / 4, first / 2, first].into_iter().filter(|&n| n > 0).collect();
        let base = counts.len() - 1;
        let mut n = first;
        while n < most {
            n = n.saturating_mul(2).min(most);
            counts.push(n);
        }
        Self { counts, base }
    }

    /// Samples per pixel of a rung.
    pub fn count(&self, rung: usize) -> u32 {
        self.counts[rung]
    }

    /// Rungs.
    pub fn len(&self) -> usize {
        self.counts.len()
    }
}

/// What is known of a tile at its present rung.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Estimate {
    /// Estimated relative variance of the means, summed over `values`.
    pub error: f64,
    /// Pixels times channels.
    pub values: f64,
}

impl Estimate {
    /// With so many times the error.
    pub fn scaled(self, factor: f64) -> Self {
        Self { error: self.error * factor, ..self }
    }
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Goal {
    /// Mean relative variance.
    pub variance: f64,
    /// Mean samples per pixel that must not be exceeded.
    pub mean_samples: Option<f64>,
}

/// The rungs of all tiles of an image, and how they rise.
#[derive(Debug, Clone)]
pub(crate) struct Allocation {
    /// For each tile those around it, itself included.
    around: Vec<Vec<usize>>,
    rungs: Vec<usize>,
    finished: bool,
    /// Mean samples per pixel that the goal is expected to take.
    pub expected_samples: f64,
}

impl Allocation {
    /// All tiles at the ladder's base. `around` has for each tile those around it, itself included.
    pub fn new(around: Vec<Vec<usize>>, ladder: &Ladder) -> Self {
        let expected_samples = f64::from(ladder.count(ladder.base));
        Self { rungs: vec![ladder.base; around.len()], around, finished: false, expected_samples }
    }

    /// The rung of each tile.
    pub fn rungs(&self) -> &[usize] {
        &self.rungs
    }

    /// Whether the goal is reached, or cannot be.
    pub fn is_finished(&self) -> bool {
        self.finished
    }

    /// Raises the tiles that do most for the noise, one rung each. `estimates` are those at the present rungs.
    ///
    /// A step aims at half the present variance at most: should time run out, what there is has been well spent.
    pub fn step(&mut self, ladder: &Ladder, estimates: &[Estimate], goal: &Goal) {
        let values: f64 = estimates.iter().map(|e| e.values).sum();
        let present = estimates.iter().map(|e| e.error).sum::<f64>() / values;
        // No values: the mean is NaN, and there is nothing to decide upon.
        if present.is_nan() || present <= goal.variance {
            self.finished = true;
            return;
        }
        let tiles = self.sampled_tiles(ladder, estimates, present * values);
        let to_goal = threshold(&tiles, ladder, goal, goal.variance * values);
        self.expected_samples = samples(&tiles, ladder, to_goal) / values;
        let aim = goal.variance.max(present / 2.0);
        let now = threshold(&tiles, ladder, goal, aim * values);
        self.finished = true;
        for (rung, tile) in self.rungs.iter_mut().zip(&tiles) {
            if tile.rung_below(ladder, now) > *rung {
                *rung += 1;
                self.finished = false;
            }
        }
    }

    /// The variance of a sample in each tile, half of it from the tiles around: few pixels do not tell it well,
    /// and light that a tile has missed is likely to have hit a neighbour. Scaled to a given sum of errors.
    fn sampled_tiles(&self, ladder: &Ladder, estimates: &[Estimate], sum: f64) -> Vec<SampledTile> {
        let per_sample = |t: usize| estimates[t].error * f64::from(ladder.count(self.rungs[t]));
        let mut tiles: Vec<_> = (0..estimates.len())
            .map(|t| {
                let around: f64 = self.around[t].iter().map(|&n| per_sample(n)).sum();
                let around_values: f64 = self.around[t].iter().map(|&n| estimates[n].values).sum();
                let mean = |sum: f64, values: f64| if values > 0.0 { sum / values } else { 0.0 };
                let own = mean(per_sample(t), estimates[t].values);
                let variance = 0.5 * (own + mean(around, around_values));
                SampledTile { variance, values: estimates[t].values, rung: self.rungs[t] }
            })
            .collect();
        let smoothed: f64 = tiles.iter().map(|t| t.error(ladder, t.rung)).sum();
        tiles.iter_mut().for_each(|t| t.variance *= sum / smoothed);
        tiles
    }
}

/// A tile with the variance of its samples.
struct SampledTile {
    variance: f64,
    values: f64,
    rung: usize,
}

impl SampledTile {
    /// Relative variance of the means at a rung, summed over the tile's values.
    fn error(&self, ladder: &Ladder, rung: usize) -> f64 {
        self.values * self.variance / f64::from(ladder.count(rung))
    }

    /// What is gained at a rung by further samples, as √v/n.
    fn need(&self, ladder: &Ladder, rung: usize) -> f64 {
        self.variance.sqrt() / f64::from(ladder.count(rung))
    }

    /// The first rung from the present one on where the need is not above `threshold`, or the last one.
    fn rung_below(&self, ladder: &Ladder, threshold: f64) -> usize {
        (self.rung..ladder.len() - 1).find(|&r| self.need(ladder, r) <= threshold).unwrap_or(ladder.len() - 1)
    }
}

/// Samples, summed over the tiles' values, if needs above `threshold` are satisfied.
fn samples(tiles: &[SampledTile], ladder: &Ladder, threshold: f64) -> f64 {
    tiles.iter().map(|t| t.values * f64::from(ladder.count(t.rung_below(ladder, threshold)))).sum()
}

/// The need above which tiles must get more samples: the largest with which the summed error falls to `error`, or a
/// larger one if the goal's samples do not suffice for that.
fn threshold(tiles: &[SampledTile], ladder: &Ladder, goal: &Goal, error: f64) -> f64 {
    let values: f64 = tiles.iter().map(|t| t.values).sum();
    let error_at = |s: f64| tiles.iter().map(|t| t.error(ladder, t.rung_below(ladder, s))).sum::<f64>();
    let affordable = |s: f64| goal.mean_samples.is_none_or(|mean| samples(tiles, ladder, s) <= mean * values);
    // At the highest present need nobody gets anything; below the other end everybody is at the ladder's end.
    let highest = tiles.iter().map(|t| t.need(ladder, t.rung)).fold(0.0, f64::max);
    // Exponents of 2, bisected.
    let (mut low, mut high) = (-48.0, 0.0);
    for _ in 0..40 {
        let middle: f64 = 0.5 * (low + high);
        let s = highest * middle.exp2();
        if !affordable(s) || error_at(s) <= error {
            low = middle;
        } else {
            high = middle;
        }
    }
    // Below `high` the samples do not suffice, or the error does already.
    let below = highest * f64::exp2(low);
    if affordable(below) { below } else { highest * f64::exp2(high) }
}
