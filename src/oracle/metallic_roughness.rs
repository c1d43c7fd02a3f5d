//! glTF's metallic-roughness model, as docs/rendering.md defines it, in the frame of a normal: `z` is the cosine.
//!
//! The albedo of single scattering is read from the table that defines it; all else is computed here from the formulas.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

use crate::anisotropic_albedo;
use crate::ggx_albedo::{alpha_of, table};
use crate::oracle::{Pcg64, cosine_hemisphere};
use crate::scene::MetallicRoughness;

/// f(wo, wi)·cos θi without layers; 0 unless both are above the surface.
pub fn eval(m: &MetallicRoughness, wo: DVec3, wi: DVec3) -> DVec3 {
    let [specular, diffuse] = parts(m, wo, wi);
    (specular + diffuse) * wi.z
}

/// f(wo, wi): what microfacets reflect, and the diffuse part.
pub(super) fn parts(m: &MetallicRoughness, wo: DVec3, wi: DVec3) -> [DVec3; 2] {
    if wo.z <= 0.0 || wi.z <= 0.0 {
        return [DVec3::ZERO; 2];
    }
    let base = DVec3::from(m.base_color);
    let white = White::of(Grain::of(m));
    let metal = reflection(&white, base, 1.0, wo, wi);
    let (f0, f90) = dielectric(m);
    let coupled = Albedo::of(white, f0.max_element(), f90);
    // What reflects all lets nothing through.
    let mean_through = (1.0 - coupled.mean).max(1e-12);
    let diffuse = base * FRAC_1_PI * (1.0 - coupled.at(wo)) * (1.0 - coupled.at(wi)) / mean_through;
    let plastic = reflection(&white, f0, f90, wo, wi);
    // Metalness mixes what the Fresnel terms are, so that single scattering is that of the mixed terms.
    [m.metallic * metal + (1.0 - m.metallic) * plastic, (1.0 - m.metallic) * diffuse]
}

/// Reflectance at normal incidence of metal and dielectric, mixed.
pub(super) fn normal_reflectance(m: &MetallicRoughness) -> DVec3 {
    dielectric(m).0.lerp(m.base_color.into(), m.metallic)
}

/// What the dielectric's microfacets let through to the diffuse part of light under a cosine, between tangent and bitangent.
pub(super) fn let_through(m: &MetallicRoughness) -> impl Fn(f64) -> f64 {
    let (f0, f90) = dielectric(m);
    let albedo = Albedo::of(White::of(Grain::of(m)), f0.max_element(), f90);
    move |cosine| {
        let across = (0.5 - 0.5 * cosine * cosine).max(0.0).sqrt();
        1.0 - albedo.at(DVec3::new(across, across, cosine))
    }
}

/// How rough microfacets are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grain {
    roughness: f64,
    /// Strength.
    anisotropy: f64,
}

impl Grain {
    /// Of the base.
    pub fn of(m: &MetallicRoughness) -> Self {
        Self { roughness: m.roughness, anisotropy: m.anisotropy }
    }

    /// Without a direction.
    pub fn even(roughness: f64) -> Self {
        Self { roughness, anisotropy: 0.0 }
    }

    /// α along the tangent and along the bitangent (KHR_materials_anisotropy).
    fn alphas(&self) -> [f64; 2] {
        let alpha = alpha_of(self.roughness);
        [alpha + (1.0 - alpha) * self.anisotropy * self.anisotropy, alpha]
    }

    /// Albedo of single scattering, in its two parts.
    fn albedo(&self, w: DVec3) -> [f64; 2] {
        if self.anisotropy == 0.0 {
            return table().albedo(w.z, self.roughness);
        }
        let across = w.x * w.x + w.y * w.y;
        let azimuth = if across > 0.0 { w.x * w.x / across } else { 0.5 };
        anisotropic_albedo::table().albedo(w.z, azimuth, self.roughness, self.anisotropy)
    }

    fn mean_albedo(&self) -> [f64; 2] {
        if self.anisotropy == 0.0 {
            return table().mean_of(self.roughness);
        }
        anisotropic_albedo::table().mean_of(self.roughness, self.anisotropy)
    }
}

/// Reflectance of the dielectric at normal and at grazing incidence.
pub(super) fn dielectric(m: &MetallicRoughness) -> (DVec3, f64) {
    let f0 = ((m.ior - 1.0) / (m.ior + 1.0)).powi(2) * DVec3::from(m.specular_color);
    (f0.min(DVec3::ONE) * m.specular, m.specular)
}

/// Single and multiple scattering by microfacets under Schlick's Fresnel term.
pub(super) fn reflection(white: &White, f0: DVec3, f90: f64, wo: DVec3, wi: DVec3) -> DVec3 {
    let half = (wo + wi).normalize();
    let fresnel = f0 + (f90 - f0) * (1.0 - half.dot(wo)).clamp(0.0, 1.0).powi(5);
    scattering(white, fresnel, f0 + (f90 - f0) / 21.0, wo, wi)
}

