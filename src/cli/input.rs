//! Scenes from files and from standard input.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, IsTerminal as _, Read};
use std::path::Path;

use anyhow::{Context as _, Result, bail};
use photolith::Scene;
use photolith::host::available_memory;
use photolith::scene::{LoadOptions, Loaded};

/// Bytes that are read of a scene that comes by a pipe, at most, where it is not known how much memory there is.
const MOST_BYTES: u64 = 4 << 30;

/// Loads a scene by its name: a file, or `-`, `/dev/stdin` or another open descriptor, where it may be either kind of scene, and
/// what it names lies where the program was started.
///
/// # Errors
/// It cannot be read, or is no scene.
pub fn load(scene: &Path, options: &LoadOptions) -> Result<Loaded> {
    let here = Some(Path::new(""));
    if is_standard_input(scene) {
        let is_terminal = io::stdin().is_terminal();
        let bytes = read_stream(io::stdin().lock(), is_terminal, "/dev/stdin").context("standard input")?;
        return Ok(Scene::from_bytes_with(&bytes, "stdin", here, options)?);
    }
    if is_descriptor(scene) {
        let name = scene.display().to_string();
        let bytes = File::open(scene).map_err(anyhow::Error::from).and_then(|file| read_stream(file, false, &name));
        return Ok(Scene::from_bytes_with(&bytes.with_context(|| name.clone())?, &name, here, options)?);
    }
    Ok(Scene::load_with(scene, options)?)
}

/// What an image of such a scene is called.
///
/// # Errors
/// The name is none of a file.
pub fn stem(scene: &Path) -> Result<OsString> {
    if is_descriptor(scene) {
        return Ok("stdin".into());
    }
    let stem = scene.file_stem().with_context(|| format!("{}: not a file name", scene.display()))?;
    Ok(stem.to_owned())
}

/// The path by which the file can be found that a scene is read from.
pub fn path(scene: &Path) -> &Path {
    if is_standard_input(scene) { Path::new("/dev/stdin") } else { scene }
}

fn is_standard_input(scene: &Path) -> bool {
    ["-", "/dev/stdin", "/dev/fd/0", "/proc/self/fd/0"].iter().any(|name| scene.as_os_str() == *name)
}

/// Also of a shell's `<(…)`.
fn is_descriptor(scene: &Path) -> bool {
    is_standard_input(scene) || scene.starts_with("/dev/fd") || scene.starts_with("/proc/self/fd")
}

/// Reads to the end, but of a device that may have none.
fn read_stream(stream: impl Read, is_terminal: bool, path: &str) -> Result<Vec<u8>> {
    #[cfg(unix)]
    if let Ok(found) = std::fs::metadata(path) {
        use std::os::unix::fs::FileTypeExt as _;
        let kind = found.file_type();
        if !(is_terminal || kind.is_file() || kind.is_fifo() || kind.is_socket()) {
            bail!("neither a file nor a pipe, expected a scene (TOML) or a mesh (OBJ)");
        }
    }
    #[cfg(not(unix))]
    let _ = (is_terminal, path);
    let most = available_memory().map_or(MOST_BYTES, |bytes| bytes / 4);
    let mut bytes = Vec::new();
    stream.take(most + 1).read_to_end(&mut bytes).context("cannot be read")?;
    if bytes.len() as u64 > most {
        bail!("more than {most} bytes, expected a scene that fits into memory");
    }
    Ok(bytes)
}
