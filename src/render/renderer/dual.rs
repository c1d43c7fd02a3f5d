//! Rendering to a noise, in two halves that share no random numbers ([dual buffers](crate::render::sampling::dual)).
//!
//! A number of samples that depends on these samples biases an image: one that has missed rare bright light looks converged, and
//! stops early (Kirk and Arvo, "Unbiased sampling techniques for image synthesis", SIGGRAPH 1991). So each half decides from its own
//! samples how many the other one gets: either has a number of samples that is independent of them, and their mean is without bias,
//! however they were made. All pixels get the same number of samples.

use std::mem::replace;

use crate::render::engine::control::RenderControl;
use crate::render::error::RenderError;
use crate::render::film::Film;
use crate::render::kernel::layout::{FilmSlot, GradientSlot};
use crate::render::light_tracing::splats::Splats;
use crate::render::renderer::Renderer;
use crate::render::sampling::dual::{DualFilms, Noise, Weighting, change};
use crate::render::sampling::sample_map_decision::empty_film;
use crate::render::sampling::stopping::Stopping;
use crate::render::settings::Adaptive;
use crate::render::statistics::AdaptiveStatistics;

/// What the seed of the second half is changed by (XOR).
const SEED: u32 = 0x2993_8a61;

/// What the renderer has held of a half.
struct Parked {
    film: Vec<FilmSlot>,
    gradients: Vec<GradientSlot>,
    splats: Splats,
}

/// One of the halves.
#[derive(Default)]
struct Half {
    /// If the renderer works on the other one: what it has held of this one, unless there is nothing yet.
    parked: Option<Parked>,
    /// Samples per pixel.
    samples: u32,
    /// The film of its last rung, with the samples that it had.
    last: Option<(u32, Film)>,
    /// Its variance there, after two rungs.
    variance: Option<f64>,
    rungs: u32,
    /// Samples that the other half is to have.
    decision: Option<u32>,
    /// The film with as many as the other one has decided on.
    done: Option<Film>,
}

impl Half {
    /// Has reached a rung. The error of a mean is estimated by what its last samples have changed. Let M be the mean of m samples, M′
    /// that of n > m, the first m included. For independent samples of variance v, E(M′ − M)² = v(n − m)/(mn), so that
    /// (M′ − M)² m/(n − m) estimates the variance v/n of M′ without bias. Where scrambled Sobol points converge faster it is too large.
    fn look(&mut self, film: Film, stopping: &Stopping) {
        if let Some((before, last)) = &self.last {
            self.variance = Some(change(last, &film) * f64::from(*before) / f64::from(self.samples - before));
        }
        self.rungs += 1;
        self.decision = stopping.decide(self.samples, self.variance);
        self.last = Some((self.samples, film));
    }
}

/// Both, and which of them the renderer holds.
#[derive(Default)]
struct Halves {
    both: [Half; 2],
    present: usize,
}

impl Renderer {
    /// Renders both halves, until each has decided for the other and has as many samples as that one asks for. The film has the
    /// variance of its pixels.
    pub(super) fn render_dual(
        &mut self,
        adaptive: &Adaptive,
        control: &mut RenderControl<'_>,
    ) -> Result<Film, RenderError> {
        let seed = self.engine.push.seed;
        let rendered = self.dual_until(adaptive, control);
        self.engine.push.seed = seed;
        rendered
    }

    fn dual_until(&mut self, adaptive: &Adaptive, control: &mut RenderControl<'_>) -> Result<Film, RenderError> {
        let stopping = Stopping::of_half(adaptive, self.settings.samples);
        let mut halves = Halves::default();
        let complete = self.climb(&mut halves, &stopping, control)?;
        let (films, weighting) = match halves.both.each_mut().map(|half| half.done.take()) {
            [Some(a), Some(b)] => ([a, b], Weighting::Equal),
            // As far as they have come. Once one has stopped by what it shows, samples must not tell how much either counts.
            _ => {
                let by_clock = halves.both.iter().all(|half| half.decision.is_none());
                let films = [self.develop_half(&mut halves, 0, control)?, self.develop_half(&mut halves, 1, control)?];
                (films, if by_clock { Weighting::BySamples } else { Weighting::Equal })
            }
        };
        let (film, noise) = DualFilms(films).mean(weighting);
        let parked = halves.both.iter().filter_map(|half| half.parked.as_ref());
        self.engine.statistics.light_paths =
            self.splats.light_paths + parked.map(|parked| parked.splats.light_paths).sum::<u64>();
        let used: u64 = film.counts().iter().map(|&n| u64::from(n)).sum();
        self.engine.statistics.stopped = !complete && noise.is_none_or(|noise| noise.image > adaptive.noise);
        self.engine.statistics.adaptive = noise.map(|Noise { image, noisiest_tile }| AdaptiveStatistics {
            noise: image,
            noisiest_tile,
            rounds: halves.both.iter().map(|half| half.rungs).max().unwrap_or(0),
            unused_samples: self.engine.statistics.samples.saturating_sub(used),
        });
        Ok(film)
    }

