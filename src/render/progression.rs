//! An image on its way to a noise, sampled adaptively without bias.
//!
//! Counts that depend on the samples they count bias an image: pixels that happen to look converged, often because
//! they have missed rare bright light, stop early (Kirk and Arvo, "Unbiased sampling techniques for image synthesis",
//! SIGGRAPH 1991). So the pixels of each tile are two halves, like the fields of a chessboard, which share no random
//! numbers. Each half decides for itself, from its own samples alone, which counts it would need; then the halves
//! exchange their counts. A pixel's mean is over a number of samples that is independent of them, and therefore
//! unbiased, whatever the decisions are. Samples beyond the count that the other half asks for serve decisions only
//! and are left out; nothing else is lost, least of all the convergence of one long Sobol sequence in each pixel.

use super::allocation::{Allocation, Estimate, Goal, Ladder};
use super::film::{Film, pixel_of_slot, slot_count, tiles_around};
use super::layout::FilmSlot;
use super::tiles::{TILE, Tile, half_of, part_of_change};

/// The tiles, and what the halves have decided.
#[derive(Debug)]
pub(crate) struct Progression {
    pub ladder: Ladder,
    pub tiles: Vec<Tile>,
    /// Half h is sampled to the rungs of both, and keeps those of half 1 − h.
    halves: [Allocation; 2],
}

impl Progression {
    /// No samples yet.
    pub fn new(ladder: Ladder, width: u32, height: u32) -> Self {
        let count = (slot_count(width, height) / TILE as u64) as u32;
        let half = Allocation::new((0..count).map(|t| tiles_around(t, width, height)).collect(), &ladder);
        let tiles = (0..count).map(|t| Tile::new(t, width, height)).collect();
        Self { tiles, halves: [half.clone(), half], ladder }
    }

    /// Tiles that have not reached the rungs of both halves, in increasing order.
    pub fn wanting(&self) -> impl Iterator<Item = usize> {
        let wanted = |&t: &usize| self.halves.iter().any(|h| h.rungs()[t] >= self.tiles[t].next_rung());
        (0..self.tiles.len()).filter(wanted)
    }

    /// Whether both halves have come to an end.
    pub fn is_finished(&self) -> bool {
        self.halves.iter().all(Allocation::is_finished)
    }

    /// Mean samples per pixel that the goal is expected to take.
    pub fn expected_samples(&self) -> f64 {
        self.halves.iter().map(|h| h.expected_samples).fold(0.0, f64::max)
    }

    /// Lets both halves decide.
    pub fn decide(&mut self, goal: &Goal) {
        for (h, half) in self.halves.iter_mut().enumerate().filter(|(_, half)| !half.is_finished()) {
            let known: Vec<_> = self.tiles.iter().zip(half.rungs()).map(|(tile, &rung)| (tile, h, rung)).collect();
            let part = part_of_error(&known);
            let estimates: Vec<_> = known.iter().map(|(tile, h, rung)| tile.estimate(*h, *rung).scaled(part)).collect();
            half.step(&self.ladder, &estimates, goal);
        }
        for (t, tile) in self.tiles.iter_mut().enumerate() {
            tile.forget_below(self.halves.iter().map(|h| h.rungs()[t]).min().unwrap_or(0));
        }
    }

    /// The rung that the pixels of a slot of a tile are kept at: the one that the other half decided on.
    fn rung(&self, tile: usize, half: usize) -> usize {
        self.halves[1 - half].rungs()[tile]
    }

    /// Puts the pixels into the film.
    pub fn develop(&self, film: &mut Film) {
        self.develop_at(film, |tile, half| self.rung(tile, half));
    }

    /// As [`Self::develop`], but each half by its own counts: biased, for the test that shows it.
    #[cfg(test)]
    pub fn develop_by_own_counts(&self, film: &mut Film) {
        self.develop_at(film, |tile, half| self.halves[half].rungs()[tile]);
    }

    fn develop_at(&self, film: &mut Film, rung_of: impl Fn(usize, usize) -> usize) {
        for (t, tile) in self.tiles.iter().enumerate() {
            for i in 0..TILE {
                let rung = rung_of(t, half_of(i));
                let pixel = pixel_of_slot((t * TILE + i) as u32, film.width(), film.height());
                if let (Some(pixel), Some(sum)) = (pixel, tile.sum(i, rung)) {
                    film.put(pixel, sum, self.ladder.count(rung));
                }
            }
        }
    }

    /// Puts pixels that have not reached their rungs into the film, as far as they have come.
    pub fn develop_partly(&self, film: &mut Film, first: u32, slots: &[FilmSlot]) {
        for (i, slot) in slots.iter().enumerate() {
            let index = first as usize + i;
            let tile = index / TILE;
            let unfinished = self.rung(tile, half_of(index % TILE)) >= self.tiles[tile].next_rung();
            let pixel = pixel_of_slot(index as u32, film.width(), film.height());
            if let (Some(pixel), true) = (pixel, unfinished) {
                film.put(pixel, std::array::from_fn(|c| slot.total(c)), slot.count);
            }
        }
    }

    /// The noise of the image and that of its noisiest tile: root of the mean relative variance. `None` before there
    /// are two rungs. Each half is judged at the counts of the other one, which its own luck has not chosen.
    pub fn noise(&self) -> Option<(f64, f64)> {
        if self.tiles.iter().any(|tile| tile.next_rung() < 2) {
            return None;
        }
        let known: Vec<_> = (0..self.tiles.len())
            .flat_map(|t| [0, 1].map(|h| (&self.tiles[t], h, self.rung(t, h).min(self.tiles[t].next_rung() - 1))))
            .collect();
        let part = part_of_error(&known);
        let all: Vec<_> = known.iter().map(|(tile, h, rung)| tile.estimate(*h, *rung).scaled(part)).collect();
        let mean = |of: &[Estimate]| {
            let (error, values) = of.iter().fold((0.0, 0.0), |(e, v), x| (e + x.error, v + x.values));
            error / values
        };
        let noisiest = all.chunks_exact(2).map(mean).fold(0.0, f64::max);
        Some((mean(&all).sqrt(), noisiest.sqrt()))
    }
}

/// Which part of the errors estimated there is, of halves of tiles at rungs: by the fall of what the last two doublings
/// changed. Sobol points are better at powers of 4 than at others of 2, so that a single one may mislead.
fn part_of_error(known: &[(&Tile, usize, usize)]) -> f64 {
    // Nothing is known at rung 0.
    let fall = |doublings: usize| {
        let sum = |back: usize| -> f64 {
            let deep = known.iter().filter(|(_, _, rung)| *rung > doublings);
            deep.map(|(tile, h, rung)| tile.estimate(*h, rung - back).error).sum()
        };
        let before = sum(doublings);
        (before > 0.0).then(|| (sum(0) / before).powf(1.0 / doublings as f64))
    };
    fall(2).or_else(|| fall(1)).map_or(1.0, part_of_change)
}
