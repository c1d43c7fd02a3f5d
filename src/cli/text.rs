//! Numbers and names for people.

use std::borrow::Cow;
use std::fmt::Write as _;

/// A text without what would do something to a terminal: control characters, but for those that are kept, and marks that change the
/// direction of writing, as escapes, which mean the same in JSON.
pub fn printable<'a>(text: &'a str, kept: &[char]) -> Cow<'a, str> {
    let acts = |c: char| {
        let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        (c.is_control() || turns || matches!(c, '\u{2028}' | '\u{2029}')) && !kept.contains(&c)
    };
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' if acts(c) => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            c if acts(c) => {
                // Writing to a String cannot fail; all of these have 16 bits.
                let _ = write!(out, "\\u{:04x}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    Cow::Owned(out)
}

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
    fn nothing_acts_on_a_terminal() {
        assert_eq!(printable("Grün 😀", &[]), "Grün 😀");
        assert_eq!(
            printable("a\x1b[31m\x07\u{9b}2J\r\n\u{202e}b\x7f", &['\n']),
            "a\\u001b[31m\\u0007\\u009b2J\\r\n\\u202eb\\u007f"
        );
        assert_eq!(printable("a\tb\nc", &[]), "a\\tb\\nc");
    }

    #[test]
    fn one_and_several() {
        assert_eq!([0, 1, 2].map(|n| counted(n, "mesh", "meshes")), ["0 meshes", "1 mesh", "2 meshes"]);
    }

    #[test]
    fn sizes() {
        assert_eq!([0, 1023, 1536, 1 << 30, 1 << 52].map(bytes), ["0 B", "1023 B", "1.5 KiB", "1.0 GiB", "4096.0 TiB"]);
    }
}
