//! Lists of sample counts.

use std::str::FromStr;

/// `N`, `A..B` or `A,B,C`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SampleCounts(Vec<u32>, bool);

impl Default for SampleCounts {
    fn default() -> Self {
        Self(double(1, 64), false)
    }
}

impl SampleCounts {
    /// The counts, increasing; a single N means 1 to N, doubling.
    pub fn doubling(self) -> Vec<u32> {
        match (self.single(), self.0) {
            (Some(most), _) => double(1, most),
            (None, counts) => counts,
        }
    }

    /// The number, if only one was given.
    pub fn single(&self) -> Option<u32> {
        if self.1 { self.0.first().copied() } else { None }
    }
}

/// `from`, twice that, … not above `to`.
fn double(from: u32, to: u32) -> Vec<u32> {
    std::iter::successors(Some(from), |n| n.checked_mul(2)).take_while(|&n| n <= to).collect()
}

impl FromStr for SampleCounts {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let error =
            || format!("'{text}' is not a list of sample counts, expected N, A..B or A,B,C with 1 to 1048576 each");
        let number = |t: &str| t.trim().parse().ok().filter(|n| (1..=1 << 20).contains(n)).ok_or_else(error);
        if let Some((from, to)) = text.split_once("..") {
            let (from, to) = (number(from)?, number(to)?);
            return if from <= to { Ok(Self(double(from, to), false)) } else { Err(error()) };
        }
        let mut counts = text.split(',').map(number).collect::<Result<Vec<u32>, _>>()?;
        counts.sort_unstable();
        counts.dedup();
        Ok(Self(counts, !text.contains(',')))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists() {
        let parse = |t: &str| t.parse::<SampleCounts>().unwrap();
        assert_eq!(parse("20").doubling(), [1, 2, 4, 8, 16]);
        assert_eq!(parse("20").single(), Some(20));
        assert_eq!(parse("3..24").doubling(), [3, 6, 12, 24]);
        assert_eq!(parse("16,4,4").doubling(), [4, 16]);
        assert_eq!(parse("16,4").single(), None);
        assert_eq!(SampleCounts::default().doubling().last(), Some(&64));
        for bad in ["", "0", "x", "1,,2", "8..4", "1..", "2000000"] {
            assert!(bad.parse::<SampleCounts>().is_err(), "{bad}");
        }
    }
}
