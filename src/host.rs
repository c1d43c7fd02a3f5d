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
