//! Choosing one of many by their shares in one step: the alias method.

/// Of each of several shares, which sum to 1 (or are all 0): the part of its column that is its own, and whose the rest
/// is (Walker 1977, in the order of Vose 1991).
pub(super) fn alias_table(shares: &[f64]) -> Vec<(f32, u32)> {
    let n = shares.len();
    let mut heights: Vec<f64> = shares.iter().map(|s| s * n as f64).collect();
    let mut columns: Vec<_> = (0..n as u32).map(|i| (1.0, i)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| heights[i] < 1.0);
    while let (Some(&low), Some(&high)) = (small.last(), large.last()) {
        small.pop();
        columns[low] = (heights[low] as f32, high as u32);
        heights[high] -= 1.0 - heights[low];
        if heights[high] < 1.0 {
            large.pop();
            small.push(high);
        }
    }
    // What is left of `small` is full but for rounding, unless there is nothing to give it.
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_give_each_its_share() {
        let mut random = crate::accel::random_numbers(11);
        for n in [1usize, 2, 8, 64] {
            for _ in 0..100 {
                let raw: Vec<f64> = (0..n).map(|_| f64::from(random()).powi(8)).collect();
                let sum: f64 = raw.iter().sum();
                let shares: Vec<f64> = raw.iter().map(|x| x / sum).collect();
                let mut given = vec![0.0; n];
                for (i, (threshold, alias)) in alias_table(&shares).into_iter().enumerate() {
                    given[i] += f64::from(threshold) / n as f64;
                    given[alias as usize] += (1.0 - f64::from(threshold)) / n as f64;
                }
                for (g, s) in given.iter().zip(&shares) {
                    assert!((g - s).abs() < 1e-6, "{g} for {s} of {n}");
                }
            }
        }
    }
}
