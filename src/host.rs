//! The machine that the program runs on.

/// The CPU's model, where the system tells (it is Linux that does).
pub(crate) fn cpu_model() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// Whether the CPU permutes the eight lanes of a vector of 256 bits in one instruction (AVX2).
#[cfg(target_arch = "x86_64")]
pub(crate) fn permutes_lanes() -> bool {
    is_x86_feature_detected!("avx2")
}

#[cfg(not(target_arch = "x86_64"))]
pub(crate) fn permutes_lanes() -> bool {
    false
}

/// Bytes of memory that the program can still have, by what the system, its control group and `ulimit` allow; `None` where that is
/// not known.
pub fn available_memory() -> Option<u64> {
    let of_system = || -> Option<u64> {
        let text = std::fs::read_to_string("/proc/meminfo").ok()?;
        // What is written to disk for others' sake counts too.
        kilobytes(&text, "MemAvailable")?.checked_add(kilobytes(&text, "SwapFree").unwrap_or(0))
    };
    [of_system(), of_control_group(), of_address_space()].into_iter().flatten().min()
}

/// Bytes that the line `key:` of a file of /proc states in kilobytes.
fn kilobytes(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// What this process' control group (version 2) and those above it leave.
fn of_control_group() -> Option<u64> {
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let path = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    let number =
        |folder: &std::path::Path, file| std::fs::read_to_string(folder.join(file)).ok()?.trim().parse::<u64>().ok();
    let group = std::path::Path::new("/sys/fs/cgroup").join(path.trim_start_matches('/'));
    // What is kept of files is given back when memory is asked for.
    let of_files = |folder: &std::path::Path| -> Option<u64> {
        let text = std::fs::read_to_string(folder.join("memory.stat")).ok()?;
        text.lines().find_map(|line| line.strip_prefix("file "))?.trim().parse().ok()
    };
    let left = |folder: &std::path::Path| {
        // The word "max" is no number: there is no limit.
        let most = number(folder, "memory.max")?;
        let used = number(folder, "memory.current")?.saturating_sub(of_files(folder).unwrap_or(0));
        Some(most.saturating_sub(used))
    };
    group.ancestors().take_while(|folder| folder.starts_with("/sys/fs/cgroup")).filter_map(left).min()
}

/// What `ulimit -v` leaves.
#[cfg(target_os = "linux")]
fn of_address_space() -> Option<u64> {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: the structure is valid for the call.
    let result = unsafe { libc::getrlimit(libc::RLIMIT_AS, &mut limit) };
    if result != 0 || limit.rlim_cur == libc::RLIM_INFINITY {
        return None;
    }
    let used = kilobytes(&std::fs::read_to_string("/proc/self/status").ok()?, "VmSize")?;
    Some(limit.rlim_cur.saturating_sub(used))
}

#[cfg(not(target_os = "linux"))]
fn of_address_space() -> Option<u64> {
    None
}

/// The name of the machine, where it has one.
pub(crate) fn host_name() -> Option<String> {
    let name =
        std::fs::read_to_string("/proc/sys/kernel/hostname").ok().or_else(|| std::env::var("COMPUTERNAME").ok())?;
    let name = name.trim();
    (!name.is_empty()).then(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_is_known_and_no_more_than_there_can_be() {
        let bytes = available_memory().expect("Linux tells");
        assert!((1 << 20..1 << 50).contains(&bytes), "{bytes}");
    }
}
