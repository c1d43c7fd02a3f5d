//! Numbers as options take them: each parser says what it expected.

use std::num::NonZeroUsize;
use std::time::Duration;

/// A finite number that is good.
fn number(text: &str, expected: &str, good: impl Fn(f64) -> bool) -> Result<f64, String> {
    text.parse().ok().filter(|&v: &f64| v.is_finite() && good(v)).ok_or_else(|| format!("expected {expected}"))
}

/// Any finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    number(text, "a number", |_| true)
}

/// At least 0.
pub fn not_negative(text: &str) -> Result<f64, String> {
    number(text, "a number of at least 0", |v| v >= 0.0)
}

/// Above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text, "a number above 0", |v| v > 0.0)
}

/// Above 0 and below 1.
pub fn probability(text: &str) -> Result<f64, String> {
    number(text, "a number between 0 and 1", |v| v > 0.0 && v < 1.0)
}

/// Pixels per degree of visual angle, for FLIP, whose filters are as many times larger.
pub fn pixels_per_degree(text: &str) -> Result<f64, String> {
    number(text, "a number of 1 to 1000", |v| (1.0..=1000.0).contains(&v))
}

/// A number of things, at least 1.
pub fn count(text: &str) -> Result<NonZeroUsize, String> {
    text.parse().map_err(|_| "expected an integer of at least 1".to_owned())
}

/// Seconds, above 0.
pub fn seconds(text: &str) -> Result<Duration, String> {
    positive(text)
        .ok()
        .and_then(|s| Duration::try_from_secs_f64(s).ok())
        // As many seconds as there are in 64 bits.
        .ok_or_else(|| "expected a number of seconds above 0 and below 1.8e19".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds() {
        assert_eq!((finite("-2"), not_negative("0"), positive("1e-9")), (Ok(-2.0), Ok(0.0), Ok(1e-9)));
        assert_eq!((probability("0.5"), pixels_per_degree("67")), (Ok(0.5), Ok(67.0)));
        for error in [finite("inf"), not_negative("-1"), positive("0"), probability("1"), pixels_per_degree("0.5")] {
            assert!(error.is_err_and(|e| e.starts_with("expected a number")));
        }
        assert_eq!(count("3").map(usize::from), Ok(3));
        assert_eq!(seconds("0.25"), Ok(Duration::from_millis(250)));
        for error in [count("0").err(), seconds("nan").err(), seconds("0").err(), seconds("1e30").err()] {
            assert!(error.is_some_and(|e| e.starts_with("expected a")));
        }
    }
}
