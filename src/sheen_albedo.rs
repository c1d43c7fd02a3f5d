//! How much light sheen reflects: the tables that define it in the metallic-roughness model.
//!
//! Sheen is the distribution of normals of Estevez and Kulla ("Production Friendly Microfacet Sheen BRDF", 2017) with their shadowing, as
//! KHR_materials_sheen has it. Where it is smooth and light grazes, that reflects more than what arrives: there it is divided by its
//! albedo, of either direction. One table has the albedo before that, the other the albedo after it, by the cosine μ at equal steps of
//! √μ, and by roughness at equal steps. Tests of the oracle hold both to the integrals.

use std::sync::LazyLock;

pub(crate) use crate::ggx_albedo::STEPS;
use crate::ggx_albedo::interpolated;

/// Smaller roughnesses are raised to it.
pub(crate) const MIN_ROUGHNESS: f64 = 0.07;

/// Numbers of the asset: albedos before, then after the division, row by row, a row for each roughness.
const BYTES: &[u8] = include_bytes!("../assets/sheen_albedo.bin");

/// The tables.
pub(crate) struct Tables {
    /// Before the division.
    pub raw: Vec<f32>,
    /// After it.
    pub bounded: Vec<f32>,
}

static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let numbers: Vec<f32> = BYTES.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
    let (raw, bounded) = numbers.split_at(STEPS * STEPS);
    Tables { raw: raw.to_vec(), bounded: bounded.to_vec() }
});

/// The tables that the program holds.
pub(crate) fn tables() -> &'static Tables {
    &TABLES
}

impl Tables {
    /// The albedo by which sheen is divided where it is above 1.
    pub fn raw(&self, mu: f64, roughness: f64) -> f64 {
        at(&self.raw, mu, roughness)
    }

    /// The albedo of white sheen.
    pub fn bounded(&self, mu: f64, roughness: f64) -> f64 {
        at(&self.bounded, mu, roughness)
    }
}

fn at(table: &[f32], mu: f64, roughness: f64) -> f64 {
    let row = (roughness - MIN_ROUGHNESS) / (1.0 - MIN_ROUGHNESS);
    interpolated(table, mu.clamp(0.0, 1.0).sqrt(), row.clamp(0.0, 1.0))
}
