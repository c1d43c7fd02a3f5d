//! Adaptive sampling: more samples where they do more for the noise of the image.
//!
//! Counts that depend on the samples they count bias an image: pixels that happen to look converged, often because
//! they have missed rare bright light, would stop early (Kirk and Arvo, "Unbiased sampling techniques for image
//! synthesis", SIGGRAPH 1991). So the pixels of each tile are two halves, like the fields of a chessboard, which share
//! no random numbers. Each half decides for itself, from its own samples alone, which counts it would need; then the
//! halves exchange their counts. A pixel's mean is over a number of samples that is independent of them, and therefore
//! unbiased, whatever the decisions are. Samples beyond the count that the other half asks for serve decisions only
//! and are left out; nothing else is lost.

use super::super::allocation::{Allocation, Estimate, Goal, Ladder};
use super::super::error::RenderError;
use super::super::film::{Film, pixel_of_slot};
use super::super::layout::FilmSlot;
use super::super::plan::Span;
use super::super::settings::Adaptive;
use super::super::statistics::AdaptiveStatistics;
use super::super::tiles::{TILE, Tile, half_of, richardson};
use super::Renderer;
use super::passes::Watch;

/// The image on its way to the goal.
struct Progression {
    ladder: Ladder,
    tiles: Vec<Tile>,
    /// What each half has decided. Half h is sampled to the rungs of both, and keeps those of half 1 − h.
    halves: [Allocation; 2],
}

impl Renderer {
    /// Renders until both halves of the image have reached the goal.
    pub(super) fn render_adaptive(&mut self, adaptive: &Adaptive, watch: &mut Watch<'_>) -> Result<Film, RenderError> {
        let goal = Goal { variance: adaptive.noise.powi(2), mean_samples: adaptive.mean_samples.map(f64::from) };
        let mut image = Progression::new(self.settings.samples, self.width, self.height);
        let pixels = u64::from(self.width) * u64::from(self.height);
        let mut rounds = 0;
        let complete = loop {
            let mean = image.halves.iter().map(|h| h.expected_samples).fold(0.0, f64::max);
            watch.total = (mean * pixels as f64) as u64;
            let wanting = image.wanting();
            if !wanting.is_empty() {
                self.raise(&mut image, &wanting, watch)?;
                rounds += 1;
                if watch.stop && !image.wanting().is_empty() {
                    break false;
                }
            } else if image.halves.iter().all(Allocation::is_finished) {
                break true;
            } else {
                image.decide(&goal);
            }
        };
        let mut film = Film::new(self.width, self.height);
        image.develop(&mut film);
        if !complete {
            // What was sampled on the way to rungs that both halves agree on is kept.
            let all = self.whole_film();
            self.read_slots(&all, |first, slots| image.develop_partly(&mut film, first, slots))?;
        }
        let used: u64 = film.counts().iter().map(|&n| u64::from(n)).sum();
        let noise = image.noise();
        self.statistics.stopped = !complete && noise.is_none_or(|(noise, _)| noise > adaptive.noise);
        self.statistics.adaptive = noise.map(|(noise, noisiest_tile)| AdaptiveStatistics {
            noise,
            noisiest_tile,
            rounds,
            unused_samples: self.statistics.samples.saturating_sub(used),
        });
        Ok(film)
    }

    /// Brings tiles to their next rungs, rung by rung, and reads them.
    fn raise(&mut self, image: &mut Progression, wanting: &[usize], watch: &mut Watch<'_>) -> Result<(), RenderError> {
        for rung in 0..image.ladder.len() {
            let spans = self.spans(wanting.iter().copied().filter(|&t| image.tiles[t].next_rung() == rung));
            if spans.is_empty() {
                continue;
            }
            let done = if rung > 0 { image.ladder.count(rung - 1) } else { 0 };
            self.pass(spans.clone(), done, image.ladder.count(rung), watch)?;
            if watch.stop {
                return Ok(());
            }
            let Progression { ladder, tiles, .. } = image;
            self.read_slots(&spans, |first, slots| {
                for (i, slots) in slots.chunks_exact(TILE).enumerate() {
                    tiles[first as usize / TILE + i].read(ladder, slots);
                }
            })?;
        }
        Ok(())
    }

