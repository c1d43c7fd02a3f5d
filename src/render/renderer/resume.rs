//! Going on with a rendering that was stopped, to the same bits.
//!
//! Which samples a pixel lacks is told by its slot of the film (shaders/lib/share.glsl), so that the pass that was stopped is done
//! again on the film that it has left; it is not stopped again before there is a further sample. What precedes the samples is found again, and has to be the same.

use std::ops::ControlFlow;

use super::super::checkpoint::{Checkpoint, Figures};
use super::super::error::RenderError;
use super::super::film::Film;
use super::super::layout::FilmSlot;
use super::super::statistics::Progress;
use super::Renderer;

impl Renderer {
    /// What the last rendering has done, if it was stopped before all samples were; `None` if they are. The device, the scene and the
    /// settings are not in it: who keeps it keeps account of them.
    ///
    /// # Errors
    /// Sampling is adaptive; a Vulkan call fails.
    pub fn checkpoint(&mut self) -> Result<Option<Checkpoint>, RenderError> {
        self.check_may_resume()?;
        if !self.statistics.stopped {
            return Ok(None);
        }
        let spans = self.whole_film();
        let (mut film, mut gradients) = (Vec::new(), Vec::new());
        self.read_slots(&spans, |_, slots| film.extend_from_slice(slots))?;
        if self.makes_gradients() {
            self.read_gradients(&spans, |_, slots| gradients.extend_from_slice(slots))?;
        }
        Ok(Some(Checkpoint { figures: Figures::of(&self.statistics, self.phase_begin), film, gradients }))
    }

    /// Renders as [`Self::render`] does, but goes on from where another rendering of the same scene with the same settings on the
    /// same device was stopped. The film has the same bits as if it had not been.
    ///
    /// # Errors
    /// As of [`Self::render`]; the checkpoint is of another rendering; sampling is adaptive.
    pub fn go_on(
        &mut self,
        checkpoint: &Checkpoint,
        on_progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Film, RenderError> {
        self.check_may_resume()?;
        self.render_from(Some(checkpoint), on_progress)
    }

    fn check_may_resume(&self) -> Result<(), RenderError> {
        match self.settings.adaptive {
            Some(_) => Err(RenderError::Settings("a rendering to a noise cannot be resumed".to_owned())),
            None => Ok(()),
        }
    }

    /// The film being empty, takes over a checkpoint. Returns the samples per pixel from which on to sample.
    pub(super) fn take_up(&mut self, checkpoint: &Checkpoint) -> Result<u32, RenderError> {
        let Checkpoint { figures, film, gradients } = checkpoint;
        let other = || RenderError::Settings("the checkpoint is of another rendering".to_owned());
        let spans = self.whole_film();
        let noted = if self.makes_gradients() { film.len() } else { 0 };
        let slots: u64 = spans.iter().map(|span| u64::from(span.slots())).sum();
        if film.len() as u64 != slots || gradients.len() != noted {
            return Err(other());
        }
        // How samples begin, and how many each pixel gets.
        let mut same = true;
        self.read_slots(&spans, |first, slots: &[FilmSlot]| {
            same &= slots.iter().zip(&film[first as usize..]).all(|(empty, slot)| empty.state == slot.state);
        })?;
        let done = u32::try_from(figures.done).ok().filter(|&done| done <= self.settings.samples).ok_or_else(other)?;
        let partly = figures.samples.checked_sub(self.samples_of_image(done)).ok_or_else(other)?;
        if !same {
            return Err(other());
        }
        self.fill_film(&spans, |slot| film[slot as usize])?;
        if noted > 0 {
            self.fill_gradients(&spans, |slot| gradients[slot as usize])?;
        }
        figures.restore(&mut self.statistics);
        self.partly = partly;
        Ok(done)
    }
}
