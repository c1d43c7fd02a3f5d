//! Versions of drivers, and ranges of them.

use std::cmp::Ordering;

use serde::Deserialize;

/// The first version in a driver's text, such as 22.3.6 in "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)".
pub(super) fn version_of(driver: &str) -> Option<Vec<u32>> {
    let is_of_number = |c: char| c.is_ascii_digit() || c == '.';
    driver
        .split(|c: char| c.is_whitespace() || "()-+~,".contains(c))
        .filter(|word| word.contains('.') && word.chars().all(is_of_number))
        .find_map(|word| word.split('.').map(|part| part.parse().ok()).collect())
}

/// Versions between bounds, such as `>=24.1, <25.1`. A version counts with as many parts as the bound has, so that 25.0.7
/// is `=25.0` and `<=25.0`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct VersionRange(Vec<(Comparison, Vec<u32>)>);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Comparison {
    Equal,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

/// Longer signs first.
const SIGNS: [(&str, Comparison); 5] = [
    (">=", Comparison::GreaterOrEqual),
    ("<=", Comparison::LessOrEqual),
    (">", Comparison::Greater),
    ("<", Comparison::Less),
    ("=", Comparison::Equal),
];

impl TryFrom<String> for VersionRange {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let bound = |part: &str| {
            let part = part.trim();
            let (rest, comparison) = SIGNS.iter().find_map(|(sign, c)| Some((part.strip_prefix(sign)?, *c)))?;
            let version = rest.trim().split('.').map(|part| part.parse().ok()).collect::<Option<Vec<u32>>>()?;
            Some((comparison, version))
        };
        let bounds = text.split(',').map(bound).collect::<Option<_>>();
        bounds.map(Self).ok_or_else(|| format!("version '{text}', expected bounds such as \">=24.1, <25.1\""))
    }
}

impl VersionRange {
    /// Whether a version is in it.
    pub(super) fn contains(&self, version: &[u32]) -> bool {
        self.0.iter().all(|(comparison, bound)| {
            let part = |i: usize| version.get(i).copied().unwrap_or(0);
            let order = (0..bound.len()).map(|i| part(i).cmp(&bound[i])).find(|o| o.is_ne()).unwrap_or(Ordering::Equal);
            match comparison {
                Comparison::Equal => order.is_eq(),
                Comparison::Less => order.is_lt(),
                Comparison::LessOrEqual => order.is_le(),
                Comparison::Greater => order.is_gt(),
                Comparison::GreaterOrEqual => order.is_ge(),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_of_drivers() {
        for (driver, version) in [
            ("llvmpipe Mesa 22.3.6 (LLVM 15.0.6)", Some(vec![22, 3, 6])),
            ("llvmpipe Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)", Some(vec![25, 0, 7])),
            ("NVIDIA 580.159", Some(vec![580, 159])),
            ("SwiftShader driver 5.0.0", Some(vec![5, 0, 0])),
            ("Mesa git", None),
            ("", None),
        ] {
            assert_eq!(version_of(driver), version, "{driver}");
        }
    }

    #[test]
    fn ranges() {
        let range = |text: &str| VersionRange::try_from(text.to_owned());
        let inside = |text, version: &[u32]| range(text).unwrap().contains(version);
        assert!(inside(">=24.1, <25.1", &[25, 0, 7]) && inside("=25.0", &[25, 0, 7]) && inside("<=25.0", &[25, 0, 7]));
        assert!(inside(">=25", &[25]) && inside("=5.0.0", &[5]) && inside(">24", &[25, 0]));
        assert!(!inside(">=24.1, <25.1", &[25, 1, 0]) && !inside(">25.0", &[25, 0, 7]) && !inside("<25", &[25, 9]));
        for bad in ["", "24", ">=", ">=24.x", ">=24,", "~24"] {
            assert!(range(bad).unwrap_err().contains("expected bounds"), "{bad}");
        }
    }
}
