//! What conductors reflect.

use crate::scene::{Reflection, Rgb};

/// The mean over the hemisphere, weighted with the cosine.
pub(crate) fn mean(reflection: &Reflection) -> Rgb {
    match *reflection {
        Reflection::Constant(reflectance) => reflectance,
        Reflection::Index { eta, k } => std::array::from_fn(|channel| mean_of(eta[channel], k[channel])),
    }
}

fn mean_of(eta: f64, k: f64) -> f64 {
    const POINTS: u32 = 256;
    let point = |i: u32| (f64::from(i) + 0.5) / f64::from(POINTS);
    (0..POINTS).map(|i| 2.0 * point(i) * reflectance(point(i), eta, k)).sum::<f64>() / f64::from(POINTS)
}

/// Of unpolarised light under a cosine, by Fresnel's equations for the index η + ik.
///
/// With the root a + ib of (η + ik)² − sin²θ, all is sums of squares.
fn reflectance(cosine: f64, eta: f64, k: f64) -> f64 {
    let sine2 = 1.0 - cosine * cosine;
    let real = (eta - k) * (eta + k) - sine2;
    let length = real.hypot(2.0 * eta * k);
    let larger = (0.5 * (length + real.abs())).sqrt();
    let (a, b) = if real > 0.0 { (larger, eta * k / larger) } else { (eta * k / larger, larger) };
    let ratio = |x: f64, y: f64, z: f64| ((x - y).powi(2) + z * z) / ((x + y).powi(2) + z * z);
    let across = ratio(cosine, a, b);
    0.5 * across * (1.0 + ratio(a * cosine, sine2, b * cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_k_it_is_that_of_a_dielectric() {
        for (cosine, eta) in [(1.0, 1.5), (0.6, 1.5), (0.1, 2.4)] {
            let transmitted = f64::sqrt(eta * eta - 1.0 + cosine * cosine) / eta;
            let s = (cosine - eta * transmitted) / (cosine + eta * transmitted);
            let p = (eta * cosine - transmitted) / (eta * cosine + transmitted);
            assert!((reflectance(cosine, eta, 0.0) - 0.5 * (s * s + p * p)).abs() < 1e-14);
        }
    }

    #[test]
    fn at_normal_incidence_it_is_known() {
        let (eta, k) = (0.143, 3.983);
        let expected = ((eta - 1.0f64).powi(2) + k * k) / ((eta + 1.0f64).powi(2) + k * k);
        assert!((reflectance(1.0, eta, k) - expected).abs() < 1e-14);
    }

    #[test]
    fn the_mean_is_that_of_the_hemisphere() {
        // Of a dielectric, in closed form (Walsh 1926).
        let n: f64 = 1.5;
        let (m, p) = (n * n - 1.0, n * n + 1.0);
        let walsh = 0.5
            + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2))
            + n * n * m * m / p.powi(3) * ((n - 1.0) / (n + 1.0)).ln()
            - 2.0 * n.powi(3) * (n * n + 2.0 * n - 1.0) / (p * (n.powi(4) - 1.0))
            + 8.0 * n.powi(4) * (n.powi(4) + 1.0) / (p * (n.powi(4) - 1.0).powi(2)) * n.ln();
        let [glass, ..] = mean(&Reflection::Index { eta: [n; 3], k: [0.0; 3] });
        assert!((glass - walsh).abs() < 1e-4, "{glass} {walsh}");
        assert_eq!(mean(&Reflection::Constant([0.1, 0.2, 0.3])), [0.1, 0.2, 0.3]);
    }
}
