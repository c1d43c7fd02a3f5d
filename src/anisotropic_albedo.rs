//! How much light anisotropic GGX microfacets reflect by single scattering: the table that defines the metallic-roughness model where it is
//! anisotropic, as that of `ggx_albedo` does where it is not.
//!
//! With Schlick's Fresnel term the albedo is `F0·a + F90·b`, by the cosine μ of a direction at equal steps of √μ, by the square of the
//! cosine of its azimuth from the tangent, by roughness, and by the strength of the anisotropy; the last three at equal steps.

use std::sync::LazyLock;

use crate::ggx_albedo::{bilinear, cell_of, row_of};

/// Steps of √μ, of azimuth, of roughness and of strength.
pub(crate) const STEPS: [usize; 4] = [12, 6, 16, 12];

/// Numbers of the asset: a, b for each μ, in rows for each azimuth, roughness and strength.
const BYTES: &[u8] = include_bytes!("../assets/anisotropic_albedo.bin");

/// The table.
pub(crate) struct Table {
    /// `a` and `b`; μ changes first, then azimuth, roughness, strength.
    pub values: Vec<[f32; 2]>,
    /// Their means over the hemisphere, weighted with the cosine; roughness changes first.
    pub means: Vec<[f64; 2]>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let numbers: Vec<f32> = BYTES.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
    let values: Vec<[f32; 2]> = numbers.as_chunks().0.to_vec();
    let weights = mean_weights();
    let mean = |cell: &[[f32; 2]]| {
        let add = |sum: [f64; 2], (value, weight): (&[f32; 2], &f64)| {
            [sum[0] + weight * f64::from(value[0]), sum[1] + weight * f64::from(value[1])]
        };
        cell.iter().zip(&weights).fold([0.0; 2], add)
    };
    let means = values.chunks(STEPS[0] * STEPS[1]).map(mean).collect();
    Table { values, means }
});

/// The table that the program holds.
pub(crate) fn table() -> &'static Table {
    &TABLE
}

/// What each value of a row adds to the mean, where it is interpolated between its places.
fn mean_weights() -> Vec<f64> {
    const POINTS: usize = 512;
    let point = |i: usize| (i as f64 + 0.5) / POINTS as f64;
    let hat = |x: f64, i: usize, steps: usize| (1.0 - (x * (steps - 1) as f64 - i as f64).abs()).max(0.0);
    let mean = |steps: usize, place: fn(f64) -> f64, weight: fn(f64) -> f64| -> Vec<f64> {
        let total: f64 = (0..POINTS).map(|k| weight(point(k))).sum();
        let of = |i| (0..POINTS).map(|k| weight(point(k)) * hat(place(point(k)), i, steps)).sum::<f64>() / total;
        (0..steps).map(of).collect()
    };
    // 2 μ dμ = 4 x³ dx where μ = x².
    let of_mu = mean(STEPS[0], |x| x, |x| x.powi(3));
    let of_azimuth = mean(STEPS[1], |x| (x * std::f64::consts::FRAC_PI_2).cos().powi(2), |_| 1.0);
    of_azimuth.iter().flat_map(|a| of_mu.iter().map(move |m| a * m)).collect()
}

impl Table {
    /// `(a, b)` under the cosine `mu`, at an azimuth of that squared cosine from the tangent.
    pub fn albedo(&self, mu: f64, azimuth: f64, roughness: f64, strength: f64) -> [f64; 2] {
        let at = [mu.max(0.0).sqrt(), azimuth, row_of(roughness), strength];
        let places: [(usize, f64); 4] = std::array::from_fn(|k| cell_of(at[k].clamp(0.0, 1.0), STEPS[k]));
        let mut sum = [0.0; 2];
        for corner in 0..16 {
            let (mut index, mut weight) = (0, 1.0);
            for k in (0..4).rev() {
                let (first, t) = places[k];
                let far = corner >> k & 1;
                index = index * STEPS[k] + first + far;
                weight *= if far == 1 { t } else { 1.0 - t };
            }
            let value = self.values[index];
            sum = [sum[0] + weight * f64::from(value[0]), sum[1] + weight * f64::from(value[1])];
        }
        sum
    }

