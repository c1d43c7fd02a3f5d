//! Files that appear whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// Writes a file under a temporary name in the same directory, then renames it to `path`.
///
/// When anything fails, the temporary file is removed and an older file at `path` stays as it was.
/// Where `path` is a symbolic link, the file that it points to is replaced.
pub(super) fn write_whole<T>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<T>,
) -> io::Result<T> {
    let target = target(path);
    if target.is_dir() {
        return Err(io::Error::from(io::ErrorKind::IsADirectory));
    }
    let mut temporary = temporary_beside(&target)?;
    let mut writer = BufWriter::with_capacity(1 << 20, temporary.as_file_mut());
    let result = write(&mut writer)?;
    writer.flush()?;
    drop(writer);
    temporary.persist(&target).map_err(|e| e.error)?;
    Ok(result)
}

/// Checks that [`write_whole`] could create its file at `path`, by creating and removing a temporary one.
pub(super) fn check(path: &Path) -> io::Result<()> {
    let target = target(path);
    if target.is_dir() {
        return Err(io::Error::from(io::ErrorKind::IsADirectory));
    }
    temporary_beside(&target).map(drop)
}

fn target(path: &Path) -> PathBuf {
    if path.is_symlink() { fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()) } else { path.to_owned() }
}

fn temporary_beside(target: &Path) -> io::Result<NamedTempFile> {
    let directory = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".photolith-").suffix(".tmp");
    #[cfg(unix)]
    {
        // As for any new file: read and write for all, less the umask (temporary files are private otherwise).
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(directory)
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
        let failed: io::Result<()> = write_whole(&path, |w| {
            w.write_all(&vec![7; 3 << 20])?; // beyond the buffer: the temporary file is not empty
            Err(io::Error::other("disk full"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "disk full");
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
            assert!(check(path).is_err(), "{}", path.display());
            assert!(write_whole(path, |w| w.write_all(b"x")).is_err(), "{}", path.display());
        }
        assert_eq!(names(directory.path()), ["file"]);
        assert!(check(&file).is_ok());
        assert_eq!(names(directory.path()), ["file"]);
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_any_new_file_and_links_are_followed() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let (plain, target, link) =
            (directory.path().join("p"), directory.path().join("t"), directory.path().join("l"));
        fs::write(&plain, "").unwrap();
        fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink("t", &link).unwrap();
        write_whole(&link, |w| w.write_all(b"new")).unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"new");
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&target), mode(&plain));
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
        assert_eq!(check(&old).is_ok(), privileged);
        assert_eq!(write_whole(&old, |w| w.write_all(b"new")).is_ok(), privileged);
        assert_eq!(fs::read(&old).unwrap(), if privileged { b"new" } else { b"old" });
        fs::set_permissions(&locked, fs::Permissions::from_mode(0o755)).unwrap();
    }
}
