//! Signals.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

#[cfg(unix)]
pub use unix::{Deadline, fail_at_the_size_limit_of_files, set_when_asked_to_end};

/// How long a command that is asked to end may take for it. Who asks waits for 30 s before he kills (Slurm, Kubernetes).
const GRACE: Duration = Duration::from_secs(25);
/// What is said when that is over.
const LATE: &str = "photolith: asked to end, but the driver has not come back: nothing more can be written\n";
/// What is said at a [`Deadline`].
const STUCK: &str = "photolith: the driver did not compile the kernels within the limit of time\n";

#[cfg(unix)]
mod unix {
    use std::io;
    use std::ptr;
    use std::sync::OnceLock;
    use std::sync::atomic::Ordering;
    use std::time::Duration;

    use anyhow::Context as _;

    use super::{Arc, AtomicBool, GRACE, LATE, STUCK};
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
        // SAFETY: the handler does only what a handler may.
        unsafe { libc::signal(libc::SIGALRM, on_alarm as *const () as libc::sighandler_t) };
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
        // SAFETY: may be called in a handler.
        unsafe { libc::alarm(GRACE.as_secs() as libc::c_uint) };
    }

    fn was_asked() -> bool {
        ASKED.get().is_some_and(|asked| asked.load(Ordering::SeqCst))
    }

    extern "C" fn on_alarm(_: libc::c_int) {
        let (text, code) = if was_asked() { (LATE, exit::INTERRUPTED) } else { (STUCK, exit::TIMEOUT) };
        // SAFETY: both may be called in a handler; the text is a constant.
        unsafe {
            libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len());
            libc::_exit(i32::from(code));
        }
    }

    /// While it is there, a driver compiles: when the time is over, the program ends with the code of a timeout. Nothing else ends a
    /// driver that does not come back.
    pub struct Deadline(());

    impl Deadline {
        /// From now on.
        pub fn after(limit: Duration) -> Self {
            let seconds = libc::c_uint::try_from(limit.as_secs().max(1)).unwrap_or(libc::c_uint::MAX);
            // SAFETY: its handler is installed with those of requests.
            unsafe { libc::alarm(seconds) };
            Self(())
        }
    }

    impl Drop for Deadline {
        fn drop(&mut self) {
            // Who was asked to end has another.
            if !was_asked() {
                // SAFETY: it takes the alarm back.
                unsafe { libc::alarm(0) };
            }
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
        end_after(GRACE, LATE, super::exit::INTERRUPTED, Arc::new(AtomicBool::new(false)));
    };
    ctrlc::set_handler(on_request).context("installing the handler of Ctrl-C")
}

/// Ends the program after some time, unless that is called off.
#[cfg(not(unix))]
fn end_after(limit: Duration, text: &'static str, code: u8, called_off: Arc<AtomicBool>) {
    std::thread::spawn(move || {
        std::thread::sleep(limit);
        if !called_off.load(std::sync::atomic::Ordering::SeqCst) {
            eprint!("{text}");
            std::process::exit(i32::from(code));
        }
    });
}

/// While it is there, a driver compiles: when the time is over, the program ends with the code of a timeout.
#[cfg(not(unix))]
pub struct Deadline(Arc<AtomicBool>);

#[cfg(not(unix))]
impl Deadline {
    /// From now on.
    pub fn after(limit: Duration) -> Self {
        let called_off = Arc::new(AtomicBool::new(false));
        end_after(limit, STUCK, super::exit::TIMEOUT, Arc::clone(&called_off));
        Self(called_off)
    }
}

#[cfg(not(unix))]
impl Drop for Deadline {
    fn drop(&mut self) {
        self.0.store(true, std::sync::atomic::Ordering::SeqCst);
    }
}
