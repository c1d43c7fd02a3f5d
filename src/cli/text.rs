//! Numbers for people.

/// A number of things: `1 sphere`, `2 spheres`.
pub fn counted(n: usize, one: &str, several: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { several })
}

/// A size in bytes, with the unit that suits it.
pub fn bytes(n: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut value = n as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 { format!("{n} B") } else { format!("{value:.1} {}", UNITS[unit]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_and_several() {
        assert_eq!([0, 1, 2].map(|n| counted(n, "mesh", "meshes")), ["0 meshes", "1 mesh", "2 meshes"]);
    }

    #[test]
    fn sizes() {
        assert_eq!([0, 1023, 1536, 1 << 30, 1 << 52].map(bytes), ["0 B", "1023 B", "1.5 KiB", "1.0 GiB", "4096.0 TiB"]);
    }
}
