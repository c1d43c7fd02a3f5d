//! Files that are read and written whole, or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// A file cannot be written; an older one of that name is as it was.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}", path.display())]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// Why.
    pub source: io::Error,
}

/// What a file is written through.
pub type Writer<'a> = BufWriter<&'a mut File>;

/// Writes a file under a temporary name in the same directory, then renames it to `path`.
///
/// When anything fails, the temporary file is removed and an older file at `path` stays as it was. Where `path` is a
/// symbolic link, the file that it points to is replaced. The new file has the permissions of the old one. What is no file, such as a pipe or `/dev/null`, is written
/// as it stands.
///
/// # Errors
/// The file cannot be made, `write` fails, or there is a directory at `path`.
pub fn write_whole<T>(path: &Path, write: impl FnOnce(&mut Writer<'_>) -> io::Result<T>) -> Result<T, WriteError> {
    let written = if is_stream(path) { write_stream(path, write) } else { replace(path, write) };
    written.map_err(|source| WriteError { path: path.to_owned(), source })
}

/// Checks, before hours of work, that [`write_whole`] could create its file at `path`, by creating and removing a
/// temporary one.
///
/// # Errors
/// It could not.
pub fn check_writable(path: &Path) -> Result<(), WriteError> {
    // A pipe is not opened before there is something to write: its reader would take it for the end.
    let checked = if is_stream(path) { Ok(()) } else { replaceable(path).map(drop) };
    checked.map_err(|source| WriteError { path: path.to_owned(), source })
}

/// The content of a regular file. Anything else (a folder, a pipe that nobody writes to, a device that never ends) is an error.
///
/// # Errors
/// It is something else, or cannot be read.
pub fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    let metadata = fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, expected a file"));
    }
    if !metadata.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file"));
    }
    fs::read(path)
}

/// Whether there is something at `path` that is neither a file nor a directory.
fn is_stream(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

fn write_stream<T>(path: &Path, write: impl FnOnce(&mut Writer<'_>) -> io::Result<T>) -> io::Result<T> {
    fill(&mut File::options().write(true).open(path)?, write)
}

fn replace<T>(path: &Path, write: impl FnOnce(&mut Writer<'_>) -> io::Result<T>) -> io::Result<T> {
    let (target, mut temporary) = replaceable(path)?;
    let result = fill(temporary.as_file_mut(), write)?;
    if let Ok(old) = fs::metadata(&target) {
        // Where the system keeps none, as on some network folders, the image is still written.
        let _ = temporary.as_file().set_permissions(old.permissions());
    }
    temporary.persist(&target).map_err(|e| e.error)?;
    Ok(result)
}

fn fill<T>(file: &mut File, write: impl FnOnce(&mut Writer<'_>) -> io::Result<T>) -> io::Result<T> {
    let mut writer = BufWriter::with_capacity(1 << 20, file);
    let result = write(&mut writer)?;
    writer.flush()?;
    Ok(result)
}

/// The file that is to be replaced, and a temporary one beside it.
fn replaceable(path: &Path) -> io::Result<(PathBuf, NamedTempFile)> {
    let target = target(path);
    if target.is_dir() {
        return Err(io::Error::from(io::ErrorKind::IsADirectory));
    }
    let temporary = temporary_beside(&target)?;
    Ok((target, temporary))
}

fn target(path: &Path) -> PathBuf {
    if path.is_symlink() { fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()) } else { path.to_owned() }
}

fn temporary_beside(target: &Path) -> io::Result<NamedTempFile> {
    let directory = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    // Made here and not by `tempfile_in`: with the permissions of any new file (it makes private ones), and with errors that do
    // not tell a temporary name to whoever asked for another file.
    let create = |path: &Path| File::options().read(true).write(true).create_new(true).open(path);
    tempfile::Builder::new().prefix(".photolith-").suffix(".tmp").make_in(directory, create)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn failure_keeps_the_old_file_and_leaves_nothing() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.pfm");
        fs::write(&path, "old").unwrap();
        let failed: Result<(), WriteError> = write_whole(&path, |w| {
            w.write_all(&vec![7; 3 << 20])?; // beyond the buffer: the temporary file is not empty
            Err(io::Error::other("disk full"))
        });
        let WriteError { path: named, source } = failed.unwrap_err();
        assert_eq!((named, source.to_string()), (path.clone(), "disk full".to_owned()));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(directory.path()), ["a.pfm"]);
    }

    #[test]
    fn success_replaces_the_old_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.pfm");
        fs::write(&path, "old and longer").unwrap();
        assert_eq!(write_whole(&path, |w| w.write_all(b"new").map(|()| 5)).unwrap(), 5);
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(directory.path()), ["a.pfm"]);
    }

    #[test]
    fn directories_and_missing_parents_are_refused() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("file");
        fs::write(&file, "").unwrap();
        let vanished = directory.path().join("gone/a.png");
        for path in [directory.path(), &vanished, &file.join("a.png")] {
            let error = check_writable(path).unwrap_err();
            assert!(!error.source.to_string().contains("at path"), "{}", error.source);
            assert!(write_whole(path, |w| w.write_all(b"x")).is_err(), "{}", path.display());
        }
        assert_eq!(names(directory.path()), ["file"]);
        assert!(check_writable(&file).is_ok());
        assert_eq!(names(directory.path()), ["file"]);
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_the_old_file_or_of_any_new_one_and_links_are_followed() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let (plain, target, link) =
            (directory.path().join("p"), directory.path().join("t"), directory.path().join("l"));
        let made = directory.path().join("m");
        fs::write(&plain, "").unwrap();
        write_whole(&made, |w| w.write_all(b"new")).unwrap();
        fs::write(&target, "old").unwrap();
        fs::set_permissions(&target, fs::Permissions::from_mode(0o600)).unwrap();
        std::os::unix::fs::symlink("t", &link).unwrap();
        write_whole(&link, |w| w.write_all(b"new")).unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"new");
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!((mode(&made), mode(&target) & 0o777), (mode(&plain), 0o600));
    }

    #[cfg(unix)]
    #[test]
    fn streams_are_written_as_they_stand() {
        use std::os::unix::fs::FileTypeExt;
        let full = Path::new("/dev/full");
        assert!(check_writable(full).is_ok());
        assert!(write_whole(full, |w| w.write_all(b"x")).is_err());
        assert!(fs::metadata(full).unwrap().file_type().is_char_device());
        write_whole(Path::new("/dev/null"), |w| w.write_all(b"x")).unwrap();
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    }

    #[cfg(unix)]
    #[test]
    fn read_only_directory_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let locked = directory.path().join("locked");
        fs::create_dir(&locked).unwrap();
        let old = locked.join("a.png");
        fs::write(&old, "old").unwrap();
        fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
        // A privileged user may write there all the same: then both must agree that it works.
        let privileged = File::create(locked.join("probe")).is_ok();
        assert_eq!(check_writable(&old).is_ok(), privileged);
        assert_eq!(write_whole(&old, |w| w.write_all(b"new")).is_ok(), privileged);
        assert_eq!(fs::read(&old).unwrap(), if privileged { b"new" } else { b"old" });
        fs::set_permissions(&locked, fs::Permissions::from_mode(0o755)).unwrap();
    }
}
