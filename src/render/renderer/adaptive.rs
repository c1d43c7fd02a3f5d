//! Adaptive sampling on the device: passes over the tiles that are wanted, until the goal is reached.

use super::super::allocation::{Goal, Ladder};
use super::super::error::RenderError;
use super::super::film::Film;
use super::super::progression::Progression;
use super::super::settings::Adaptive;
use super::super::statistics::AdaptiveStatistics;
use super::super::tiles::TILE;
use super::Renderer;
use super::passes::Watch;

/// The part of the wanted variance that beams may make up; they take little time.
const BEAMS_PART: f64 = 0.125;

impl Renderer {
    /// Renders until both halves of the image have reached the goal.
    pub(super) fn render_adaptive(&mut self, adaptive: &Adaptive, watch: &mut Watch<'_>) -> Result<Film, RenderError> {
        let of_beams = if self.beams.is_some() { BEAMS_PART * adaptive.noise.powi(2) } else { 0.0 };
        let variance = adaptive.noise.powi(2) - of_beams;
        let goal = Goal { variance, mean_samples: adaptive.mean_samples.map(f64::from) };
        let ladder = Ladder::new(self.settings.samples, adaptive.mean_samples);
        let mut image = Progression::new(ladder, self.width, self.height);
        let pixels = u64::from(self.width) * u64::from(self.height);
        let mut rounds = 0;
        let mut light = self.no_beams();
        let complete = loop {
            watch.total = (image.expected_samples() * pixels as f64) as u64;
            if image.wanting().next().is_some() {
                self.raise(&mut image, watch)?;
                rounds += 1;
                if !watch.stop {
                    self.keep_up_with_beams(&mut light, watch)?;
                }
                if image.wanting().next().is_some() {
                    break false;
                }
            } else if image.is_finished() {
                break true;
            } else if watch.stop {
                break false;
            } else {
                image.decide(&goal);
            }
        };
        let mut film = Film::new(self.width, self.height);
        image.develop(&mut film);
        if !complete {
            // What was sampled on the way to rungs that are wanted is kept.
            self.read_slots(&self.whole_film(), |first, slots| image.develop_partly(&mut film, first, slots))?;
        }
        // With a number of samples for a goal there is one of beams too.
        let beams = if adaptive.noise > 0.0 { of_beams } else { f64::INFINITY };
        let beams = self.add_beams(&mut film, &mut light, beams, watch)?;
        let noise = image.noise().map(|(noise, noisiest_tile)| ((noise.powi(2) + beams).sqrt(), noisiest_tile));
        self.tell_noise(adaptive, &film, noise, rounds, complete);
        Ok(film)
    }

    /// Notes how a rendering to a noise has ended: with the noise of the film and of its noisiest tile, if these are known,
    /// after so many rounds; complete, or stopped before.
    pub(super) fn tell_noise(
        &mut self,
        adaptive: &Adaptive,
        film: &Film,
        noise: Option<(f64, f64)>,
        rounds: u32,
        complete: bool,
    ) {
        let used: u64 = film.counts().iter().map(|&n| u64::from(n)).sum();
        self.statistics.stopped = !complete && noise.is_none_or(|(noise, _)| noise > adaptive.noise);
        self.statistics.adaptive = noise.map(|(noise, noisiest_tile)| AdaptiveStatistics {
            noise,
            noisiest_tile,
            rounds,
            unused_samples: self.statistics.samples.saturating_sub(used),
        });
    }

    /// Brings tiles to the rungs that are wanted of them, from the lowest up, and reads them; or less far if the watch
    /// says stop.
    fn raise(&mut self, image: &mut Progression, watch: &mut Watch<'_>) -> Result<(), RenderError> {
        for rung in 0..image.ladder.len() {
            let spans = self.spans_of(image.wanting().filter(|&t| image.tiles[t].next_rung() == rung));
            if spans.is_empty() {
                continue;
            }
            let done = if rung > 0 { image.ladder.count(rung - 1) } else { 0 };
            if !self.pass(&spans, done, image.ladder.count(rung), watch)? {
                return Ok(());
            }
            let Progression { ladder, tiles, .. } = image;
            self.read_slots(&spans, |first, slots| {
                for (i, slots) in slots.chunks_exact(TILE).enumerate() {
                    tiles[first as usize / TILE + i].read(ladder, slots);
                }
            })?;
            if watch.stop {
                return Ok(());
            }
        }
        Ok(())
    }
}
