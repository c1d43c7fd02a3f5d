//! Where a measurement was made.

use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::Serialize;

use crate::gpu::Context;
use crate::host::cpu_model;

/// What a measured number depends on besides the program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Vulkan device.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// The CPU's model, where the system tells.
    pub cpu: Option<String>,
    /// Threads that the process may use.
    pub threads: usize,
    /// Version of photolith.
    pub version: String,
    /// `git describe` of the checkout that the program was built from, as it is now; `None` if that folder is none any more.
    pub commit: Option<String>,
    /// Day of the measurement (UTC), YYYY-MM-DD.
    pub date: String,
}

impl Machine {
    /// This machine, with the device of `context`.
    pub fn of(context: &Context) -> Self {
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
        Self {
            device: context.info().name.clone(),
            driver: context.info().driver.clone(),
            cpu: cpu_model(),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: commit(Path::new(env!("CARGO_MANIFEST_DIR"))),
            date: date(seconds / 86_400),
        }
    }
}

/// CPU time of all threads of this process, seconds; 0 where the system does not tell (it is Linux that does).
pub(super) fn cpu_seconds() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let nanoseconds = threads.filter_map(|thread| {
        // "time on the CPU, time in the queue, slices" (Linux, Documentation/scheduler/sched-stats.rst).
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<u64>().ok()
    });
    nanoseconds.sum::<u64>() as f64 * 1e-9
}

/// `git describe` of a checkout; `None` for a folder that is none itself, although it may be in one.
fn commit(checkout: &Path) -> Option<String> {
    let mut git = Command::new("git");
    git.arg("--git-dir").arg(checkout.join(".git")).arg("--work-tree").arg(checkout);
    let output = git.args(["describe", "--always", "--dirty"]).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    (output.status.success() && !text.trim().is_empty()).then(|| text.trim().to_owned())
}

/// The Gregorian date so many days after 1970-01-01 (Hinnant, "chrono-compatible low-level date algorithms").
fn date(days: u64) -> String {
    let z = days + 719_468;
    let (era, day_of_era) = (z / 146_097, z % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    // Years begin in March, so that the leap day is the last.
    let march_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_commit_is_that_of_a_checkout_and_of_no_folder_around() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        assert_eq!(commit(root).is_some(), root.join(".git").exists());
        assert_eq!(commit(&root.join("src")), None);
        assert_eq!(commit(&root.join("gone")), None);
    }

    #[test]
    fn dates() {
        for (days, text) in [(0, "1970-01-01"), (59, "1970-03-01"), (11_016, "2000-02-29"), (20_454, "2026-01-01")] {
            assert_eq!(date(days), text);
        }
    }
}
