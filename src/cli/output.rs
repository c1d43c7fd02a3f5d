//! Standard output and standard error, which may be closed pipes or full disks.

use std::io::{self, ErrorKind, Write};

use anyhow::Context as _;

use super::text::printable;

/// Prints a text to standard output, its control characters but for ends of lines escaped. A reader that has heard enough
/// (`| head`) is no error.
///
/// # Errors
/// The text cannot be written for another reason.
pub fn print(text: &str) -> anyhow::Result<()> {
    print_bytes(printable(text, &['\n']).as_bytes())
}

/// Prints bytes as they are.
///
/// # Errors
/// As for [`print`].
pub fn print_bytes(bytes: &[u8]) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    written(out.write_all(bytes).and_then(|()| out.flush()))
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

/// Tells something on standard error, in one line under the program's name. Where that cannot be written, nobody can be told.
pub fn tell(text: &str) {
    let _ = writeln!(io::stderr(), "photolith: {}", printable(text, &[]));
}
