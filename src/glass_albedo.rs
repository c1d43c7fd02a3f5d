//! How much light a rough interface of glass scatters once, reflection and refraction together: the table that defines the model.
//!
//! By the cosine of a direction at equal steps of the mean of itself and of [`crate::ggx_albedo`]'s coordinate, by roughness, and at
//! equal steps of ±√|w|, w = (η − 1)/(η + 1), η the index of the far side over that of the near side. It is made by
//! [quadrature](quadrature), to which a test holds it.

use std::sync::LazyLock;

use crate::ggx_albedo::{alpha_of, bilinear, cell_of, mean_over_hemisphere, roughness_of, row_of, sum_column};

/// Steps of the cosine's coordinate.
pub(crate) const COSINES: usize = 48;
/// Steps of roughness.
pub(crate) const ROUGHNESSES: usize = 32;
/// Steps of the index; the one in the middle is an index of 1.
pub(crate) const SLICES: usize = 65;

/// Codes of 16 bits, 65535 for 1: slice by slice, of each a row for each roughness.
const BYTES: &[u8] = include_bytes!("../assets/glass_albedo.bin");

/// The table.
pub(crate) struct Table(Vec<f32>);

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    Table(BYTES.as_chunks().0.iter().map(|&bytes| f32::from(u16::from_le_bytes(bytes)) / 65535.0).collect())
});

/// The table that the program holds.
pub(crate) fn table() -> &'static Table {
    &TABLE
}

/// The coordinate of a cosine.
fn column(mu: f64, alpha: f64) -> f64 {
    (mu + sum_column(mu, alpha)) / 2.0
}

/// Where an index is between the slices.
fn slice_of(eta: f64) -> f64 {
    let w = (eta - 1.0) / (eta + 1.0);
    (1.0 + w.abs().sqrt().copysign(w)) / 2.0 * (SLICES - 1) as f64
}

impl Table {
    /// The number of a slice, roughness and cosine.
    pub fn value(&self, slice: usize, roughness: usize, cosine: usize) -> f32 {
        self.0[(slice * ROUGHNESSES + roughness) * COSINES + cosine]
    }

    /// Between two slices.
    fn between_slices(eta: f64, of_slice: impl Fn(usize) -> f64) -> f64 {
        let place = slice_of(eta);
        let first = (place as usize).min(SLICES - 2);
        let part = place - first as f64;
        of_slice(first) * (1.0 - part) + of_slice(first + 1) * part
    }

    /// Of a direction under the cosine `mu`.
    pub fn albedo(&self, mu: f64, roughness: f64, eta: f64) -> f64 {
        Self::between_slices(eta, |slice| self.of_slice(slice, mu, roughness))
    }

    fn of_slice(&self, slice: usize, mu: f64, roughness: f64) -> f64 {
        let column = cell_of(column(mu.clamp(0.0, 1.0), alpha_of(roughness)), COSINES);
        bilinear(column, cell_of(row_of(roughness), ROUGHNESSES), |i, j| f64::from(self.value(slice, j, i)))
    }

    /// The mean over the hemisphere, weighted with the cosine; `row` is 0 at the least roughness and 1 at 1.
    pub fn mean_of_slice(&self, slice: usize, row: f64) -> f64 {
        mean_over_hemisphere(|mu| self.of_slice(slice, mu, roughness_of(row)))
    }

