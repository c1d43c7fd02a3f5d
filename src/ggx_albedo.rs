//! How much light GGX microfacets reflect by single scattering: the table that defines the metallic-roughness model.
//!
//! With Schlick's Fresnel term the albedo is `F0·a + F90·b`, by the cosine μ of a direction and α = roughness². The table has `a + b` at
//! equal steps of √(μ(1 + 2α)/(μ + 2α)), in which it is nearly linear however small α is, and `b/(a + b)` at equal steps of √μ; both at
//! equal steps of roughness. It is made by [quadrature](quadrature), to which a test holds it.

use std::sync::LazyLock;

/// Steps along either axis.
pub(crate) const STEPS: usize = 64;
/// Smaller α is raised to it: the image of a mirror differs by less than 0.06 degrees.
pub(crate) const MIN_ALPHA: f64 = 1e-3;

/// Numbers of the asset: sums, then grazing parts, row by row, a row for each roughness.
const BYTES: &[u8] = include_bytes!("../assets/ggx_albedo.bin");

/// The table.
pub(crate) struct Table {
    /// `a + b`.
    pub sum: Vec<f32>,
    /// `b/(a + b)`.
    pub grazing: Vec<f32>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let numbers: Vec<f32> = BYTES.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
    let (sum, grazing) = numbers.split_at(STEPS * STEPS);
    Table { sum: sum.to_vec(), grazing: grazing.to_vec() }
});

/// The table that the program holds.
pub(crate) fn table() -> &'static Table {
    &TABLE
}

/// α of a roughness.
pub(crate) fn alpha_of(roughness: f64) -> f64 {
    (roughness * roughness).max(MIN_ALPHA)
}

/// Where a roughness is between the least and 1.
pub(crate) fn row_of(roughness: f64) -> f64 {
    let least = MIN_ALPHA.sqrt();
    (roughness.clamp(least, 1.0) - least) / (1.0 - least)
}

/// The roughness of a place between the least and 1.
pub(crate) fn roughness_of(row: f64) -> f64 {
    let least = MIN_ALPHA.sqrt();
    least + row * (1.0 - least)
}

/// The coordinate of a cosine.
pub(crate) fn sum_column(mu: f64, alpha: f64) -> f64 {
    (mu * (1.0 + 2.0 * alpha) / (mu + 2.0 * alpha)).sqrt()
}

impl Table {
    /// `(a, b)` under the cosine `mu`, bilinear between the steps.
    pub fn albedo(&self, mu: f64, roughness: f64) -> [f64; 2] {
        let mu = mu.clamp(0.0, 1.0);
        let row = row_of(roughness);
        let sum = interpolated(&self.sum, sum_column(mu, alpha_of(roughness)), row);
        let grazing = interpolated(&self.grazing, mu.sqrt(), row);
        [sum * (1.0 - grazing), sum * grazing]
    }

    /// The mean of [`Table::albedo`] over the hemisphere, weighted with the cosine; `row` is 0 at the least roughness and 1 at 1.
    pub fn mean(&self, row: f64) -> [f64; 2] {
        let roughness = roughness_of(row);
        [0, 1].map(|part| mean_over_hemisphere(|mu| self.albedo(mu, roughness)[part]))
    }

    /// The mean for a roughness.
    pub fn mean_of(&self, roughness: f64) -> [f64; 2] {
        self.mean(row_of(roughness))
    }
}

/// The mean of what depends on a cosine, weighted with it.
pub(crate) fn mean_over_hemisphere(of: impl Fn(f64) -> f64) -> f64 {
    const POINTS: u32 = 256;
    let weighted = |i: u32| {
        // 2 μ dμ = 4 x³ dx where μ = x².
        let x = (f64::from(i) + 0.5) / f64::from(POINTS);
        4.0 * x.powi(3) / f64::from(POINTS) * of(x * x)
    };
    (0..POINTS).map(weighted).sum()
}

/// The cell of `x` among steps from 0 to 1, and the place in it.
pub(crate) fn cell_of(x: f64, steps: usize) -> (usize, f64) {
    let x = x * (steps - 1) as f64;
    let first = (x as usize).min(steps - 2);
    (first, x - first as f64)
}

/// Bilinear in the cells of a table of `value(column, row)`.
pub(crate) fn bilinear(column: (usize, f64), row: (usize, f64), value: impl Fn(usize, usize) -> f64) -> f64 {
    let ((i, s), (j, t)) = (column, row);
    let of_row = |j: usize| value(i, j) * (1.0 - s) + value(i + 1, j) * s;
    of_row(j) * (1.0 - t) + of_row(j + 1) * t
}

/// Bilinear in a table of [`STEPS`] along either axis, at `x` and `y` from 0 to 1.
pub(crate) fn interpolated(table: &[f32], x: f64, y: f64) -> f64 {
    bilinear(cell_of(x, STEPS), cell_of(y, STEPS), |i, j| f64::from(table[j * STEPS + i]))
}

/// Integrals over the normals that are visible along a direction (Heitz, "Sampling the GGX distribution of visible normals", 2018), by
/// the midpoint rule.
#[cfg(test)]
pub(crate) mod visible_normals {
    /// Smith's Λ of a unit direction, for alphas along x and y.
    fn lambda([x, y, z]: [f64; 3], [ax, ay]: [f64; 2]) -> f64 {
        ((1.0 + ((ax * x).powi(2) + (ay * y).powi(2)) / (z * z)).sqrt() - 1.0) / 2.0
    }

