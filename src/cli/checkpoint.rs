//! `render --checkpoint`: what is done is kept in a file, from which a later start of the program goes on.

use std::fs;
use std::io::{self, Write as _};
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
    /// All that the image depends on.
    what: String,
    /// What was in the file.
    from: Option<Checkpoint>,
}

impl Keeper {
    /// Of a rendering of so many pixels that `what` describes, kept in a file `every` so often; goes on from the file if it is there.
    ///
    /// # Errors
    /// The file is no checkpoint, or one of another rendering: it stays as it is.
    pub fn open(path: &Path, every: Duration, what: &Metadata, pixels: u64) -> Result<Self> {
        let what: String = what.iter().map(|(key, value)| format!("{key}: {}\n", value.replace('\n', " "))).collect();
        // What is removed at the end is the file, and not a link to it.
        let path = target(path).with_context(|| format!("{}", path.display()))?;
        let unreadable = || format!("{} cannot be read", path.display());
        let from = if path.try_exists().with_context(unreadable)? { Some(read(&path, &what, pixels)?) } else { None };
        Ok(Self { path, every, what, from })
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
        if image_is_written && !renderer.statistics().stopped {
            return match fs::remove_file(&self.path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    Err(error).with_context(|| format!("{} is left over", self.path.display()))
                }
                _ => Ok(()),
            };
        }
        self.write(&renderer.checkpoint()?)?;
        output::tell(&format!("what is done is kept in {}: the same command goes on from there", self.path.display()));
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

/// The checkpoint in a file, if it is of the rendering that `what` describes.
fn read(path: &Path, what: &str, pixels: u64) -> Result<Checkpoint> {
    let bytes = read_small(path, BYTES_BESIDE_PIXELS + pixels.saturating_mul(BYTES_OF_PIXEL))
        .with_context(|| format!("{} cannot be read", path.display()))?;
    let (of, checkpoint) = Checkpoint::read(&bytes).with_context(|| format!("{}", path.display()))?;
    let (mut found, mut expected) = (of.lines(), what.lines());
    loop {
        match (found.next(), expected.next()) {
            (None, None) => return Ok(checkpoint),
            (found, expected) if found == expected => {}
            (found, expected) => bail!(
                "{}: the checkpoint is of another rendering: found \"{}\", expected \"{}\"",
                path.display(),
                found.unwrap_or("nothing"),
                expected.unwrap_or("nothing")
            ),
        }
    }
}
