//! Going on with a rendering that was stopped, to the same bits.
//!
//! Which samples a pixel lacks is told by its slot of the film (shaders/lib/sample_map.glsl), so that the pass that was stopped is done
//! again on the film that it has left. What precedes the samples is found again, and has to be the same.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::render::error::RenderError;
use crate::render::film::Film;
use crate::render::film::checkpoint::{Checkpoint, Figures};
use crate::render::kernel::LIGHT_TRACE;
use crate::render::kernel::layout::FilmSlot;
use crate::render::light_tracing::splats::Splats;
use crate::render::renderer::Renderer;
use crate::render::renderer::pass::RenderControl;
use crate::render::statistics::Progress;

/// What had been done when the rendering that goes on was stopped.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Before {
    /// Samples, over all pixels, of the part of the rendering, with groups of pixels in one place, that was being done.
    pub samples_of_phase: u64,
    /// Of rendering.
    pub seconds: f64,
}

/// Who keeps what is done of a rendering from time to time.
pub(super) struct Checkpointer<'a> {
    every: Duration,
    last: Instant,
    /// Samples, over all pixels, that have been kept.
    kept: u64,
    keep: &'a mut dyn FnMut(Checkpoint),
}

impl Checkpointer<'_> {
    /// Whether it is time, if there are so many samples.
    pub fn is_due(&self, samples: u64) -> bool {
        samples > self.kept && self.last.elapsed() >= self.every
    }
}

impl Renderer {
    /// What the last rendering has done; all of it unless the [statistics](Self::statistics) say that it was stopped. The device, the
    /// scene and the settings are not in it: who keeps it keeps account of them.
    ///
    /// # Errors
    /// Nothing has been rendered; the rendering is to a noise; a Vulkan call fails.
    pub fn checkpoint(&mut self) -> Result<Checkpoint, RenderError> {
        self.check_may_resume()?;
        if self.statistics.samples == 0 {
            return Err(RenderError::Settings("nothing has been rendered that could be gone on with".to_owned()));
        }
        self.done_so_far(self.statistics.render_seconds)
    }

    /// Renders as [`Self::render`] does, but goes on from where another rendering of the same scene with the same settings on the
    /// same device was stopped. The film has the same bits as if it had not been. A time limit is one of this call, which does not end
    /// before there is a further sample.
    ///
    /// # Errors
    /// As of [`Self::render`]; the checkpoint is of another rendering; the rendering is to a noise.
    pub fn go_on(
        &mut self,
        checkpoint: &Checkpoint,
        mut on_progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Film, RenderError> {
        self.check_may_resume()?;
        self.render_from(Some(checkpoint), None, &mut on_progress)
    }

    /// Renders from the beginning or from a checkpoint on, and meanwhile hands out what is done, about `every` so often.
    ///
    /// # Errors
    /// As of [`Self::go_on`].
    pub fn render_keeping(
        &mut self,
        from: Option<&Checkpoint>,
        every: Duration,
        mut keep: impl FnMut(Checkpoint),
        mut on_progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Film, RenderError> {
        self.check_may_resume()?;
        let kept = from.map_or(0, Checkpoint::samples);
        let keeping = Checkpointer { every, last: Instant::now(), kept, keep: &mut keep };
        self.render_from(from, Some(keeping), &mut on_progress)
    }

    fn check_may_resume(&self) -> Result<(), RenderError> {
        match self.settings.adaptive {
            Some(_) => Err(RenderError::Settings("a rendering to a noise cannot be resumed".to_owned())),
            None => Ok(()),
        }
    }

    /// Hands out what is done. No submission is in flight.
    pub(super) fn keep(&mut self, watch: &mut RenderControl<'_>) -> Result<(), RenderError> {
        let done = self.done_so_far(self.before.seconds + watch.elapsed().as_secs_f64())?;
        if let Some(keeping) = &mut watch.keeping {
            keeping.kept = done.samples();
            (keeping.keep)(done);
            keeping.last = Instant::now();
        }
        Ok(())
    }

    fn done_so_far(&mut self, render_seconds: f64) -> Result<Checkpoint, RenderError> {
        let spans = self.whole_film();
        let (mut film, mut gradients) = (Vec::new(), Vec::new());
        self.read_slots(&spans, |_, slots| film.extend_from_slice(slots))?;
        if self.makes_gradients() {
            self.read_gradients(&spans, |_, slots| gradients.extend_from_slice(slots))?;
        }
        let Splats { light_paths, sums } = self.light.clone();
        let done = u64::from(self.phase_begin);
        let figures = Figures { done, light_paths, render_seconds, ..Figures::of(&self.statistics, self.stages()) };
        Ok(Checkpoint { figures, film, gradients, light_paths: sums })
    }

    fn stages(&self) -> [&'static str; 2] {
        [self.stage, LIGHT_TRACE.name]
    }

    /// The film being empty, takes over a checkpoint. Returns the samples per pixel from which on to sample.
    pub(super) fn restore(&mut self, checkpoint: &Checkpoint) -> Result<u32, RenderError> {
        let Checkpoint { figures, film, gradients, light_paths } = checkpoint;
        let other = |what: &str| RenderError::Settings(format!("the checkpoint is of another rendering: {what}"));
        let spans = self.whole_film();
        let recorded = if self.makes_gradients() { film.len() } else { 0 };
        let slots: u64 = spans.iter().map(|span| u64::from(span.slots())).sum();
        if film.len() as u64 != slots {
            return Err(other("its image has another size"));
        }
        if gradients.len() != recorded || light_paths.len() != self.light.sums.len() {
            return Err(other("its image is made in another way"));
        }
        // How many samples each pixel gets.
        let mut same = true;
        self.read_slots(&spans, |first, slots: &[FilmSlot]| {
            same &=
                slots.iter().zip(&film[first as usize..]).all(|(empty, slot)| empty.multipliers == slot.multipliers);
        })?;
        if !same {
            return Err(other("pixels are sampled in another way"));
        }
        let done = u32::try_from(figures.done).ok().filter(|&done| done <= self.settings.samples);
        let begun = done.map(|done| (done, self.samples_of_image(done)));
        let begun = begun.filter(|(_, samples)| *samples <= figures.samples);
        let (done, samples) = begun.ok_or_else(|| other("it has other numbers of samples"))?;
        self.fill_film(&spans, |slot| film[slot as usize])?;
        if recorded > 0 {
            self.fill_gradients(&spans, |slot| gradients[slot as usize])?;
        }
        let stages = self.stages();
        figures.restore(&mut self.statistics, stages);
        if !light_paths.is_empty() {
            self.light = Splats { light_paths: figures.light_paths, sums: light_paths.clone() };
        }
        self.before.samples_of_phase = figures.samples - samples;
        Ok(done)
    }
}
