//! Sheen: Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", 2017, as KHR_materials_sheen has it.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::scene::MetallicRoughness;
use crate::sheen_albedo::{MIN_ROUGHNESS, tables};

fn alpha(roughness: f64) -> f64 {
    roughness.max(MIN_ROUGHNESS).powi(2)
}

/// Of normals, by the square of the sine of their angle.
fn distribution(sine2: f64, roughness: f64) -> f64 {
    let inverse = 1.0 / alpha(roughness);
    (2.0 + inverse) * sine2.powf(0.5 * inverse) / TAU
}

/// G/(4 cos θo cos θi).
fn visibility(mu_o: f64, mu_i: f64, roughness: f64) -> f64 {
    let alpha = alpha(roughness);
    1.0 / ((1.0 + lambda(mu_o, alpha) + lambda(mu_i, alpha)) * 4.0 * mu_o * mu_i)
}

fn lambda(mu: f64, alpha: f64) -> f64 {
    if mu < 0.5 { fit(mu, alpha).exp() } else { (2.0 * fit(0.5, alpha) - fit(1.0 - mu, alpha)).exp() }
}

/// Their curve for the logarithm of Λ.
fn fit(x: f64, alpha: f64) -> f64 {
    let t = (1.0 - alpha).powi(2);
    let [a, b, c, d, e] =
        [(21.5473, 25.3245), (3.82987, 3.32435), (0.19823, 0.16801), (-1.97760, -1.27393), (-4.32054, -4.85967)]
            .map(|(rough, smooth)| rough + (smooth - rough) * t);
    a / (1.0 + b * x.powf(c)) + d * x + e
}

/// f(wo, wi)·cos θi.
pub fn eval(m: &MetallicRoughness, wo: DVec3, wi: DVec3) -> DVec3 {
    if wo.z <= 0.0 || wi.z <= 0.0 {
        return DVec3::ZERO;
    }
    let half = (wo + wi).normalize();
    let r = m.sheen_roughness;
    let bound = [wo.z, wi.z].map(|mu| tables().raw(mu, r).max(1.0));
    let f = distribution(half.x * half.x + half.y * half.y, r) * visibility(wo.z, wi.z, r) / (bound[0] * bound[1]);
    DVec3::from(m.sheen_color) * f * wi.z
}

/// The part of light under a cosine that sheen keeps from what is below.
pub fn albedo(m: &MetallicRoughness, cosine: f64) -> f64 {
    let strongest = DVec3::from(m.sheen_color).max_element();
    if strongest == 0.0 {
        return 0.0;
    }
    strongest * tables().bounded(cosine, m.sheen_roughness)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use rayon::prelude::*;

    use super::*;
    use crate::sheen_albedo::{STEPS, Tables};

    /// Integrals of white sheen times a weight of the other cosine, by the midpoint rule with `n` points along either axis.
    fn quadrature(mu: f64, roughness: f64, n: u32, weight: impl Fn(f64) -> f64) -> f64 {
        let sine = (1.0 - mu * mu).max(0.0).sqrt();
        let mut sum = 0.0;
        for i in 0..n {
            let x = (f64::from(i) + 0.5) / f64::from(n);
            // Much of it grazes: μ = x³.
            let (z, dz) = (x * x * x, 3.0 * x * x);
            let r = (1.0 - z * z).max(0.0).sqrt();
            let shadowing = visibility(mu, z, roughness);
            let mut around = 0.0;
            for j in 0..n {
                let phi = PI * (f64::from(j) + 0.5) / f64::from(n);
                let h = [sine + r * phi.cos(), r * phi.sin(), mu + z];
                let level = h[0] * h[0] + h[1] * h[1];
                around += distribution(level / (level + h[2] * h[2]), roughness);
            }
            sum += around * shadowing * z * dz * weight(z);
        }
        sum * 2.0 * PI / f64::from(n * n)
    }

    #[test]
    fn the_tables_are_integrals() {
        let cases: Vec<(f64, f64)> = (0..12)
            .flat_map(|i| (0..8).map(move |j| (i, j)))
            .map(|(i, j)| (((f64::from(i) + 0.37) / 12.0).powi(2), 0.07 + 0.93 * (f64::from(j) + 0.41) / 8.0))
            .collect();
        let errors: Vec<[f64; 2]> = cases
            .par_iter()
            .map(|&(mu, roughness)| {
                let raw = |mu: f64| tables().raw(mu, roughness).max(1.0);
                let exact = quadrature(mu, roughness, 256, |_| 1.0);
                let bounded = quadrature(mu, roughness, 256, |z| 1.0 / raw(z)) / raw(mu);
                [tables().raw(mu, roughness) - exact, tables().bounded(mu, roughness) - bounded].map(f64::abs)
            })
            .collect();
        // The worst are smooth sheen where light grazes.
        assert!(errors.as_flattened().iter().all(|&error| error < 1e-2), "{errors:?}");
        let squares: f64 = errors.iter().map(|[_, bounded]| bounded * bounded).sum();
        assert!((squares / errors.len() as f64).sqrt() < 1e-3, "{errors:?}");
    }

    #[test]
    fn sheen_reflects_no_more_than_what_arrives() {
        assert!(tables().bounded.iter().all(|&albedo| (0.0..=1.0).contains(&albedo)));
    }

    /// Writes the asset: `cargo test --release --lib write_the_sheen -- --ignored`.
    #[test]
    #[ignore = "writes assets/sheen_albedo.bin"]
    fn write_the_sheen_tables() {
        let last = (STEPS - 1) as f64;
        let place = |cell: usize| {
            let mu = ((cell % STEPS) as f64 / last).powi(2).max(1e-4);
            (mu, MIN_ROUGHNESS + (1.0 - MIN_ROUGHNESS) * (cell / STEPS) as f64 / last)
        };
        let cells = || (0..STEPS * STEPS).into_par_iter();
        let raw: Vec<f32> = cells()
            .map(|cell| {
                let (mu, roughness) = place(cell);
                quadrature(mu, roughness, 256, |_| 1.0) as f32
            })
            .collect();
        let tables = Tables { raw, bounded: Vec::new() };
        let bounded: Vec<f32> = cells()
            .map(|cell| {
                let (mu, roughness) = place(cell);
                let raw = |mu: f64| tables.raw(mu, roughness).max(1.0);
                (quadrature(mu, roughness, 256, |z| 1.0 / raw(z)) / raw(mu)).min(1.0) as f32
            })
            .collect();
        let bytes: Vec<u8> = tables.raw.iter().chain(&bounded).flat_map(|x| x.to_le_bytes()).collect();
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/sheen_albedo.bin"), bytes).unwrap();
    }
}
