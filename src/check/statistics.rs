//! Tests of means, of distributions and of correlation, for fixed seeds.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// |mean − expected| in standard errors, where `values` are independent; infinite if they do not vary and are off.
pub(crate) fn z_score(values: &[f64], expected: f64) -> f64 {
    let (mean, error) = mean_and_error(values);
    let off = (mean - expected).abs();
    // Rounding alone makes no deviation.
    let floor = 1e-6 * expected.abs().max(f64::MIN_POSITIVE);
    if off <= floor && error <= floor { 0.0 } else { off / error }
}

/// Mean and its standard error.
pub(crate) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, (squares / (n * (n - 1.0))).sqrt())
}

/// |difference of means| in standard errors (Welch).
pub(crate) fn welch(a: &[f64], b: &[f64]) -> f64 {
    let ((ma, ea), (mb, eb)) = (mean_and_error(a), mean_and_error(b));
    let error = (ea * ea + eb * eb).sqrt();
    if ma == mb { 0.0 } else { (ma - mb).abs() / error }
}

/// p-value of counts against expected counts (Pearson's χ²); cells with fewer than 5 expected are pooled.
pub(crate) fn chi_squared_p(counts: &[f64], expected: &[f64]) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0usize);
    let (mut pooled, mut pooled_expected) = (0.0, 0.0);
    for (&count, &expected) in counts.iter().zip(expected) {
        if expected < 5.0 {
            pooled += count;
            pooled_expected += expected;
        } else {
            statistic += (count - expected) * (count - expected) / expected;
            cells += 1;
        }
    }
    if pooled_expected >= 5.0 {
        statistic += (pooled - pooled_expected) * (pooled - pooled_expected) / pooled_expected;
        cells += 1;
    } else if pooled > 5.0 + 5.0 * pooled_expected {
        // Mass where there should be next to none.
        return 0.0;
    }
    match ChiSquared::new(cells.saturating_sub(1).max(1) as f64) {
        Ok(distribution) => distribution.sf(statistic),
        Err(_) => f64::NAN,
    }
}

/// Pearson's correlation coefficient.
pub(crate) fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len() as f64;
    let (mx, my) = pairs.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        xx += (x - mx) * (x - mx);
        yy += (y - my) * (y - my);
        xy += (x - mx) * (y - my);
    }
    xy / (xx * yy).sqrt()
}

/// Kolmogorov–Smirnov distance of a sorted sample from the uniform distribution on [0, 1), times √n.
pub(crate) fn kolmogorov(sorted: &[f64]) -> f64 {
    let n = sorted.len() as f64;
    let far = |(i, &x): (usize, &f64)| (x - i as f64 / n).abs().max((x - (i + 1) as f64 / n).abs());
    worst(sorted.iter().enumerate().map(far)) * n.sqrt()
}

/// |a − b| / |b|; 0 where both are 0.
pub(crate) fn relative(a: f64, b: f64) -> f64 {
    if a == b { 0.0 } else { ((a - b) / b).abs() }
}

/// The least of probabilities, or NaN if there is one.
pub(crate) fn least(probabilities: &[f64]) -> f64 {
    probabilities.iter().fold(1.0, |a: f64, &b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.min(b) })
}

/// The largest, or NaN if there is one: f64::max would hide it.
pub(crate) fn worst(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |a: f64, b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chi_squared_accepts_the_right_and_rejects_the_wrong() {
        let expected = [100.0; 10];
        let fair = [96.0, 104.0, 110.0, 90.0, 100.0, 103.0, 97.0, 92.0, 108.0, 100.0];
        assert!(chi_squared_p(&fair, &expected) > 0.5);
        let loaded = [160.0, 60.0, 100.0, 100.0, 100.0, 100.0, 100.0, 100.0, 100.0, 80.0];
        assert!(chi_squared_p(&loaded, &expected) < 1e-6);
        assert_eq!(chi_squared_p(&[100.0, 50.0], &[100.0, 0.0]), 0.0);
    }

    #[test]
    fn scores() {
        assert_eq!(z_score(&[2.0, 2.0, 2.0], 2.0), 0.0);
        assert_eq!(z_score(&[2.0, 2.0, 2.0], 1.0), f64::INFINITY);
        assert!((z_score(&[1.0, 3.0, 1.0, 3.0], 2.0)).abs() < 1e-12);
        assert!((correlation(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]) - 1.0).abs() < 1e-12);
        assert!(worst([1.0, f64::NAN, 2.0]).is_nan());
        assert!(least(&[0.5, f64::NAN, 0.1]).is_nan());
        assert_eq!(least(&[0.5, 0.1]), 0.1);
        assert!(kolmogorov(&[0.5, f64::NAN]).is_nan());
        assert!(worst([0.0, correlation(&[(0.5, 0.0), (0.5, 1.0)])]).is_nan(), "what does not vary");
        assert!(chi_squared_p(&[10.0, 10.0], &[10.0, f64::NAN]).is_nan());
        assert_eq!(kolmogorov(&[0.5]), 0.5);
    }
}
