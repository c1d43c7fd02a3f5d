//! Signals.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

#[cfg(unix)]
pub use unix::{fail_at_the_size_limit_of_files, set_when_asked_to_end};

#[cfg(unix)]
mod unix {
    use std::io;
    use std::ptr;
    use std::sync::OnceLock;
    use std::sync::atomic::Ordering;

    use anyhow::Context as _;

    use super::{Arc, AtomicBool};
    use crate::cli::exit;

    /// What ask a program to end: Ctrl-C, `kill`, a terminal that is closed.
    const REQUESTS: [libc::c_int; 3] = [libc::SIGINT, libc::SIGTERM, libc::SIGHUP];

    static ASKED: OnceLock<Arc<AtomicBool>> = OnceLock::new();

    /// A file that grows beyond `ulimit -f` is an error like a full disk, whose temporary file is removed.
    pub fn fail_at_the_size_limit_of_files() {
        // SAFETY: to ignore a signal changes nothing but what the system does at it.
        unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
    }

    /// Sets `asked` when the program is asked to end, and ends it when it is asked again. A signal that is ignored, as by `nohup` or
    /// in jobs of a script, stays ignored. Once in a process.
    ///
    /// # Errors
    /// The system refuses.
    pub fn set_when_asked_to_end(asked: Arc<AtomicBool>) -> anyhow::Result<()> {
        ASKED.get_or_init(|| asked);
        REQUESTS.into_iter().try_for_each(listen).context("installing the handler of Ctrl-C")
    }

    fn listen(signal: libc::c_int) -> io::Result<()> {
        let done = |result: libc::c_int| if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) };
        // SAFETY: both structures are valid for the calls, all zeros being one; the handler does only what a handler may.
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            done(libc::sigaction(signal, ptr::null(), &mut action))?;
            if action.sa_sigaction == libc::SIG_IGN {
                return Ok(());
            }
            action = std::mem::zeroed();
            action.sa_sigaction = on_request as *const () as libc::sighandler_t;
            // Calls that wait go on waiting: the program looks at the flag.
            action.sa_flags = libc::SA_RESTART;
            done(libc::sigaction(signal, &action, ptr::null_mut()))
        }
    }

    extern "C" fn on_request(_: libc::c_int) {
        if ASKED.get().is_some_and(|asked| asked.swap(true, Ordering::SeqCst)) {
            // Whoever insists does not want what there is. What a driver would do at an ordinary exit may not end.
            // SAFETY: may be called in a handler.
            unsafe { libc::_exit(i32::from(exit::INTERRUPTED)) };
        }
    }
}

/// Other systems have no such signal.
#[cfg(not(unix))]
pub fn fail_at_the_size_limit_of_files() {}

/// Sets `asked` when the program is asked to end, and ends it when it is asked again. Once in a process.
///
/// # Errors
/// The system refuses.
#[cfg(not(unix))]
pub fn set_when_asked_to_end(asked: Arc<AtomicBool>) -> anyhow::Result<()> {
    use anyhow::Context as _;
    let on_request = move || {
        if asked.swap(true, std::sync::atomic::Ordering::SeqCst) {
            std::process::exit(i32::from(super::exit::INTERRUPTED));
        }
    };
    ctrlc::set_handler(on_request).context("installing the handler of Ctrl-C")
}
