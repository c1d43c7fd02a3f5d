//! glTF's metallic-roughness model, as docs/rendering.md defines it, in the frame of a normal: `z` is the cosine.
//!
//! The albedo of single scattering is read from the table that defines it; all else is computed here from the formulas.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

use crate::ggx_albedo::{alpha_of, table};
use crate::oracle::{Pcg64, cosine_hemisphere};
use crate::scene::MetallicRoughness;

/// f(wo, wi)·cos θi; 0 unless both are above the surface.
pub fn eval(m: &MetallicRoughness, wo: DVec3, wi: DVec3) -> DVec3 {
    if wo.z <= 0.0 || wi.z <= 0.0 {
        return DVec3::ZERO;
    }
    let base = DVec3::from(m.base_color);
    let white = White::of(m.roughness);
    let metal = reflection(&white, base, 1.0, wo, wi);
    let (f0, f90) = dielectric(m);
    let coupled = Albedo::of(&white, f0.max_element(), f90);
    let diffuse = base * FRAC_1_PI * (1.0 - coupled.at(wo.z)) * (1.0 - coupled.at(wi.z)) / (1.0 - coupled.mean);
    let plastic = reflection(&white, f0, f90, wo, wi) + diffuse;
    // Metalness mixes what the Fresnel terms are, so that single scattering is that of the mixed terms.
    (m.metallic * metal + (1.0 - m.metallic) * plastic) * wi.z
}

/// Reflectance of the dielectric at normal and at grazing incidence.
pub(super) fn dielectric(m: &MetallicRoughness) -> (DVec3, f64) {
    let f0 = ((m.ior - 1.0) / (m.ior + 1.0)).powi(2) * DVec3::from(m.specular_color);
    (f0.min(DVec3::ONE) * m.specular, m.specular)
}

/// Single and multiple scattering by microfacets.
fn reflection(white: &White, f0: DVec3, f90: f64, wo: DVec3, wi: DVec3) -> DVec3 {
    let alpha = alpha_of(white.roughness);
    let half = (wo + wi).normalize();
    let fresnel = f0 + (f90 - f0) * (1.0 - half.dot(wo)).clamp(0.0, 1.0).powi(5);
    let g2 = 1.0 / (1.0 + lambda(wo, alpha) + lambda(wi, alpha));
    let single = fresnel * distribution(half, alpha) * g2 / (4.0 * wo.z * wi.z);
    single + white.multiple(f0, f90) * FRAC_1_PI * white.lost(wo.z) * white.lost(wi.z) / white.mean_lost
}

/// Microfacets that reflect all.
struct White {
    roughness: f64,
    /// Mean albedo of single scattering, in its two parts.
    mean: [f64; 2],
    /// What is missing to 1.
    mean_lost: f64,
}

impl White {
    fn of(roughness: f64) -> Self {
        let mean = table().mean_of(roughness);
        Self { roughness, mean, mean_lost: 1.0 - mean[0] - mean[1] }
    }

    /// What single scattering loses.
    fn lost(&self, cosine: f64) -> f64 {
        let [a, b] = table().albedo(cosine, self.roughness);
        1.0 - a - b
    }

    /// The part that more than one scattering reflects of what is lost after the first, under Schlick's Fresnel term.
    fn multiple(&self, f0: DVec3, f90: f64) -> DVec3 {
        let [a, b] = self.mean;
        let fresnel = f0 + (f90 - f0) / 21.0;
        fresnel * fresnel * (a + b) / (1.0 - fresnel * (1.0 - a - b))
    }
}

/// Albedo of single and multiple scattering together, for one channel.
struct Albedo<'a> {
    white: &'a White,
    f0: f64,
    f90: f64,
    multiple: f64,
    mean: f64,
}

impl<'a> Albedo<'a> {
    fn of(white: &'a White, f0: f64, f90: f64) -> Self {
        let [a, b] = white.mean;
        let multiple = white.multiple(DVec3::splat(f0), f90).x;
        Self { white, f0, f90, multiple, mean: f0 * a + f90 * b + multiple * white.mean_lost }
    }

    fn at(&self, cosine: f64) -> f64 {
        let [a, b] = table().albedo(cosine, self.white.roughness);
        self.f0 * a + self.f90 * b + self.multiple * (1.0 - a - b)
    }
}

/// GGX.
pub(super) fn distribution(half: DVec3, alpha: f64) -> f64 {
    let slope = (half.x * half.x + half.y * half.y) / (alpha * alpha) + half.z * half.z;
    FRAC_1_PI / (alpha * alpha * slope * slope)
}

/// Smith's function of GGX.
pub(super) fn lambda(w: DVec3, alpha: f64) -> f64 {
    let tangent2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
    ((1.0 + alpha * alpha * tangent2).sqrt() - 1.0) / 2.0
}

/// Density of [`sample`] per solid angle.
pub fn pdf(m: &MetallicRoughness, wo: DVec3, wi: DVec3) -> f64 {
    if wi.z <= 0.0 {
        return 0.0;
    }
    let half = (wo + wi).normalize();
    let of_normal = distribution(half, alpha_of(m.roughness)) * half.z;
    0.5 * wi.z * FRAC_1_PI + 0.5 * of_normal / (4.0 * half.dot(wo))
}

/// A direction: half of them by the cosine, half by a microfacet (Walter et al. 2007, eq. 35 and 36). It may be below the surface.
pub fn sample(m: &MetallicRoughness, wo: DVec3, rng: &mut Pcg64) -> DVec3 {
    if rng.uniform() < 0.5 {
        return cosine_hemisphere(DVec3::Z, rng);
    }
    let (u, phi) = (rng.uniform(), TAU * rng.uniform());
    let tangent = alpha_of(m.roughness) * (u / (1.0 - u)).sqrt();
    let half = DVec3::new(tangent * phi.cos(), tangent * phi.sin(), 1.0).normalize();
    2.0 * half.dot(wo) * half - wo
}
