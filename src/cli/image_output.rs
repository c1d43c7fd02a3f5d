//! Where an image goes: a file, or standard output.

use std::fmt;
use std::io::{self, IsTerminal as _};
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use photolith::Image;
use photolith::image::{self, Format, Metadata, Written};
use photolith::scene::Transfer;

use super::output;

/// A place for an image, and its format.
pub struct ImageOutput {
    /// `None`: standard output.
    path: Option<PathBuf>,
    format: Format,
}

/// A parser of the names of formats.
pub fn format() -> impl TypedValueParser<Value = Format> {
    let named = |name: String| Format::ALL.into_iter().find(|format| format.extension() == name).unwrap_or(Format::Png);
    PossibleValuesParser::new(Format::ALL.map(Format::extension)).map(named)
}

impl ImageOutput {
    /// Of `--output`, or `default` without it, and `--format`. `json`: standard output is taken.
    ///
    /// # Errors
    /// The format is not known; standard output is taken, or a terminal.
    pub fn of(output: &Path, format: Option<Format>, json: bool) -> Result<Self> {
        let to_stdout =
            ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"].iter().any(|name| output.as_os_str() == *name);
        if !to_stdout {
            let format = format.map_or_else(|| Format::from_path(output), Ok)?;
            return Ok(Self { path: Some(output.to_owned()), format });
        }
        let Some(format) = format else {
            bail!("--output {}: the format is not known, expected --format png, exr, hdr or pfm", output.display());
        };
        if json {
            bail!("--output {} and --json both write to standard output, expected one of them", output.display());
        }
        if io::stdout().is_terminal() {
            bail!("--output {}: standard output is a terminal, expected a file or a pipe", output.display());
        }
        Ok(Self { path: None, format })
    }

    /// The file, if it is one.
    pub fn path(&self) -> Option<&PathBuf> {
        self.path.as_ref()
    }

    /// The format that is written.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Checks, before hours of work, that [`Self::write`] can write.
    ///
    /// # Errors
    /// It could not.
    pub fn check(&self) -> Result<()> {
        match &self.path {
            Some(path) => Ok(photolith::files::check_writable(path)?),
            None => Ok(()),
        }
    }

    /// Writes the image.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, image: &Image, metadata: &Metadata, transfer: Transfer) -> Result<Written> {
        match &self.path {
            Some(path) => Ok(image::write_as(path, self.format, image, metadata, transfer)?),
            None => {
                let (bytes, written) = image::encode(self.format, image, metadata, transfer)?;
                output::print_bytes(&bytes)?;
                Ok(written)
            }
        }
    }
}

impl fmt::Display for ImageOutput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.path {
            Some(path) => path.display().fmt(f),
            None => f.write_str("standard output"),
        }
    }
}
