//! Lists of sample counts.

use std::str::FromStr;

/// `N`, `A..B` or `A,B,C`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SampleCounts(Vec<u32>, bool);

impl SampleCounts {
    /// The counts, increasing, where `least` can be rendered; a single N means `least` to N, doubling.
    ///
    /// # Errors
    /// There are fewer, or none.
    pub fn doubling(self, least: u32) -> Result<Vec<u32>, String> {
        let fewest = self.0.first().copied().unwrap_or(0);
        match self.single() {
            _ if fewest < least => Err(format!("found {fewest}, expected at least {least} samples per pixel")),
            Some(most) => Ok(double(least, most)),
            None => Ok(self.0),
        }
    }

    /// What is measured if nothing else is asked for: `least` to 64.
    pub fn usual(least: u32) -> Self {
        Self(double(least, 64), false)
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
        assert_eq!(parse("20").doubling(1).unwrap(), [1, 2, 4, 8, 16]);
        assert_eq!(parse("20").doubling(4).unwrap(), [4, 8, 16]);
        assert_eq!(parse("20").single(), Some(20));
        assert_eq!(parse("3..24").doubling(1).unwrap(), [3, 6, 12, 24]);
        assert_eq!(parse("16,4,4").doubling(4).unwrap(), [4, 16]);
        for few in ["3", "2..64", "16,3"] {
            assert!(parse(few).doubling(4).unwrap_err().contains("expected at least 4"), "{few}");
        }
        assert_eq!(parse("16,4").single(), None);
        assert_eq!(SampleCounts::usual(4).doubling(4).unwrap(), [4, 8, 16, 32, 64]);
        for bad in ["", "0", "x", "1,,2", "8..4", "1..", "2000000"] {
            assert!(bad.parse::<SampleCounts>().is_err(), "{bad}");
        }
    }
}