/// The same under a Fresnel term of that value for the half vector, and of that mean, weighted with the cosine.
pub(super) fn scattering(white: &White, fresnel: DVec3, mean_fresnel: DVec3, wo: DVec3, wi: DVec3) -> DVec3 {
    let alphas = white.grain.alphas();
    let g2 = 1.0 / (1.0 + lambda(wo, alphas) + lambda(wi, alphas));
    let single = fresnel * distribution((wo + wi).normalize(), alphas) * g2 / (4.0 * wo.z * wi.z);
    single + white.multiple(mean_fresnel) * FRAC_1_PI * white.lost(wo) * white.lost(wi) / white.mean_lost
}

/// Microfacets that reflect all.
#[derive(Debug, Clone, Copy)]
pub(super) struct White {
    grain: Grain,
    /// Mean albedo of single scattering, in its two parts.
    mean: [f64; 2],
    /// What is missing to 1.
    mean_lost: f64,
}

impl White {
    pub fn of(grain: Grain) -> Self {
        let mean = grain.mean_albedo();
        Self { grain, mean, mean_lost: 1.0 - mean[0] - mean[1] }
    }

    /// What single scattering loses.
    fn lost(&self, w: DVec3) -> f64 {
        let [a, b] = self.grain.albedo(w);
        1.0 - a - b
    }

    /// The part that more than one scattering reflects of what is lost after the first.
    fn multiple(&self, fresnel: DVec3) -> DVec3 {
        let [a, b] = self.mean;
        fresnel * fresnel * (a + b) / (1.0 - fresnel * (1.0 - a - b))
    }
}

/// Albedo of single and multiple scattering together, for one channel.
pub(super) struct Albedo {
    white: White,
    f0: f64,
    f90: f64,
    multiple: f64,
    mean: f64,
}

impl Albedo {
    pub fn of(white: White, f0: f64, f90: f64) -> Self {
        let [a, b] = white.mean;
        let multiple = white.multiple(DVec3::splat(f0 + (f90 - f0) / 21.0)).x;
        Self { white, f0, f90, multiple, mean: f0 * a + f90 * b + multiple * white.mean_lost }
    }

    pub fn at(&self, w: DVec3) -> f64 {
        let [a, b] = self.white.grain.albedo(w);
        self.f0 * a + self.f90 * b + self.multiple * (1.0 - a - b)
    }
}

/// GGX.
pub(super) fn distribution(half: DVec3, [a, b]: [f64; 2]) -> f64 {
    let slope = (half.x / a).powi(2) + (half.y / b).powi(2) + half.z * half.z;
    FRAC_1_PI / (a * b * slope * slope)
}

/// Smith's function of GGX.
pub(super) fn lambda(w: DVec3, [a, b]: [f64; 2]) -> f64 {
    let tangent2 = ((a * w.x).powi(2) + (b * w.y).powi(2)) / (w.z * w.z);
    ((1.0 + tangent2).sqrt() - 1.0) / 2.0
}

/// Density of [`sample`] per solid angle.
pub(super) fn pdf(grain: Grain, wo: DVec3, wi: DVec3) -> f64 {
    if wi.z <= 0.0 {
        return 0.0;
    }
    0.5 * wi.z * FRAC_1_PI + 0.5 * microfacet_pdf(grain, wo, wi)
}

/// Density of [`microfacet_sample`] per solid angle.
pub(super) fn microfacet_pdf(grain: Grain, wo: DVec3, wi: DVec3) -> f64 {
    let half = (wo + wi).normalize();
    distribution(half, grain.alphas()) * half.z / (4.0 * half.dot(wo))
}

/// A direction: half of them by the cosine, half by a microfacet (Walter et al. 2007, eq. 35 and 36). It may be below the surface.
pub(super) fn sample(grain: Grain, wo: DVec3, rng: &mut Pcg64) -> DVec3 {
    if rng.uniform() < 0.5 {
        return cosine_hemisphere(DVec3::Z, rng);
    }
    microfacet_sample(grain, wo, rng)
}

/// The mirror direction about a microfacet. It may be below the surface.
pub(super) fn microfacet_sample(grain: Grain, wo: DVec3, rng: &mut Pcg64) -> DVec3 {
    let (u, phi) = (rng.uniform(), TAU * rng.uniform());
    let [a, b] = grain.alphas();
    let slope = (u / (1.0 - u)).sqrt();
    let half = DVec3::new(a * slope * phi.cos(), b * slope * phi.sin(), 1.0).normalize();
    2.0 * half.dot(wo) * half - wo
}
