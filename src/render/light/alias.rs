//! Choosing one of many by their shares in one step: the alias method.

/// A random number of the shaders is one of so many (`unit_float` of shaders/lib/sampler.glsl).
const NUMBERS: u64 = 1 << 24;

/// A column of the table: with u in [0, 1), of n columns number ⌊n·u⌋ is met; where the rest of n·u is less than `threshold`,
/// what is chosen is that of this column, else that of column `alias`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Column {
    pub threshold: f32,
    pub alias: u32,
    /// Probability, exact, of what this column is for: about the share that was asked for, since there are only so many numbers.
    pub share: f64,
}

/// The table of these shares, which sum to 1 or are all 0 (Walker 1977, in the order of Vose 1991). Its length is the next power
/// of two, so that in the shaders nothing is rounded. What has a share is never left out.
///
/// # Panics
/// If there are more shares than random numbers.
pub(crate) fn alias_table(shares: &[f64]) -> Vec<Column> {
    let n = shares.len().next_power_of_two();
    let height = NUMBERS / n as u64;
    assert!(height > 0, "{n} shares");
    let mut counts = counts(shares);
    counts.resize(n, 0);
    let column =
        |(i, &count): (usize, &u64)| Column { threshold: 1.0, alias: i as u32, share: count as f64 / NUMBERS as f64 };
    let mut columns: Vec<_> = counts.iter().enumerate().map(column).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| counts[i] < height);
    while let (Some(&low), Some(&high)) = (small.last(), large.last()) {
        small.pop();
        columns[low].threshold = (counts[low] as f64 / height as f64) as f32;
        columns[low].alias = high as u32;
        counts[high] -= height - counts[low];
        if counts[high] < height {
            large.pop();
            small.push(high);
        }
    }
    columns
}

/// How many of all numbers choose each: at least one where there is a share. They sum to all, unless no share is positive.
fn counts(shares: &[f64]) -> Vec<u64> {
    let positive = shares.iter().filter(|&&s| s > 0.0).count() as u64;
    let rest = NUMBERS - positive;
    let count = |&share: &f64| if share > 0.0 { 1 + ((share * rest as f64) as u64).min(rest) } else { 0 };
    let mut counts: Vec<u64> = shares.iter().map(count).collect();
    let sum: u64 = counts.iter().sum();
    if let Some(largest) = counts.iter_mut().max().filter(|count| **count > 0) {
        // Rounding has left numbers over; shares that sum to a little more than 1 have taken too many.
        *largest = (*largest + NUMBERS).saturating_sub(sum).max(1);
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of all numbers choose each, by the shaders' arithmetic in single precision.
    fn chosen(columns: &[Column]) -> Vec<u64> {
        let mut chosen = vec![0; columns.len()];
        for number in 0..NUMBERS {
            let place = number as f32 / NUMBERS as f32 * columns.len() as f32;
            let column = &columns[place as usize];
            let own = place - place.floor() < column.threshold;
            chosen[if own { place as usize } else { column.alias as usize }] += 1;
        }
        chosen
    }

    #[test]
    fn probabilities_are_exact_and_near_the_shares() {
        let mut random = crate::accel::random_numbers(11);
        for (n, power) in [(1usize, 1), (2, 8), (3, 1), (64, 20), (1000, 3), (65_536, 30)] {
            let raw: Vec<f64> = (0..n).map(|_| f64::from(random()).powi(power)).collect();
            let sum: f64 = raw.iter().sum();
            let mut shares: Vec<f64> = raw.iter().map(|x| x / sum).collect();
            if n > 2 {
                // The sum stays about 1.
                shares[1] += shares[0];
                shares[0] = 0.0;
            }
            let columns = alias_table(&shares);
            assert_eq!(columns.len(), n.next_power_of_two());
            for (i, (column, count)) in columns.iter().zip(chosen(&columns)).enumerate() {
                assert_eq!(column.share, count as f64 / NUMBERS as f64, "{i} of {n}");
                let wanted = shares.get(i).copied().unwrap_or(0.0);
                assert_eq!(column.share > 0.0, wanted > 0.0, "{wanted} of {n}");
                assert!((column.share - wanted).abs() <= 2.0 * n as f64 / NUMBERS as f64, "{column:?} for {wanted}");
            }
        }
    }

    #[test]
    fn weak_lights_do_not_take_what_the_only_strong_one_has() {
        let mut shares = vec![1e-12; 60_000];
        shares[7] = 1.0 - 60_000.0 * 1e-12;
        let columns = alias_table(&shares);
        assert_eq!(columns.iter().map(|c| c.share).sum::<f64>(), 1.0);
        assert!(columns[7].share > 0.99);
    }

    #[test]
    fn without_shares_nothing_is_likely() {
        assert!(alias_table(&[0.0; 8]).iter().all(|column| column.share == 0.0));
    }
}
