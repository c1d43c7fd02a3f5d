//! Rendering to a noise where images are made from their gradients: as two that share no random numbers.
//!
//! All pixels of such an image depend on each other, so that no part of it can decide about another. Each of two images
//! decides from its own samples how many the other one is to have; so, as with the halves of
//! [`Progression`](super::super::progression::Progression), either has a number of samples that is independent of them. Their
//! mean is without bias, and their difference tells its noise, however they were made. All pixels have the same number of
//! samples: noise is spread over neighbours, and counts that differ cost more than they gain.

use super::super::error::RenderError;
use super::super::film::Film;
use super::super::layout::{FilmSlot, GradientSlot};
use super::super::settings::Adaptive;
use super::super::stopping::Stopping;
use super::super::twin_films::{change, mean_of};
use super::Renderer;
use super::passes::Watch;

/// What the seed of the second image is changed by (XOR).
const SEED: u32 = 0x2993_8a61;

/// What the device has held of an image.
struct Parked {
    film: Vec<FilmSlot>,
    gradients: Vec<GradientSlot>,
}

/// One of two images.
#[derive(Default)]
struct Twin {
    /// If the device works on the other one: what it has held of this one, unless there is nothing yet.
    parked: Option<Parked>,
    /// Samples per pixel.
    samples: u32,
    /// As of its last rung, with the samples that it had.
    last: Option<(u32, Film)>,
    /// Its variance there, after two rungs.
    variance: Option<f64>,
    rungs: u32,
    /// Samples that the other image is to have.
    decision: Option<u32>,
    /// The image with as many as the other one has decided on.
    done: Option<Film>,
}

impl Twin {
    /// Has reached a rung. The variance is estimated as in [`Tile::read`](super::super::tiles::Tile::read), but relative to the smaller
    /// of the two films' radiances (`twin_films::change`): the earlier film is part of the later one, and gradients make one of them
    /// from all pixels together, so that there are no two estimates without common samples to be multiplied.
    fn look(&mut self, film: Film, stopping: &Stopping) {
        if let Some((before, last)) = &self.last {
            self.variance = Some(change(last, &film) * f64::from(*before) / f64::from(self.samples - before));
        }
        self.rungs += 1;
        self.decision = stopping.decide(self.samples, self.variance);
        self.last = Some((self.samples, film));
    }
}

/// Both, and which of them the device holds.
#[derive(Default)]
struct Twins {
    both: [Twin; 2],
    present: usize,
}

impl Renderer {
    /// Renders both, until each has decided for the other and has as many samples as that one asks for.
    pub(super) fn render_twins(&mut self, adaptive: &Adaptive, watch: &mut Watch<'_>) -> Result<Film, RenderError> {
        let seed = self.push.seed;
        let rendered = self.twins_until(adaptive, watch);
        self.push.seed = seed;
        rendered
    }

    fn twins_until(&mut self, adaptive: &Adaptive, watch: &mut Watch<'_>) -> Result<Film, RenderError> {
        let stopping = Stopping::of_each(adaptive, self.settings.samples);
        let mut twins = Twins::default();
        let complete = self.climb(&mut twins, &stopping, watch)?;
        let rounds = twins.both.iter().map(|twin| twin.rungs).max().unwrap_or(0);
        let (film, noise) = match twins.both.each_mut().map(|twin| twin.done.take()) {
            [Some(a), Some(b)] => mean_of(&[a, b], |_, _| 0.5),
            // As far as they have come, if they have come to a pixel at all. Once one has stopped by what it shows, that must not tell
            // how much either counts.
            _ => {
                let by_clock = twins.both.iter().all(|twin| twin.decision.is_none());
                let films = [self.develop_twin(&mut twins, 0)?, self.develop_twin(&mut twins, 1)?];
                mean_of(&films, |n, m| match (n, m) {
                    _ if n == m || (!by_clock && n > 0 && m > 0) => 0.5,
                    _ => f64::from(n) / f64::from(n + m),
                })
            }
        };
        self.tell_noise(adaptive, &film, noise, rounds, complete);
        Ok(film)
    }

    /// Returns whether both are done; not if the watch says stop.
    fn climb(&mut self, twins: &mut Twins, stopping: &Stopping, watch: &mut Watch<'_>) -> Result<bool, RenderError> {
        let pixels = f64::from(self.width) * f64::from(self.height);
        watch.total = (2.0 * pixels) as u64;
        for rung in stopping.rungs() {
            for i in 0..2 {
                if twins.both[i].decision.is_some() {
                    continue;
                }
                if !self.bring_twin(twins, i, rung, watch)? {
                    return Ok(false);
                }
                let film = self.develop()?;
                twins.both[i].look(film, stopping);
            }
            let expected = twins.both.each_ref().map(|twin| match twin.decision {
                Some(samples) => f64::from(samples),
                None => stopping.expected(twin.samples, twin.variance),
            });
            watch.total = (pixels * (expected[0] + expected[1])) as u64;
            if twins.both.iter().all(|twin| twin.decision.is_some()) {
                break;
            }
        }
        for i in 0..2 {
            let wanted = twins.both[1 - i].decision.unwrap_or(stopping.most());
            if twins.both[i].done.is_none() && !self.bring_twin(twins, i, wanted, watch)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Brings one of them to so many samples per pixel, and keeps it on the way as it is with those that the other one asks
    /// for. Returns false if the watch says stop before.
    fn bring_twin(
        &mut self,
        twins: &mut Twins,
        i: usize,
        samples: u32,
        watch: &mut Watch<'_>,
    ) -> Result<bool, RenderError> {
        self.hold_twin(twins, i)?;
        let wanted = twins.both[1 - i].decision.filter(|&n| n <= samples && twins.both[i].done.is_none());
        let twin = &mut twins.both[i];
        for end in wanted.into_iter().chain([samples]) {
            if !self.pass(&self.whole_film(), twin.samples, end, watch)? {
                return Ok(false);
            }
            twin.samples = end;
            if wanted == Some(end) && twin.done.is_none() {
                let known = twin.last.as_ref().filter(|(samples, _)| *samples == end).map(|(_, film)| film.clone());
                twin.done = Some(known.map_or_else(|| self.develop(), Ok)?);
            }
        }
        Ok(true)
    }

    fn develop_twin(&mut self, twins: &mut Twins, i: usize) -> Result<Film, RenderError> {
        self.hold_twin(twins, i)?;
        self.develop()
    }

    /// Makes the device hold one of them.
    fn hold_twin(&mut self, twins: &mut Twins, i: usize) -> Result<(), RenderError> {
        if twins.present == i {
            return Ok(());
        }
        twins.both[twins.present].parked = Some(self.park()?);
        twins.present = i;
        self.push.seed ^= SEED;
        match twins.both[i].parked.take() {
            Some(Parked { film, gradients }) => {
                let whole = self.whole_film();
                self.fill_film(&whole, |slot| film[slot as usize])?;
                self.fill_gradients(&whole, |slot| gradients[slot as usize])
            }
            None => self.empty_film(),
        }
    }

    /// What the device holds.
    fn park(&mut self) -> Result<Parked, RenderError> {
        let (whole, mut film, mut gradients) = (self.whole_film(), Vec::new(), Vec::new());
        self.read_slots(&whole, |_, slots| film.extend_from_slice(slots))?;
        self.read_gradients(&whole, |_, slots| gradients.extend_from_slice(slots))?;
        Ok(Parked { film, gradients })
    }
}
