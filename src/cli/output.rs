//! Standard output and standard error, which may be closed pipes or full disks.

use std::io::{self, ErrorKind, Write};

use anyhow::Context as _;

/// Prints a text to standard output. A reader that has heard enough (`| head`) is no error.
///
/// # Errors
/// The text cannot be written for another reason.
pub fn print(text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    written(out.write_all(text.as_bytes()).and_then(|()| out.flush()))
}

/// What became of writing to standard output, as [`print`] tells it.
///
/// # Errors
/// As for [`print`].
pub fn written(result: io::Result<()>) -> anyhow::Result<()> {
    match result {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("cannot write to standard output"),
        _ => Ok(()),
    }
}

/// Tells something on standard error, under the program's name. Where that cannot be written, nobody can be told.
pub fn tell(text: &str) {
    let _ = writeln!(io::stderr(), "photolith: {text}");
}
