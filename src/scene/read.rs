//! Reading files, those that the user names and those that a scene names.

use std::io;
use std::path::{Path, PathBuf};

use crate::files::read_regular;

use crate::scene::error::SceneError;

/// The content of a regular file. Anything else (a folder, a device that never ends) is an error.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, SceneError> {
    read_regular(path).map_err(|reason| SceneError::Read { path: path.to_owned(), reason })
}

/// Where the names in a file start from, and what they may reach.
#[derive(Debug, Clone, Copy)]
pub(super) struct Files<'a> {
    /// Folder of the file. Without one (text that came from memory) no other file is read.
    pub base_dir: Option<&'a Path>,
    /// Files have to be in this folder or below.
    confined_to: Option<&'a Path>,
}

impl<'a> Files<'a> {
    /// Of a file in this folder. If it is confined, all that it names has to be there or below.
    pub fn new(base_dir: Option<&'a Path>, is_confined: bool) -> Self {
        let base_dir = base_dir.map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
        Self { base_dir, confined_to: base_dir.filter(|_| is_confined) }
    }

    /// Of a file that was named, with the same bounds.
    pub fn of<'b>(&self, path: &'b Path) -> Files<'b>
    where
        'a: 'b,
    {
        Files { confined_to: self.confined_to, ..Files::new(path.parent(), false) }
    }

    /// Whether a file is not outside of the folder that files have to be in. One that is not there may be read, which fails.
    pub fn may_read(&self, path: &Path) -> bool {
        let real = |path: &Path| path.canonicalize().ok();
        match (self.confined_to.and_then(real), real(path)) {
            (Some(folder), Some(file)) => file.starts_with(folder),
            _ => true,
        }
    }

    /// A file by a path that starts from the folder.
    pub fn read(&self, name: &str) -> Result<(PathBuf, Vec<u8>), SceneError> {
        let path = self.base_dir.ok_or_else(|| no_folder(name))?.join(name);
        if !self.may_read(&path) {
            let reason = "it is outside of the folder that files are confined to";
            return Err(SceneError::Read { path, reason: io::Error::new(io::ErrorKind::PermissionDenied, reason) });
        }
        let bytes = read_file(&path)?;
        Ok((path, bytes))
    }
}

/// Why a file is not read that a text from memory names.
pub(super) fn no_folder(name: &str) -> SceneError {
    let reason = io::Error::new(io::ErrorKind::Unsupported, "text from memory has no folder to read it from");
    SceneError::Read { path: name.into(), reason }
}