    /// Returns whether both are done; not if the control says stop.
    fn climb(
        &mut self,
        halves: &mut Halves,
        stopping: &Stopping,
        control: &mut RenderControl<'_>,
    ) -> Result<bool, RenderError> {
        let pixels = self.engine.pixel_count() as f64;
        control.total = (2.0 * pixels) as u64;
        for rung in stopping.rungs() {
            for i in 0..2 {
                if halves.both[i].decision.is_some() {
                    continue;
                }
                if !self.bring_half(halves, i, rung, control)? {
                    return Ok(false);
                }
                let film = self.develop()?;
                halves.both[i].look(film, stopping);
            }
            let expected = halves.both.each_ref().map(|half| match half.decision {
                Some(samples) => f64::from(samples),
                None => stopping.expected(half.samples, half.variance),
            });
            control.total = (pixels * (expected[0] + expected[1])) as u64;
            if halves.both.iter().all(|half| half.decision.is_some()) {
                break;
            }
        }
        for i in 0..2 {
            let wanted = halves.both[1 - i].decision.unwrap_or(stopping.most());
            if halves.both[i].done.is_none() && !self.bring_half(halves, i, wanted, control)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Brings one of them to so many samples per pixel, and keeps it on the way as it is with those that the other one asks
    /// for. Returns false if the control says stop before.
    fn bring_half(
        &mut self,
        halves: &mut Halves,
        i: usize,
        samples: u32,
        control: &mut RenderControl<'_>,
    ) -> Result<bool, RenderError> {
        self.hold_half(halves, i)?;
        let pixels = self.engine.pixel_count();
        let wanted = halves.both[1 - i].decision.filter(|&n| n <= samples && halves.both[i].done.is_none());
        let half = &mut halves.both[i];
        for end in wanted.into_iter().chain([samples]) {
            if !self.pass(half.samples, end, control)? || !self.trace_light(pixels * u64::from(end), control)? {
                return Ok(false);
            }
            half.samples = end;
            if wanted == Some(end) && half.done.is_none() {
                let known = half.last.as_ref().filter(|(samples, _)| *samples == end).map(|(_, film)| film.clone());
                half.done = Some(known.map_or_else(|| self.develop(), Ok)?);
            }
        }
        Ok(true)
    }

    /// One of them as far as it has come, if it has come to a pixel at all.
    fn develop_half(
        &mut self,
        halves: &mut Halves,
        i: usize,
        control: &mut RenderControl<'_>,
    ) -> Result<Film, RenderError> {
        self.hold_half(halves, i)?;
        let film = self.engine.read_film()?;
        let samples = film.counts().iter().map(|&n| u64::from(n)).sum();
        if samples > 0 {
            self.trace_last_light(samples, control)?;
        }
        self.develop_film(film)
    }

    /// Makes the renderer hold one of them.
    fn hold_half(&mut self, halves: &mut Halves, i: usize) -> Result<(), RenderError> {
        if halves.present == i {
            return Ok(());
        }
        halves.both[halves.present].parked = Some(self.park()?);
        halves.present = i;
        self.engine.push.seed ^= SEED;
        match halves.both[i].parked.take() {
            Some(Parked { film, gradients, splats }) => {
                self.splats = splats;
                self.engine.load(&film, &gradients)
            }
            None => empty_film(&mut self.engine, &self.decisions.sample_map),
        }
    }

    /// What the renderer holds. No light of light paths is left.
    fn park(&mut self) -> Result<Parked, RenderError> {
        let (film, gradients) = self.engine.save(self.decisions.gradients.is_some())?;
        let none = self.no_splats();
        Ok(Parked { film, gradients, splats: replace(&mut self.splats, none) })
    }
}