    /// Tiles, in increasing order, as spans.
    fn spans(&self, tiles: impl Iterator<Item = usize>) -> Vec<Span> {
        let mut spans: Vec<Span> = Vec::new();
        for tile in tiles {
            let first_slot = (tile * TILE) as u32;
            let band = self.bands.partition_point(|b| b.first <= first_slot) - 1;
            let end_slot = first_slot + TILE as u32;
            match spans.last_mut() {
                Some(last) if last.end_slot == first_slot && last.band == band => last.end_slot = end_slot,
                _ => spans.push(Span { band, first_slot, end_slot }),
            }
        }
        spans
    }
}

impl Progression {
    fn new(most_samples: u32, width: u32, height: u32) -> Self {
        let ladder = Ladder::new(most_samples);
        let tiles_x = width.div_ceil(8) as usize;
        let count = tiles_x * height.div_ceil(8) as usize;
        let half = Allocation::new(tiles_x, count, &ladder);
        let tiles = (0..count).map(|t| Tile::new(t as u32, width, height)).collect();
        Self { tiles, halves: [half.clone(), half], ladder }
    }

    /// Tiles that have not reached the rungs of both halves.
    fn wanting(&self) -> Vec<usize> {
        let wanted = |t: usize| self.halves.iter().any(|h| h.rungs()[t] >= self.tiles[t].next_rung());
        (0..self.tiles.len()).filter(|&t| wanted(t)).collect()
    }

    /// Lets both halves decide.
    fn decide(&mut self, goal: &Goal) {
        for (h, half) in self.halves.iter_mut().enumerate().filter(|(_, half)| !half.is_finished()) {
            let estimates: Vec<_> =
                self.tiles.iter().zip(half.rungs()).map(|(tile, &rung)| tile.estimate(h, rung)).collect();
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
    fn develop(&self, film: &mut Film) {
        for (t, tile) in self.tiles.iter().enumerate() {
            for i in 0..TILE {
                let rung = self.rung(t, half_of(i));
                let pixel = pixel_of_slot((t * TILE + i) as u32, film.width(), film.height());
                if let (Some(pixel), Some(sum)) = (pixel, tile.sum(i, rung)) {
                    film.put(pixel, sum, self.ladder.count(rung));
                }
            }
        }
    }

    /// Puts pixels that have not reached their rungs into the film, as far as they have come.
    fn develop_partly(&self, film: &mut Film, first: u32, slots: &[FilmSlot]) {
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
    fn noise(&self) -> Option<(f64, f64)> {
        if self.tiles.iter().any(|tile| tile.next_rung() < 2) {
            return None;
        }
        let at = |t: usize, back: usize| {
            let estimate = |half: usize| {
                let rung = self.rung(t, half).min(self.tiles[t].next_rung() - 1);
                self.tiles[t].estimate(half, rung - back.min(rung))
            };
            let (a, b) = (estimate(0), estimate(1));
            Estimate { error: a.error + b.error, values: a.values + b.values }
        };
        let all: Vec<_> = (0..self.tiles.len()).map(|t| at(t, 0)).collect();
        let error: f64 = all.iter().map(|e| e.error).sum();
        let values: f64 = all.iter().map(|e| e.values).sum();
        let before: f64 = (0..self.tiles.len()).map(|t| at(t, 1).error).sum();
        let part = if before > 0.0 { richardson(error / before) } else { 1.0 };
        let noisiest = all.iter().map(|e| e.error / e.values).fold(0.0, f64::max);
        Some(((part * error / values).sqrt(), (part * noisiest).sqrt()))
    }
}
