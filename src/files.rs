//! Files that are read and written whole, or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::time::{Duration, Instant};

use tempfile::NamedTempFile;

use crate::host::available_memory;

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
/// symbolic link, the file that it points to is replaced, or made. The new file has the permissions of the old one and, where that
/// is possible, its owner. What is no file, such as a pipe or `/dev/null`, is written as it stands.
///
/// # Errors
/// The file cannot be made, `write` fails, or at `path` there is a directory, a file that may not be written, or a pipe that nobody
/// reads.
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

/// Bytes for which there is memory wherever the program runs.
const ALWAYS_FITS: u64 = 1 << 20;

/// The content of a regular file. Anything else (a folder, a pipe that nobody writes to, a device that never ends) is an error, and so
/// is what does not fit into memory.
///
/// # Errors
/// It is something else, or cannot be read.
pub fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    read(path, |length| if length > ALWAYS_FITS { available_memory().unwrap_or(u64::MAX) } else { length })
}

/// The content of a regular file of at most so many bytes.
///
/// # Errors
/// It is larger or something else, or cannot be read.
pub fn read_small(path: &Path, most_bytes: u64) -> io::Result<Vec<u8>> {
    read(path, |_| most_bytes)
}

/// The same; how many bytes there may be is asked for when it is known how many there are.
fn read(path: &Path, most_bytes: impl FnOnce(u64) -> u64) -> io::Result<Vec<u8>> {
    let metadata = fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, expected a file"));
    }
    if !metadata.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file"));
    }
    let most_bytes = most_bytes(metadata.len());
    if metadata.len() > most_bytes {
        let found = format!("it has {} bytes, expected at most {most_bytes}", metadata.len());
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, found));
    }
    fs::read(path)
}

/// Whether there is something at `path` that is neither a file nor a directory.
fn is_stream(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

fn write_stream<T>(path: &Path, write: impl FnOnce(&mut Writer<'_>) -> io::Result<T>) -> io::Result<T> {
    fill(&mut open_stream(path)?, write)
}

/// How long a pipe may have no reader.
#[cfg(unix)]
const PATIENCE: Duration = Duration::from_secs(5);

/// Opens what is no file for writing. A pipe without a reader would be waited for without end.
#[cfg(unix)]
fn open_stream(path: &Path) -> io::Result<File> {
    use std::os::fd::AsRawFd;
    use std::os::unix::fs::OpenOptionsExt;
    let start = Instant::now();
    let file = loop {
        match File::options().write(true).custom_flags(libc::O_NONBLOCK).open(path) {
            Err(error) if error.raw_os_error() == Some(libc::ENXIO) => {
                if start.elapsed() > PATIENCE {
                    return Err(io::Error::new(io::ErrorKind::TimedOut, "it is a pipe that nobody reads"));
                }
                std::thread::sleep(Duration::from_millis(20));
            }
            opened => break opened?,
        }
    };
    // SAFETY: the descriptor is open; writing waits for the reader again.
    unsafe {
        let flags = libc::fcntl(file.as_raw_fd(), libc::F_GETFL);
        libc::fcntl(file.as_raw_fd(), libc::F_SETFL, flags & !libc::O_NONBLOCK);
    }
    Ok(file)
}

#[cfg(not(unix))]
fn open_stream(path: &Path) -> io::Result<File> {
    File::options().write(true).open(path)
}

fn replace<T>(path: &Path, write: impl FnOnce(&mut Writer<'_>) -> io::Result<T>) -> io::Result<T> {
    let (target, mut temporary) = replaceable(path)?;
    let result = fill(temporary.as_file_mut(), write)?;
    if let Ok(old) = fs::metadata(&target) {
        // Where the system keeps none, as on some network folders, the image is still written.
        keep_owner(temporary.as_file(), &old);
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

#[cfg(unix)]
fn keep_owner(file: &File, old: &fs::Metadata) {
    use std::os::unix::fs::{MetadataExt, fchown};
    // Only a privileged user can give files away.
    let _ = fchown(file, Some(old.uid()), Some(old.gid()));
}

#[cfg(not(unix))]
fn keep_owner(_: &File, _: &fs::Metadata) {}

/// The file that is to be replaced, and a temporary one beside it.
fn replaceable(path: &Path) -> io::Result<(PathBuf, NamedTempFile)> {
    let target = target(path)?;
    match File::options().write(true).open(&target) {
        // A file that is protected from being written is not to be replaced either.
        Ok(_) => {}
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(error) => return Err(error),
    }
    let temporary = temporary_beside(&target)?;
    Ok((target, temporary))
}

/// What a path leads to by way of symbolic links, whether it is there or not.
///
/// # Errors
/// The links lead in a circle.
pub fn target(path: &Path) -> io::Result<PathBuf> {
    /// As many as Linux follows.
    const MOST_LINKS: usize = 40;
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&target) {
            Ok(next) => target = target.parent().unwrap_or(Path::new("")).join(next),
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, "its symbolic links lead in a circle"))
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
    fn links_are_followed_to_files_that_are_not_there_yet() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        fs::create_dir(at("disk")).unwrap();
        for (link, to) in [("a", "b"), ("b", "disk/c"), ("round", "about"), ("about", "round"), ("lost", "gone/d")] {
            std::os::unix::fs::symlink(to, at(link)).unwrap();
        }
        check_writable(&at("a")).unwrap();
        write_whole(&at("a"), |w| w.write_all(b"new")).unwrap();
        assert!(at("a").is_symlink() && at("b").is_symlink());
        assert_eq!(fs::read(at("disk/c")).unwrap(), b"new");
        for link in ["round", "lost"] {
            assert!(check_writable(&at(link)).is_err());
            assert!(write_whole(&at(link), |w| w.write_all(b"new")).is_err());
            assert!(at(link).is_symlink());
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_may_not_be_written_is_not_replaced() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.png");
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).unwrap();
        let privileged = File::options().write(true).open(&path).is_ok();
        assert_eq!(check_writable(&path).is_ok(), privileged);
        assert_eq!(write_whole(&path, |w| w.write_all(b"new")).is_ok(), privileged);
        assert_eq!(fs::read(&path).unwrap(), if privileged { b"new" } else { b"old" });
        assert_eq!(names(directory.path()), ["a.png"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_written_while_somebody_reads_and_not_waited_for() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&path).status().unwrap();
        assert!(made.success());
        assert_eq!(read_regular(&path).unwrap_err().kind(), io::ErrorKind::InvalidInput);
        check_writable(&path).unwrap();
        let error = write_whole(&path, |w| w.write_all(b"new")).unwrap_err();
        assert!(error.source.to_string().contains("nobody reads"), "{}", error.source);
        let reader = std::thread::spawn({
            let path = path.clone();
            move || fs::read(path).unwrap()
        });
        let long = vec![7; 1 << 20];
        write_whole(&path, |w| w.write_all(&long)).unwrap();
        assert_eq!(reader.join().unwrap(), long);
    }

    #[test]
    fn what_is_too_large_is_not_read() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a");
        File::create(&path).unwrap().set_len(1 << 42).unwrap();
        assert_eq!(read_small(&path, 1 << 20).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(read_regular(&path).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        fs::write(&path, "abc").unwrap();
        assert_eq!(read_small(&path, 3).unwrap(), b"abc");
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
