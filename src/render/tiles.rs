//! What adaptive sampling remembers of a tile of 64 pixels, and how it estimates errors.
//!
//! The pixels of a tile are two halves, like the fields of a chessboard. Pixels have random numbers of their own, and
//! groups that share paths are of one half, so that the halves are independent of each other.

use std::collections::VecDeque;

use super::allocation::{Estimate, Ladder};
use super::film::pixel_of_slot;
use super::layout::FilmSlot;
use crate::image::metrics::RELATIVE_OFFSET;

/// Slots of a tile.
pub(crate) const TILE: usize = super::film::TILE_SLOTS as usize;

/// The half that a slot of a tile belongs to; `reuses` of shaders/lib/reuse.glsl reckons alike.
pub(crate) fn half_of(slot: usize) -> usize {
    (slot % 2 + slot / 2 % 2) % 2
}

/// Sums of samples of each pixel.
type Sums = Box<[[f64; 3]; TILE]>;

/// A tile on its way up the ladder.
#[derive(Debug, Clone)]
pub(crate) struct Tile {
    /// Pixels of the tile that lie in the image.
    inside: [bool; TILE],
    /// Sums at the rungs from `first` on.
    sums: VecDeque<Sums>,
    first: usize,
    /// Of each half and rung: the relative variance of the means, summed over pixels and channels.
    errors: [Vec<f64>; 2],
}

impl Tile {
    /// Tile `index` of an image.
    pub fn new(index: u32, width: u32, height: u32) -> Self {
        let inside = std::array::from_fn(|i| pixel_of_slot(index * TILE as u32 + i as u32, width, height).is_some());
        Self { inside, sums: VecDeque::new(), first: 0, errors: [Vec::new(), Vec::new()] }
    }

    /// The next rung that has not been read; those below it have.
    pub fn next_rung(&self) -> usize {
        self.first + self.sums.len()
    }

    /// Takes over the film at the next rung.
    ///
    /// The error of a mean is estimated by what its last samples changed. Let M be the mean of m samples, M′ that of
    /// n > m, the first m included. For independent samples of variance v, E(M′ − M)² = v (n − m)/(m n), so that
    /// (M′ − M)² m/(n − m) estimates the variance v/n of M′ without bias. Scrambled Sobol points converge faster, and
    /// the estimate is then too large; see [`part_of_change`].
    pub fn read(&mut self, ladder: &Ladder, slots: &[FilmSlot]) {
        let rung = self.next_rung();
        let mut sums = Box::new([[0.0; 3]; TILE]);
        for (sum, slot) in sums.iter_mut().zip(slots) {
            *sum = std::array::from_fn(|c| slot.total(c));
        }
        let mut errors = [0.0; 2];
        if let Some(before) = self.sums.back() {
            let (m, n) = (f64::from(ladder.count(rung - 1)), f64::from(ladder.count(rung)));
            for i in (0..TILE).filter(|&i| self.inside[i]) {
                for c in 0..3 {
                    let (first, added) = (before[i][c] / m, (sums[i][c] - before[i][c]) / (n - m));
                    let change = sums[i][c] / n - first;
                    // The product of two estimates that share no samples is the square of the radiance in the mean. In the square
                    // of their mean a rare bright sample would hide the error that it is.
                    let square = (first * added).abs();
                    errors[half_of(i)] += change * change * m / (n - m) / (square + RELATIVE_OFFSET);
                }
            }
        }
        for (all, error) in self.errors.iter_mut().zip(errors) {
            all.push(error);
        }
        self.sums.push_back(sums);
    }

    /// Forgets sums below `rung`, except those of the last rung read.
    pub fn forget_below(&mut self, rung: usize) {
        while self.first < rung && self.sums.len() > 1 {
            self.sums.pop_front();
            self.first += 1;
        }
    }

    /// What a half is known by at a rung; rungs that have not been read count as the last one that has.
    pub fn estimate(&self, half: usize, rung: usize) -> Estimate {
        let pixels = (0..TILE).filter(|&i| self.inside[i] && half_of(i) == half).count();
        let known = rung.min(self.errors[half].len().saturating_sub(1));
        Estimate { error: self.errors[half].get(known).copied().unwrap_or(0.0), values: 3.0 * pixels as f64 }
    }

    /// Sum of the samples of a pixel at a rung that was read and not forgotten.
    pub fn sum(&self, slot: usize, rung: usize) -> Option<[f64; 3]> {
        rung.checked_sub(self.first).and_then(|i| self.sums.get(i)).map(|sums| sums[slot])
    }
}

/// Which part of an error estimated by a last doubling there is, seeing that doublings divide the squares of changes by
/// `1/ratio`.
///
/// Of scrambled Sobol points the variance of some integrands falls as 1/n, of others as 1/n² (Owen, Annals of Statistics
/// 25, 1997, has n⁻³), where the errors of a mean and of the samples that were added to it are opposed: what a doubling
/// changes is all of the former's variance, and three times the latter's. If `ratio` = 1/2 all is of the former kind, at 1/4 of
/// the latter, and between these there is so much of each as explains it. Taken to be 1/3 at least, to be on the safe side.
pub(crate) fn part_of_change(ratio: f64) -> f64 {
    5.0 / 3.0 - 1.0 / (3.0 * ratio.clamp(1.0 / 3.0, 0.5))
}
