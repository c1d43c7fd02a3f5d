//! Reading files, those that the user names and those that a scene names.

use std::io;
use std::path::{Path, PathBuf};

use crate::files::read_regular;

use crate::scene::error::SceneError;

/// The content of a regular file. Anything else (a folder, a device that never ends) is an error.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, SceneError> {
    read_regular(path).map_err(|reason| SceneError::Read { path: path.to_owned(), reason })
}

/// A file that another file names, by a path that starts from the other file's folder. Without a folder (text that
/// came from memory) no file is read.
pub(super) fn read_relative(base_dir: Option<&Path>, name: &str) -> Result<(PathBuf, Vec<u8>), SceneError> {
    let path = base_dir.ok_or_else(|| no_folder(name))?.join(name);
    let bytes = read_file(&path)?;
    Ok((path, bytes))
}

/// Why a file is not read that a text from memory names.
pub(super) fn no_folder(name: &str) -> SceneError {
    let reason = io::Error::new(io::ErrorKind::Unsupported, "text from memory has no folder to read it from");
    SceneError::Read { path: name.into(), reason }
}
