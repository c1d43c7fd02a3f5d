//! `render --checkpoint`: what is done is kept in a file, from which a later start of the program goes on.

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail};
use photolith::files::{read_regular, write_whole};
use photolith::image::Metadata;
use photolith::render::{Checkpoint, Progress};
use photolith::{Film, RenderError, Renderer};

use super::output;

/// The file of a rendering.
pub struct Keeper {
    path: PathBuf,
    every: Duration,
    /// All that the image depends on.
    what: String,
    /// What was in the file, or is now.
    kept: Option<Checkpoint>,
}

impl Keeper {
    /// Of a rendering that `what` describes, kept in a file `every` so often; goes on from the file if it is there.
    ///
    /// # Errors
    /// The file is no checkpoint, or one of another rendering: it stays as it is.
    pub fn open(path: &Path, every: Duration, what: &Metadata) -> Result<Self> {
        let what: String = what.iter().map(|(key, value)| format!("{key}: {}\n", value.replace('\n', " "))).collect();
        let kept = if path.exists() { Some(read(path, &what)?) } else { None };
        Ok(Self { path: path.to_owned(), every, what, kept })
    }

    /// Renders until all samples are done, the time limit is over, or `on_progress` breaks: then the rest is left to the file, which
    /// is removed when there is no rest.
    ///
    /// # Errors
    /// Those of the renderer; the file cannot be written or removed.
    pub fn render(
        &mut self,
        renderer: &mut Renderer,
        blame: impl Fn(RenderError) -> anyhow::Error,
        mut on_progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Film> {
        // A time limit is one of a call.
        let in_parts = renderer.settings().time_limit.is_none();
        if let Some(kept) = &self.kept {
            log::info!("{}: going on after {} samples, over all pixels", self.path.display(), kept.samples());
        }
        loop {
            let (start, mut to_keep) = (Instant::now(), false);
            let progress = |progress: &Progress| {
                on_progress(progress)?;
                to_keep = in_parts && start.elapsed() >= self.every;
                if to_keep { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let film = match &self.kept {
                Some(kept) => renderer.go_on(kept, progress),
                None => renderer.render(progress),
            };
            let film = film.map_err(&blame)?;
            let Some(checkpoint) = renderer.checkpoint()? else {
                self.remove()?;
                return Ok(film);
            };
            write_whole(&self.path, |out| checkpoint.write(&self.what, out))?;
            self.kept = Some(checkpoint);
            if !to_keep {
                output::tell(&format!("{}: the same command goes on from here", self.path.display()));
                return Ok(film);
            }
        }
    }

    fn remove(&self) -> Result<()> {
        match fs::remove_file(&self.path) {
            Err(error) if self.kept.is_some() => {
                Err(error).with_context(|| format!("{} is left over", self.path.display()))
            }
            _ => Ok(()),
        }
    }
}

/// The checkpoint in a file, if it is of the rendering that `what` describes.
fn read(path: &Path, what: &str) -> Result<Checkpoint> {
    let bytes = read_regular(path).with_context(|| format!("{} cannot be read", path.display()))?;
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
