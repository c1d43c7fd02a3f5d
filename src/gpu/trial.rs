//! Drivers that may compile a kernel for hours: whether one comes to an end is tried in a process of its own, which the system ends
//! after some seconds. Nothing else ends a compiler.
//!
//! SwiftShader looks for ways through the body of each loop and marks a block as seen when it leaves it, not when it finds
//! it (`Spirv::Function::ExistsPath`): two ways of equal length to a block make two of all that follows, so that a loop
//! with many branches takes exponential time. How many are left after its optimiser cannot be told beforehand.

use ash::vk::DriverId;

use crate::gpu::error::GpuError;
use crate::gpu::select::DeviceInfo;

/// Seconds of CPU time that a kernel may take: those that are compiled at all take less than one, mostly.
#[cfg_attr(not(unix), allow(dead_code))]
const LIMIT: u64 = 2;

/// Compiles a kernel by `make`, after a trial where the driver is such a one.
///
/// # Errors
/// It takes too long; and those of `make`.
pub(super) fn compile<T>(
    device: &DeviceInfo,
    kernel: &str,
    make: impl Fn() -> Result<T, GpuError>,
) -> Result<T, GpuError> {
    #[cfg(unix)]
    if device.driver_id == DriverId::GOOGLE_SWIFTSHADER.as_raw() {
        // One at a time: what another thread has locked in the driver would stay locked in the new process.
        static TURN: std::sync::Mutex<()> = std::sync::Mutex::new(());
        let _turn = TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if !ends(LIMIT, || drop(make())) {
            return Err(GpuError::CompilesTooLong {
                kernel: kernel.to_owned(),
                seconds: LIMIT,
                device: device.name.clone(),
            });
        }
        return make();
    }
    let _ = kernel;
    make()
}

/// Whether something ends within so many seconds of CPU time, tried in a process of its own, in which it has no effect on this one.
#[cfg(unix)]
fn ends(limit: u64, work: impl FnOnce()) -> bool {
    use std::time::{Duration, Instant};

    /// Of what waits and takes no CPU time.
    const LONGEST_WAIT: Duration = Duration::from_secs(30);

    // SAFETY: the child does nothing but the work, under limits of its own, and leaves at once without what is done at an ordinary
    // exit; only this thread is in it, and what others had locked it does not need.
    let child = unsafe {
        let child = libc::fork();
        if child == 0 {
            let set = |resource, seconds| {
                let limit = libc::rlimit { rlim_cur: seconds, rlim_max: seconds };
                libc::setrlimit(resource, &limit);
            };
            set(libc::RLIMIT_CORE, 0);
            set(libc::RLIMIT_CPU, limit);
            work();
            libc::_exit(0);
        }
        child
    };
    if child < 0 {
        // No process to be had: then without a trial.
        return true;
    }
    let start = Instant::now();
    loop {
        let mut status = 0;
        // SAFETY: the child is this process's own, and is waited for once.
        let waited = unsafe { libc::waitpid(child, &mut status, libc::WNOHANG) };
        if waited == child {
            return libc::WIFEXITED(status) && libc::WEXITSTATUS(status) == 0;
        }
        if waited < 0 || start.elapsed() > LONGEST_WAIT {
            // SAFETY: as above.
            unsafe {
                libc::kill(child, libc::SIGKILL);
                libc::waitpid(child, &mut status, 0);
            }
            return false;
        }
        std::thread::sleep((start.elapsed() / 8).clamp(Duration::from_micros(200), Duration::from_millis(20)));
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_end_is_ended() {
        assert!(ends(1, || ()));
        let mut sum = 0u64;
        let forever = || {
            while std::hint::black_box(true) {
                sum = std::hint::black_box(sum.wrapping_add(1));
            }
        };
        assert!(!ends(1, forever));
        assert_eq!(sum, 0, "it was another process's");
    }
}