    /// The part of light from `wi` that is not hidden on its way to `wo`, of what leaves microfacets towards there: Smith's G2 over G1.
    pub fn seen(wo: [f64; 3], wi: [f64; 3], alphas: [f64; 2]) -> f64 {
        if wi[2] <= 0.0 {
            return 0.0;
        }
        let at_wo = lambda(wo, alphas);
        (1.0 + at_wo) / (1.0 + at_wo + lambda(wi, alphas))
    }

    /// The mean of a function over unit normals that are visible along `wo`, with `n` points along either axis; `turn` is π where both
    /// halves around the plane of `wo` are alike, else 2π.
    pub fn integral<const N: usize>(
        wo: [f64; 3],
        [ax, ay]: [f64; 2],
        turn: f64,
        n: u32,
        of: impl Fn([f64; 3]) -> [f64; N],
    ) -> [f64; N] {
        let stretched = unit([ax * wo[0], ay * wo[1], wo[2]]);
        let mut sums = [0.0; N];
        for i in 0..n {
            // A cap of the sphere, from below the horizon by as much as the direction is above (Dupuy and Benyoub 2023). The square
            // root in the reflected cosine at the rim is taken out by a substitution.
            let u = (f64::from(i) + 0.5) / f64::from(n);
            let (u, du) = (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u));
            let z = (1.0 - u) * (1.0 + stretched[2]) - stretched[2];
            let r = (1.0 - z * z).max(0.0).sqrt();
            for j in 0..n {
                let phi = turn * (f64::from(j) + 0.5) / f64::from(n);
                let cap = [r * phi.cos() + stretched[0], r * phi.sin() + stretched[1], z + stretched[2]];
                let value = of(unit([ax * cap[0], ay * cap[1], cap[2]]));
                sums = std::array::from_fn(|k| sums[k] + du * value[k]);
            }
        }
        sums.map(|sum| sum / f64::from(n * n))
    }

    fn unit(v: [f64; 3]) -> [f64; 3] {
        let length = v[0].hypot(v[1]).hypot(v[2]);
        v.map(|x| x / length)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use rayon::prelude::*;

    use super::*;

    /// `(a, b)`, integrated over visible normals: the weight of a direction is then Smith's G2 over G1.
    fn quadrature(mu: f64, alpha: f64, n: u32) -> [f64; 2] {
        let alphas = [alpha; 2];
        let wo = [(1.0 - mu * mu).sqrt(), 0.0, mu];
        visible_normals::integral(wo, alphas, PI, n, |h| {
            let cosine = wo[0] * h[0] + mu * h[2];
            let reflected = [2.0 * cosine * h[0] - wo[0], 2.0 * cosine * h[1], 2.0 * cosine * h[2] - mu];
            let weight = visible_normals::seen(wo, reflected, alphas);
            let schlick = (1.0 - cosine).clamp(0.0, 1.0).powi(5);
            [weight * (1.0 - schlick), weight * schlick]
        })
    }

    #[test]
    fn the_integral_is_known_where_alpha_is_1() {
        // E1(1, 1) = 1 − ln 2.
        let [a, b] = quadrature(1.0, 1.0, 512);
        assert!((a + b - (1.0 - 2f64.ln())).abs() < 5e-6, "{}", a + b);
    }

    #[test]
    fn the_table_is_the_integral() {
        let mut worst: f64 = 0.0;
        let mut squares = 0.0;
        let cases: Vec<(f64, f64)> = (0..24)
            .flat_map(|i| (0..12).map(move |j| (i, j)))
            .map(|(i, j)| ((f64::from(i) + 0.37) / 24.0, 0.0317 + 0.968 * (f64::from(j) + 0.41) / 12.0))
            .collect();
        let errors: Vec<f64> = cases
            .par_iter()
            .map(|&(mu, roughness)| {
                let exact = quadrature(mu, alpha_of(roughness), 256);
                let found = table().albedo(mu, roughness);
                // Of a dielectric and of a metal.
                let error = |f0: f64| f0 * (found[0] - exact[0]) + found[1] - exact[1];
                error(0.04).abs().max(error(1.0).abs())
            })
            .collect();
        for error in errors {
            worst = worst.max(error);
            squares += error * error;
        }
        let rms = (squares / cases.len() as f64).sqrt();
        assert!(worst < 8e-4 && rms < 1e-4, "worst {worst:.1e}, rms {rms:.1e}");
    }

    /// Writes the asset: `cargo test --release --lib write_the_table -- --ignored`.
    #[test]
    #[ignore = "writes assets/ggx_albedo.bin"]
    fn write_the_table() {
        let last = (STEPS - 1) as f64;
        let least = MIN_ALPHA.sqrt();
        let values = |of: fn(f64, f64) -> f64, value: fn([f64; 2]) -> f64| -> Vec<f32> {
            (0..STEPS * STEPS)
                .into_par_iter()
                .map(|cell| {
                    let alpha = alpha_of(least + (1.0 - least) * (cell / STEPS) as f64 / last);
                    let mu = of((cell % STEPS) as f64 / last, alpha).clamp(1e-9, 1.0);
                    value(quadrature(mu, alpha, 512)) as f32
                })
                .collect()
        };
        let sums = values(|x, alpha| 2.0 * alpha * x * x / (1.0 + 2.0 * alpha - x * x), |[a, b]| a + b);
        let grazing = values(|x, _| x * x, |[a, b]| b / (a + b));
        let bytes: Vec<u8> = sums.iter().chain(&grazing).flat_map(|x| x.to_le_bytes()).collect();
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/ggx_albedo.bin"), bytes).unwrap();
    }
}