    /// The mean for a roughness and an index.
    pub fn mean_of(&self, roughness: f64, eta: f64) -> f64 {
        Self::between_slices(eta, |slice| self.mean_of_slice(slice, row_of(roughness)))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use rayon::prelude::*;

    use super::*;
    use crate::ggx_albedo::visible_normals;
    use crate::oracle::fresnel;

    /// Integrated over visible normals.
    fn quadrature(mu: f64, alpha: f64, eta: f64, n: u32) -> f64 {
        let alphas = [alpha; 2];
        let sine = (1.0 - mu * mu).sqrt();
        let wo = [sine, 0.0, mu];
        // The azimuth of a direction does not matter to what hides it.
        let seen = |cosine: f64| {
            let cosine = cosine.min(1.0);
            visible_normals::seen(wo, [(1.0 - cosine * cosine).sqrt(), 0.0, cosine], alphas)
        };
        let [all] = visible_normals::integral(wo, alphas, PI, n, |h| {
            let cosine = (sine * h[0] + mu * h[2]).min(1.0);
            let reflectance = fresnel(cosine, eta);
            let inner2 = ((eta - 1.0) * (eta + 1.0) + cosine * cosine) / (eta * eta);
            // How far below the surface the refracted direction is.
            let depth = mu / eta - (cosine / eta - inner2.max(0.0).sqrt()) * h[2];
            let refracted = if reflectance < 1.0 { (1.0 - reflectance) * seen(depth) } else { 0.0 };
            [reflectance * seen(2.0 * cosine * h[2] - mu) + refracted]
        });
        all
    }

    #[test]
    fn an_infinite_index_reflects_all() {
        // The albedo of reflection alone, 1 − ln 2 at α = 1.
        for eta in [1e9, 1e-9] {
            let all = quadrature(1.0, 1.0, eta, 512);
            assert!((all - (1.0 - 2f64.ln())).abs() < 1e-4, "{all}");
        }
    }

    #[test]
    fn an_index_of_one_turns_no_ray() {
        // Seen from where it came, on the other side.
        let (mu, alpha) = (0.5f64, 0.6);
        let lambda = ((1.0 + alpha * alpha * (1.0 / (mu * mu) - 1.0)).sqrt() - 1.0) / 2.0;
        let all = quadrature(mu, alpha, 1.0, 64);
        assert!((all - (1.0 + lambda) / (1.0 + 2.0 * lambda)).abs() < 1e-3, "{all}");
    }

    #[test]
    fn the_table_is_the_integral() {
        let cases: Vec<(f64, f64, f64)> = (0..12)
            .flat_map(|i| (0..9).flat_map(move |j| (0..6).map(move |k| (i, j, k))))
            .map(|(i, j, k)| {
                let part = |n: i32, of: f64, shift: f64| (f64::from(n) + shift) / of;
                let ior: f64 = 1.1 + 0.35 * f64::from(k / 2);
                (part(i, 12.0, 0.37), 0.0317 + 0.968 * part(j, 9.0, 0.41), if k % 2 == 0 { ior } else { 1.0 / ior })
            })
            .collect();
        let errors: Vec<f64> = cases
            .par_iter()
            .map(|&(mu, roughness, eta)| {
                (table().albedo(mu, roughness, eta) - quadrature(mu, alpha_of(roughness), eta, 160)).abs()
            })
            .collect();
        let worst = errors.iter().copied().fold(0.0, f64::max);
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let at = errors.iter().position(|&e| e == worst).map(|i| cases[i]);
        assert!(worst < 3e-3 && rms < 3e-4, "worst {worst:.1e} at {at:?}, rms {rms:.1e}");
    }

    /// Writes the asset: `cargo test --release --lib write_the_table_of_glass -- --ignored`.
    #[test]
    #[ignore = "writes assets/glass_albedo.bin"]
    fn write_the_table_of_glass() {
        let codes: Vec<u16> = (0..SLICES * ROUGHNESSES * COSINES)
            .into_par_iter()
            .map(|cell| {
                let alpha = alpha_of(roughness_of((cell / COSINES % ROUGHNESSES) as f64 / (ROUGHNESSES - 1) as f64));
                let x = (cell % COSINES) as f64 / (COSINES - 1) as f64;
                let (mut low, mut high) = (1e-9, 1.0);
                for _ in 0..60 {
                    let middle = (low + high) / 2.0;
                    *(if column(middle, alpha) < x { &mut low } else { &mut high }) = middle;
                }
                let mu: f64 = (low + high) / 2.0;
                let root = 2.0 * (cell / COSINES / ROUGHNESSES) as f64 / (SLICES - 1) as f64 - 1.0;
                let w = (root * root.abs()).clamp(1e-6 - 1.0, 1.0 - 1e-6);
                (quadrature(mu, alpha, (1.0 + w) / (1.0 - w), 128) * 65535.0).round() as u16
            })
            .collect();
        let bytes: Vec<u8> = codes.iter().flat_map(|x| x.to_le_bytes()).collect();
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/glass_albedo.bin"), bytes).unwrap();
    }
}
