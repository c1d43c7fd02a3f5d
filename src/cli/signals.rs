//! Signals whose default is to end the program without a word.

/// A file that grows beyond `ulimit -f` is an error like a full disk, whose temporary file is removed.
#[cfg(unix)]
pub fn fail_at_the_size_limit_of_files() {
    // SAFETY: to ignore a signal changes nothing but what the system does at it.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
}

/// Other systems have no such signal.
#[cfg(not(unix))]
pub fn fail_at_the_size_limit_of_files() {}
