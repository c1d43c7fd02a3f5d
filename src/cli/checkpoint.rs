//! `render --checkpoint`: what is done is kept in a file, from which a later start of the program goes on.

use std::fs;
use std::io::{self, Write as _};
use std::mem::replace;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, Result, anyhow, bail};
use photolith::files::{WriteError, read_small, target, write_whole};
use photolith::image::Metadata;
use photolith::render::{Checkpoint, Progress};
use photolith::{Film, RenderError, Renderer};

use super::output;

/// More than a checkpoint takes: a file that is larger is none.
const BYTES_OF_PIXEL: u64 = 1 << 10;
const BYTES_BESIDE_PIXELS: u64 = 1 << 24;

/// The file of a rendering.
pub struct Keeper {
    path: PathBuf,
    every: Duration,
    /// Whether the file stays when the image is complete.
    stays: bool,
    /// All that its samples depend on.
    what: String,
    /// What was in the file.
    from: Option<Checkpoint>,
}

impl Keeper {
    /// Of a rendering of so many pixels, kept in a file `every` so often, which `stays` when the image is complete; goes on from the
    /// file if it is there.
    ///
    /// # Errors
    /// The file is no checkpoint.
    pub fn open(path: &Path, every: Duration, stays: bool, pixels: u64) -> Result<Self> {
        // What is removed at the end is the file, and not a link to it.
        let path = target(path).with_context(|| format!("{}", path.display()))?;
        let name = path.display().to_string();
        let unreadable = || format!("{name} cannot be read");
        let mut keeper = Self { path, every, stays, what: String::new(), from: None };
        if keeper.path.try_exists().with_context(unreadable)? {
            let most = BYTES_BESIDE_PIXELS + pixels.saturating_mul(BYTES_OF_PIXEL);
            let bytes = read_small(&keeper.path, most).with_context(unreadable)?;
            let (what, checkpoint) = Checkpoint::read(&bytes).with_context(|| name.clone())?;
            (keeper.what, keeper.from) = (what, Some(checkpoint));
        }
        Ok(keeper)
    }

    /// The samples per pixel that the file's rendering was begun with.
    pub fn begun_with(&self) -> Option<u32> {
        self.from.as_ref().map(Checkpoint::begun_with)
    }

    /// Sets what describes the rendering.
    ///
    /// # Errors
    /// The file is of another rendering: it stays as it is.
    pub fn describe(&mut self, what: &Metadata) -> Result<()> {
        let what = what.iter().map(|(key, value)| format!("{key}: {}\n", value.replace('\n', " "))).collect();
        let of_file = replace(&mut self.what, what);
        if self.from.is_none() {
            return Ok(());
        }
        let (mut found, mut expected) = (of_file.lines(), self.what.lines());
        loop {
            match (found.next(), expected.next()) {
                (None, None) => return Ok(()),
                (found, expected) if found == expected => {}
                (found, expected) => bail!(
                    "{}: the checkpoint is of another rendering: found \"{}\", expected \"{}\"",
                    self.path.display(),
                    found.unwrap_or("nothing"),
                    expected.unwrap_or("nothing")
                ),
            }
        }
    }

    /// Renders, and meanwhile keeps what is done: a file that cannot be written is told of, and is left as it was.
    ///
    /// # Errors
    /// Those of the renderer.
    pub fn render(
        &mut self,
        renderer: &mut Renderer,
        on_progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Film, RenderError> {
        let from = self.from.take();
        if let Some(from) = &from {
            log::info!("{}: going on after {} samples, over all pixels", self.path.display(), from.samples());
        }
        let keep = |checkpoint: Checkpoint| {
            if let Err(error) = self.write(&checkpoint) {
                log::warn!("what is done is not kept: {:#}", anyhow!(error));
            }
        };
        renderer.render_keeping(from.as_ref(), self.every, keep, on_progress)
    }

    /// When the image is written, or could not be: removes the file of what is complete, and keeps all else.
    ///
    /// # Errors
    /// The file cannot be written or removed; the renderer cannot tell what is done.
    pub fn finish(&self, renderer: &mut Renderer, image_is_written: bool) -> Result<()> {
        let is_complete = image_is_written && !renderer.statistics().stopped;
        if is_complete && !self.stays {
            return match fs::remove_file(&self.path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    Err(error).with_context(|| format!("{} is left over", self.path.display()))
                }
                _ => Ok(()),
            };
        }
        self.write(&renderer.checkpoint()?)?;
        let how = if is_complete {
            "with more samples it is gone on from there"
        } else {
            "the same command goes on from there"
        };
        output::tell(&format!("what is done is kept in {}: {how}", self.path.display()));
        Ok(())
    }

    fn write(&self, checkpoint: &Checkpoint) -> Result<(), WriteError> {
        write_whole(&self.path, |out| {
            checkpoint.write(&self.what, out)?;
            out.flush()?;
            // It replaces one that is whole, even if the power fails now.
            out.get_ref().sync_all()
        })
    }
}
