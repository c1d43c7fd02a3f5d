//! Student's t distribution.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use statrs::function::beta::checked_beta_reg;
use statrs::function::erf::erfc;

/// From here on the normal distribution is used; its p-values differ by less than t⁴/(4·dof) of themselves.
const NORMAL_DOF: f64 = 1e6;

/// Probability that |T| ≥ |t| with `dof` degrees of freedom, accurate also far out.
///
/// It is the regularized incomplete beta function I_x(dof/2, 1/2) at x = dof/(dof + t²)
/// (Abramowitz and Stegun 26.7.1), without the cancellation of 1 − CDF.
pub(super) fn two_sided_p(t: f64, dof: f64) -> f64 {
    if t == 0.0 {
        return 1.0;
    }
    let normal = || erfc(t.abs() / std::f64::consts::SQRT_2);
    if dof >= NORMAL_DOF {
        normal()
    } else {
        checked_beta_reg(dof / 2.0, 0.5, dof / (dof + t * t)).unwrap_or_else(|_| normal())
    }
}

/// The t that |T| stays below with probability `confidence`.
pub(crate) fn two_sided_quantile(confidence: f64, dof: f64) -> f64 {
    let p = 0.5 + 0.5 * confidence;
    match StudentsT::new(0.0, 1.0, dof) {
        Ok(student) if dof < NORMAL_DOF => student.inverse_cdf(p),
        _ => Normal::standard().inverse_cdf(p),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_printed_tables() {
        for (dof, t) in
            [(1.0, 12.706), (2.0, 4.303), (10.0, 2.228), (30.0, 2.042), (120.0, 1.980), (1e4, 1.9602), (1e7, 1.95996)]
        {
            let found = two_sided_quantile(0.95, dof);
            assert!((found - t).abs() < 6e-4, "{dof}: {found}, expected {t}");
        }
    }

    #[test]
    fn p_values_far_out() {
        // One and two degrees of freedom have closed forms; the others are from SciPy (2·t.sf).
        for (t, dof, p) in P_VALUES {
            let found = two_sided_p(t, dof);
            assert!((found / p - 1.0).abs() < 1e-6, "t {t}, dof {dof}: {found:e}, expected {p:e}");
            assert_eq!(found, two_sided_p(-t, dof));
        }
        for t in [0.5, 3.0, 1e4] {
            let cauchy = 1.0 - 2.0 / std::f64::consts::PI * f64::atan(t);
            assert!((two_sided_p(t, 1.0) - cauchy).abs() < 1e-12);
            let two = 1.0 - t / f64::sqrt(2.0 + t * t);
            assert!((two_sided_p(t, 2.0) - two).abs() < 1e-12);
        }
        assert_eq!(two_sided_p(0.0, 5.0), 1.0);
        assert_eq!(two_sided_p(f64::INFINITY, 5.0), 0.0);
    }

    const P_VALUES: [(f64, f64, f64); 12] = [
        (0.3, 7.5, 7.723226585688e-01),
        (2.0, 30.0, 5.462504496298e-02),
        (5.0, 30.0, 2.329668546701e-05),
        (9.7, 30.0, 9.255364811461e-11),
        (12.0, 15.0, 4.322734113447e-09),
        (7.0, 500.0, 8.277909410146e-12),
        (0.05, 5000.0, 9.601243854733e-01),
        (1.2, 5000.0, 2.301961950604e-01),
        (6.0, 99999.0, 1.979929523244e-09),
        (1.5, 99999.0, 1.336175595544e-01),
        (6.5, 900000.0, 8.036171449254e-11),
        (1.9, 900000.0, 5.743343892594e-02),
    ];
}
