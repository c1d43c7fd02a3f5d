//! Going on with a rendering that was stopped, to the same bits.
//!
//! Which samples a pixel lacks is told by its slot of the film (shaders/lib/sample_map.glsl), so that the pass that was stopped is done
//! again on the film that it has left. What precedes the samples is found again, and has to be the same.

use std::ops::ControlFlow;
use std::time::Duration;

use crate::render::engine::Engine;
use crate::render::engine::control::Checkpointer;
use crate::render::error::RenderError;
use crate::render::film::Film;
use crate::render::film::checkpoint::{Checkpoint, Figures};
use crate::render::kernel::LIGHT_TRACE;
use crate::render::kernel::layout::FilmSlot;
use crate::render::light_tracing::splats::Splats;
use crate::render::renderer::plan::Plan;
use crate::render::renderer::techniques::Decisions;
use crate::render::renderer::{Position, Renderer};
use crate::render::statistics::Progress;

/// What has been done of a rendering, in which splats are what light paths have lit.
///
/// # Errors
/// The device fails.
pub(super) fn checkpoint(
    engine: &mut Engine,
    decisions: &Decisions,
    splats: &Splats,
    position: Position,
    render_seconds: f64,
) -> Result<Checkpoint, RenderError> {
    let (film, gradients) = engine.save(decisions.gradients.is_some())?;
    let Splats { light_paths, sums } = splats.clone();
    let done = u64::from(position.phase_begin);
    let figures = Figures::new(&engine.statistics, stages(engine));
    let Plan { samples, limited } = position.plan;
    let figures =
        Figures { begun_with: samples, limited: limited.into(), done, light_paths, render_seconds, ..figures };
    Ok(Checkpoint { figures, film, gradients, light_paths: sums })
}

/// The names of its stages, and of light tracing.
fn stages(engine: &Engine) -> [&'static str; 2] {
    [engine.stage(), LIGHT_TRACE.name]
}

impl Renderer {
    /// What the last rendering has done; all of it unless the [statistics](Self::statistics) say that it was stopped. The device, the
    /// scene and the settings are not in it: who keeps it keeps account of them.
    ///
    /// # Errors
    /// Nothing has been rendered; the rendering is to a noise; a Vulkan call fails.
    pub fn checkpoint(&mut self) -> Result<Checkpoint, RenderError> {
        self.check_may_resume()?;
        if self.engine.statistics.samples == 0 {
            return Err(RenderError::Settings("nothing has been rendered that could be gone on with".to_owned()));
        }
        let seconds = self.engine.statistics.render_seconds;
        checkpoint(&mut self.engine, &self.decisions, &self.splats, self.position, seconds)
    }

    /// Renders as [`Self::render`] does, but goes on from where another rendering of the same scene with the same settings on the
    /// same device was stopped, or is complete. The settings may ask for more samples than it was [begun with](RenderSettings::begun_with). If they ask
    /// for as many, the film has the same bits as if it had not been stopped. A time limit is one of this call, which does not end
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
        self.render_from(from, Some(Checkpointer::new(every, kept, &mut keep)), &mut on_progress)
    }

    fn check_may_resume(&self) -> Result<(), RenderError> {
        match self.settings.adaptive {
            Some(_) => Err(RenderError::Settings("a rendering to a noise cannot be resumed".to_owned())),
            None => Ok(()),
        }
    }

    /// The film being empty, takes over a checkpoint. Returns the samples per pixel from which on to sample.
    pub(super) fn restore(&mut self, checkpoint: &Checkpoint) -> Result<u32, RenderError> {
        let Checkpoint { figures, film, gradients, light_paths } = checkpoint;
        let other = |what: &str| RenderError::Settings(format!("the checkpoint is of another rendering: {what}"));
        let spans = self.engine.whole_film();
        let recorded = if self.decisions.gradients.is_some() { film.len() } else { 0 };
        let slots: u64 = spans.iter().map(|span| u64::from(span.slots())).sum();
        if film.len() as u64 != slots {
            return Err(other("its image has another size"));
        }
        if gradients.len() != recorded || light_paths.len() != self.splats.sums.len() {
            return Err(other("its image is made in another way"));
        }
        // How many samples each pixel gets.
        let mut same = true;
        self.engine.read_slots(&spans, |first, slots: &[FilmSlot]| {
            same &=
                slots.iter().zip(&film[first as usize..]).all(|(empty, slot)| empty.multipliers == slot.multipliers);
        })?;
        if !same {
            return Err(other("pixels are sampled in another way"));
        }
        let done = u32::try_from(figures.done).ok().filter(|&done| done <= self.settings.samples);
        let begun = done.map(|done| (done, self.decisions.samples_of_image(done, self.engine.pixel_count())));
        let begun = begun.filter(|(_, samples)| *samples <= figures.samples);
        let (done, samples) = begun.ok_or_else(|| other("it has other numbers of samples"))?;
        self.engine.load(film, gradients)?;
        let stages = stages(&self.engine);
        figures.restore(&mut self.engine.statistics, stages);
        if !light_paths.is_empty() {
            self.splats = Splats { light_paths: figures.light_paths, sums: light_paths.clone() };
        }
        self.position.samples_of_phase = figures.samples - samples;
        Ok(done)
    }
}
