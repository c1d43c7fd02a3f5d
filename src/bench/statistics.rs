//! Medians, and lines through points with an interval.

use serde::Serialize;

use crate::image::metrics::CONFIDENCE;
use crate::image::metrics::student::two_sided_quantile;

/// The middle value; the mean of the two middle ones for an even count; NaN for none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    match n {
        0 => f64::NAN,
        _ if n % 2 == 1 => sorted[n / 2],
        _ => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

/// A mean and half the width of its interval of confidence [`CONFIDENCE`] by Student's t.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Standard error of the mean; `None` for a single value.
    pub standard_error: Option<f64>,
    /// Half the interval's width; `None` for a single value.
    pub half_width: Option<f64>,
}

impl Mean {
    /// Of independent values, at least one.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let standard_error =
            (values.len() > 1).then(|| (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt());
        Self { mean, standard_error, half_width: standard_error.map(|e| e * two_sided_quantile(CONFIDENCE, n - 1.0)) }
    }
}

/// y ∝ x^exponent, fitted by least squares in logarithms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PowerLaw {
    /// The slope in a log–log plot.
    pub exponent: f64,
    /// Half the width of its interval of confidence [`CONFIDENCE`], from the distances of the points to the line:
    /// curvature widens it. `None` for two points.
    pub half_width: Option<f64>,
    /// y at x = 1.
    pub factor: f64,
    /// Points that were used: both coordinates positive and finite.
    pub points: usize,
}

impl PowerLaw {
    /// Fits; `None` for fewer than two different x.
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let usable = |v: f64| v > 0.0 && v.is_finite();
        let logs: Vec<_> =
            points.iter().filter(|(x, y)| usable(*x) && usable(*y)).map(|(x, y)| (x.ln(), y.ln())).collect();
        let n = logs.len() as f64;
        let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
        let sxx: f64 = logs.iter().map(|p| (p.0 - mx).powi(2)).sum();
        // Fewer than two different x: the sum is 0, or NaN for no points.
        if sxx.is_nan() || sxx <= 0.0 {
            return None;
        }
        let exponent = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / sxx;
        let residuals: f64 = logs.iter().map(|p| (p.1 - my - exponent * (p.0 - mx)).powi(2)).sum();
        let half_width =
            (logs.len() > 2).then(|| two_sided_quantile(CONFIDENCE, n - 2.0) * (residuals / (n - 2.0) / sxx).sqrt());
        Some(Self { exponent, half_width, factor: (my - exponent * mx).exp(), points: logs.len() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn means_with_the_interval_of_the_printed_table() {
        let m = Mean::of(&[1.0, 2.0, 3.0]);
        // s = 1, t(0.975, 2) = 4.302653.
        assert_eq!(m.mean, 2.0);
        assert!((m.half_width.unwrap() - 4.302_653 / 3f64.sqrt()).abs() < 1e-5);
        assert_eq!(Mean::of(&[7.0]), Mean { mean: 7.0, standard_error: None, half_width: None });
    }

    #[test]
    fn power_laws() {
        let exact: Vec<_> = [1.0, 2.0, 4.0, 8.0].map(|x: f64| (x, 3.0 * x.powf(-0.5))).to_vec();
        let fit = PowerLaw::fit(&exact).unwrap();
        assert!((fit.exponent + 0.5).abs() < 1e-12 && (fit.factor - 3.0).abs() < 1e-12);
        assert!(fit.half_width.unwrap() < 1e-7);
        // Points that have no logarithm are left out; one x has no slope.
        assert_eq!(PowerLaw::fit(&[(1.0, 1.0), (2.0, 0.0), (2.0, f64::NAN), (4.0, 2.0)]).unwrap().points, 2);
        assert_eq!(PowerLaw::fit(&[(2.0, 1.0), (2.0, 3.0)]), None);
        assert_eq!(PowerLaw::fit(&[]), None);
        // y = e^(0, 1, 0) at x = e^(0, 1, 2): slope 0, residual sum 2/3, one degree of freedom, Sxx 2.
        let e = std::f64::consts::E;
        let fit = PowerLaw::fit(&[(1.0, 1.0), (e, e), (e * e, 1.0)]).unwrap();
        assert!(fit.exponent.abs() < 1e-12);
        assert!((fit.half_width.unwrap() - 12.706_205 * (1.0f64 / 3.0).sqrt()).abs() < 1e-4);
    }
}
