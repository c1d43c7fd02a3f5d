//! Files and data that a glTF file names.

use std::path::PathBuf;

use base64::Engine as _;
use base64::engine::general_purpose::{STANDARD, STANDARD_NO_PAD};

use crate::scene::error::SceneError;
use crate::scene::gltf::problem::problem;
use crate::scene::read::{Files, no_folder, read_file};

/// The bytes of a URI: data, or a file by a relative path.
///
/// # Errors
/// It is absolute, of the network or leaves the folder it is confined to; it is no base64; the file cannot be read.
pub(super) fn read(files: Files<'_>, uri: &str, name: &str, at: &str) -> Result<Vec<u8>, SceneError> {
    if let Some(data) = uri.strip_prefix("data:") {
        return decode(data).ok_or_else(|| problem(name, at, "a data: URI that is not base64", "base64"));
    }
    let read = path_of(files, uri, name, at).and_then(|path| read_file(&path));
    read.map_err(|error| match error {
        SceneError::Read { reason, .. } => {
            problem(name, at, format!("{uri:?}, which cannot be read: {reason}"), "a file that can be read")
        }
        error => error,
    })
}

fn path_of(files: Files<'_>, uri: &str, name: &str, at: &str) -> Result<PathBuf, SceneError> {
    let refused = |why: &str| problem(name, at, format!("{uri:?}, {why}"), "a path relative to the file, or data:");
    let path = percent_encoding::percent_decode_str(uri).decode_utf8().map_err(|_| refused("which is no UTF-8"))?;
    let scheme = path.split_once(':').map(|(scheme, _)| scheme);
    if scheme.is_some_and(|s| s.len() > 1 && s.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))) {
        return Err(refused("a URI of the network or of another scheme"));
    }
    let is_drive = scheme.is_some_and(|s| s.len() == 1 && s.chars().all(|c| c.is_ascii_alphabetic()));
    if is_drive || path.starts_with(['/', '\\']) {
        return Err(refused("an absolute path"));
    }
    let base = files.base_dir.ok_or_else(|| no_folder(&path))?;
    // Exporters on Windows write its separators.
    let mut found = base.join(&*path);
    if !found.exists() && path.contains('\\') {
        found = base.join(path.replace('\\', "/"));
    }
    if files.may_read(&found) { Ok(found) } else { Err(refused("which leaves the folder that files are confined to")) }
}

/// What follows `data:`.
fn decode(data: &str) -> Option<Vec<u8>> {
    let (kind, content) = data.split_once(',')?;
    if !kind.ends_with(";base64") {
        return Some(percent_encoding::percent_decode_str(content).collect());
    }
    let content: String = content.chars().filter(|c| !c.is_ascii_whitespace()).collect();
    STANDARD.decode(&content).or_else(|_| STANDARD_NO_PAD.decode(&content)).ok()
}