    /// The mean over the hemisphere, weighted with the cosine.
    pub fn mean_of(&self, roughness: f64, strength: f64) -> [f64; 2] {
        let (column, row) = (cell_of(row_of(roughness), STEPS[2]), cell_of(strength.clamp(0.0, 1.0), STEPS[3]));
        [0, 1].map(|part| bilinear(column, row, |i, j| self.means[j * STEPS[2] + i][part]))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use rayon::prelude::*;

    use super::*;
    use crate::ggx_albedo::{MIN_ALPHA, alpha_of, visible_normals};

    /// `(a, b)`, integrated over visible normals, as for the isotropic table.
    fn quadrature(mu: f64, azimuth: f64, roughness: f64, strength: f64, n: u32) -> [f64; 2] {
        let across = alpha_of(roughness);
        let alphas = [across + (1.0 - across) * strength * strength, across];
        let sine = (1.0 - mu * mu).max(0.0).sqrt();
        let wo = [sine * azimuth.sqrt(), sine * (1.0 - azimuth).sqrt(), mu];
        visible_normals::integral(wo, alphas, TAU, n, |h| {
            let cosine = wo[0] * h[0] + wo[1] * h[1] + wo[2] * h[2];
            let reflected: [f64; 3] = std::array::from_fn(|k| 2.0 * cosine * h[k] - wo[k]);
            let weight = visible_normals::seen(wo, reflected, alphas);
            let schlick = (1.0 - cosine).clamp(0.0, 1.0).powi(5);
            [weight * (1.0 - schlick), weight * schlick]
        })
    }

    #[test]
    fn the_table_is_the_integral() {
        let cases: Vec<[f64; 4]> = (0..6 * 4 * 4 * 4)
            .map(|i| {
                let [mu, azimuth, roughness, strength] =
                    [(i % 6, 6.0), (i / 6 % 4, 4.0), (i / 24 % 4, 4.0), (i / 96, 4.0)]
                        .map(|(k, n)| (f64::from(k) + 0.37) / n);
                [mu.sqrt(), (azimuth * PI / 2.0).cos().powi(2), roughness.max(0.04), strength]
            })
            .collect();
        let errors: Vec<f64> = cases
            .par_iter()
            .map(|&[mu, azimuth, roughness, strength]| {
                let exact = quadrature(mu, azimuth, roughness, strength, 64);
                let found = table().albedo(mu, azimuth, roughness, strength);
                let error = |f0: f64| f0 * (found[0] - exact[0]) + found[1] - exact[1];
                error(0.04).abs().max(error(1.0).abs())
            })
            .collect();
        let rms = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
        let worst = errors.iter().copied().fold(0.0, f64::max);
        assert!(worst < 3e-2 && rms < 3e-3, "worst {worst:.1e}, rms {rms:.1e}");
    }

    #[test]
    fn means_are_those_of_the_table() {
        let table = table();
        let (roughness, strength) = (0.37, 0.61);
        let (n, mut sum) = (200, [0.0; 2]);
        for i in 0..n {
            for j in 0..n {
                let x = (f64::from(i) + 0.5) / f64::from(n);
                let azimuth = ((f64::from(j) + 0.5) / f64::from(n) * PI / 2.0).cos().powi(2);
                let value = table.albedo(x * x, azimuth, roughness, strength);
                let weight = 4.0 * x.powi(3) / f64::from(n * n);
                sum = [sum[0] + weight * value[0], sum[1] + weight * value[1]];
            }
        }
        let mean = table.mean_of(roughness, strength);
        assert!((0..2).all(|k| (sum[k] - mean[k]).abs() < 1e-4), "{sum:?} {mean:?}");
    }

    /// Writes the asset: `cargo test --release --lib write_the_anisotropic -- --ignored`.
    #[test]
    #[ignore = "writes assets/anisotropic_albedo.bin"]
    fn write_the_anisotropic_table() {
        let [n, azimuths, rows, strengths] = STEPS;
        let step = |i: usize, steps: usize| i as f64 / (steps - 1) as f64;
        let least = MIN_ALPHA.sqrt();
        let values: Vec<[f64; 2]> = (0..n * azimuths * rows * strengths)
            .into_par_iter()
            .map(|cell| {
                let mu = step(cell % n, n).powi(2).max(1e-4);
                let azimuth = step(cell / n % azimuths, azimuths);
                let roughness = least + (1.0 - least) * step(cell / (n * azimuths) % rows, rows);
                quadrature(mu, azimuth, roughness, step(cell / (n * azimuths * rows), strengths), 128)
            })
            .collect();
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|&x| (x as f32).to_le_bytes()).collect();
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/anisotropic_albedo.bin"), bytes).unwrap();
    }
}
