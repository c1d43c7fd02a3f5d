//! The dielectric of the metallic-roughness model where it lets light through, as docs/rendering.md defines it, in the frame of a normal:
//! `z` is the cosine, below 0 beyond the surface.
//!
//! The albedo of single scattering is read from the tables that define it; all else is computed here from the formulas.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

use crate::ggx_albedo::{self, alpha_of};
use crate::glass_albedo;
use crate::oracle::metallic_roughness::{dielectric, distribution, lambda};
use crate::oracle::{Pcg64, cosine_hemisphere, fresnel, reflect, refract};
use crate::scene::MetallicRoughness;

/// An interface, seen from one side.
#[derive(Debug, Clone, Copy)]
pub struct Glass {
    /// The part of light that is left of what crosses.
    pub tint: DVec3,
    /// Reflectance at normal incidence, and at grazing.
    pub f0: DVec3,
    /// The latter.
    pub f90: f64,
    /// 0..=1.
    pub roughness: f64,
    /// Index of refraction of the far side over that of the near side; of a wall, of its matter.
    pub eta: f64,
    /// Both sides of a thin wall, in which light is not bent.
    pub is_wall: bool,
}

impl Glass {
    /// That of a material, seen from its front or its back.
    pub fn of(m: &MetallicRoughness, front: bool) -> Self {
        let (f0, f90) = dielectric(m);
        Self {
            tint: m.base_color.into(),
            f0,
            f90,
            roughness: m.roughness,
            eta: if front || !m.has_volume { m.ior } else { 1.0 / m.ior },
            is_wall: !m.has_volume,
        }
    }

    /// Whether it scatters into single directions.
    pub fn is_smooth(&self) -> bool {
        alpha_of(self.roughness) <= ggx_albedo::MIN_ALPHA || (!self.is_wall && (self.eta - 1.0).abs() <= 1e-3)
    }

    /// Parts of light under a cosine that are reflected and that cross.
    fn parts(&self, cosine: f64) -> [DVec3; 2] {
        let exact = fresnel(cosine, self.eta);
        let normal = ((self.eta - 1.0) / (self.eta + 1.0)).powi(2);
        let mixed = self.f0 + (self.f90 - self.f0) * (exact - normal) / (1.0 - normal);
        let reflected = if exact == 1.0 { DVec3::ONE } else { mixed.clamp(DVec3::ZERO, DVec3::ONE) };
        let passed = DVec3::ONE - reflected;
        if !self.is_wall {
            return [reflected, passed * self.tint];
        }
        // Light goes to and fro in the wall, and some of it leaves at every turn.
        let mut sums = [reflected, DVec3::ZERO];
        let mut within = passed;
        for turn in 0..10_000 {
            within *= self.tint;
            sums[(turn + 1) % 2] += within * passed;
            within *= reflected;
            if within.max_element() < 1e-12 {
                break;
            }
        }
        sums
    }

    /// f(wo, wi)·|cos θi|.
    pub fn eval(&self, wo: DVec3, wi: DVec3) -> DVec3 {
        if wo.z <= 0.0 || wi.z == 0.0 || self.is_smooth() {
            return DVec3::ZERO;
        }
        self.single(wo, wi) + self.multiple(wo, wi)
    }

    /// A microfacet's normal between two directions, and the density of wi over that of the normal; `None` if there is none.
    fn facet(&self, wo: DVec3, wi: DVec3) -> Option<(DVec3, f64)> {
        if wi.z > 0.0 || self.is_wall {
            let half = (wo + wi.with_z(wi.z.abs())).normalize();
            return Some((half, 1.0 / (4.0 * half.dot(wo))));
        }
        // Walter et al. 2007, eq. 16 and 17.
        let half = (wo + self.eta * wi).normalize_or_zero();
        let half = if half.z < 0.0 { -half } else { half };
        let (o, i) = (half.dot(wo), half.dot(wi));
        (o > 0.0 && i < 0.0).then(|| (half, self.eta * self.eta * i.abs() / (o + self.eta * i).powi(2)))
    }

    fn single(&self, wo: DVec3, wi: DVec3) -> DVec3 {
        let Some((half, jacobian)) = self.facet(wo, wi) else { return DVec3::ZERO };
        let alpha = alpha_of(self.roughness);
        let g2 = 1.0 / (1.0 + lambda(wo, alpha) + lambda(wi, alpha));
        let [reflected, crossed] = self.parts(half.dot(wo));
        let part = if wi.z > 0.0 { reflected } else { crossed };
        part * distribution(half, alpha) * g2 * half.dot(wo) * jacobian / wo.z
    }

    /// What single scattering loses of light under a cosine, or in the mean; from wo's side or from beyond.
    fn lost(&self, cosine: Option<f64>, beyond: bool) -> f64 {
        let eta = if beyond { 1.0 / self.eta } else { self.eta };
        1.0 - match (self.is_wall, cosine) {
            (true, Some(cosine)) => ggx_albedo::table().albedo(cosine, self.roughness).iter().sum::<f64>(),
            (true, None) => ggx_albedo::table().mean_of(self.roughness).iter().sum(),
            (false, Some(cosine)) => glass_albedo::table().albedo(cosine, self.roughness, eta),
            (false, None) => glass_albedo::table().mean_of(self.roughness, eta),
        }
    }

    fn multiple(&self, wo: DVec3, wi: DVec3) -> DVec3 {
        let crosses = wi.z < 0.0;
        let far2 = if self.is_wall { 1.0 } else { self.eta * self.eta };
        let all = self.lost(None, false) + far2 * self.lost(None, true);
        let weight = if crosses { far2 } else { 1.0 };
        let tint = if crosses || self.is_wall { self.tint } else { DVec3::ONE };
        let lost = self.lost(Some(wo.z), false) * self.lost(Some(wi.z.abs()), crosses);
        tint * (lost * weight / all * FRAC_1_PI * wi.z.abs())
    }

    /// Density of [`Self::sample`] per solid angle where the interface is rough.
    pub fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        let of_facet = self.facet(wo, wi).map_or(0.0, |(half, jacobian)| {
            distribution(half, alpha_of(self.roughness))
                * half.z
                * jacobian
                * if half.dot(wo) > 0.0 { 1.0 } else { 0.0 }
        });
        0.4 * of_facet + 0.1 * wi.z.abs() * FRAC_1_PI
    }

    /// A direction, its weight f·|cos θ|/pdf, and whether it crosses the interface; `None` if the weight is 0.
    pub fn sample(&self, wo: DVec3, rng: &mut Pcg64) -> Option<(DVec3, DVec3, bool)> {
        if self.is_smooth() {
            return self.sample_smooth(wo, rng);
        }
        let wi = self.draw(wo, rng)?;
        let weight = self.eval(wo, wi) / self.pdf(wo, wi);
        (weight.max_element() > 0.0).then_some((wi, weight, wi.z < 0.0))
    }

    fn sample_smooth(&self, wo: DVec3, rng: &mut Pcg64) -> Option<(DVec3, DVec3, bool)> {
        let [reflected, crossed] = self.parts(wo.z.max(0.0));
        let share = reflected.element_sum() / (reflected + crossed).element_sum();
        if rng.uniform() < share {
            return Some((reflect(-wo, DVec3::Z), reflected / share, false));
        }
        let through = if self.is_wall { Some(-wo) } else { refract(-wo, DVec3::Z, self.eta) };
        through.map(|wi| (wi, crossed / (1.0 - share), true))
    }

    /// Two fifths each by a microfacet that reflects and by one that lets light through, a tenth each by the cosine to either side.
    fn draw(&self, wo: DVec3, rng: &mut Pcg64) -> Option<DVec3> {
        let kind = rng.uniform();
        if kind < 0.2 {
            let wi = cosine_hemisphere(DVec3::Z, rng);
            return Some(if kind < 0.1 { wi } else { -wi });
        }
        let (u, phi) = (rng.uniform(), TAU * rng.uniform());
        let tangent = alpha_of(self.roughness) * (u / (1.0 - u)).sqrt();
        let half = DVec3::new(tangent * phi.cos(), tangent * phi.sin(), 1.0).normalize();
        let mirrored = 2.0 * half.dot(wo) * half - wo;
        let reflects = kind < 0.6;
        let wi = match (reflects, self.is_wall) {
            (true, _) => mirrored,
            (false, true) => mirrored.with_z(-mirrored.z),
            (false, false) => refract(-wo, half, self.eta)?,
        };
        (half.dot(wo) > 0.0 && (wi.z > 0.0) == reflects).then_some(wi)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn white(roughness: f64, eta: f64, is_wall: bool) -> Glass {
        let f0 = DVec3::splat(((eta - 1.0) / (eta + 1.0)).powi(2));
        Glass { tint: DVec3::ONE, f0, f90: 1.0, roughness, eta, is_wall }
    }

    #[test]
    fn white_glass_loses_no_light() {
        let mut rng = Pcg64::for_pixel(5, 0);
        for (eta, is_wall) in [(1.5, false), (1.0 / 1.5, false), (2.4, false), (1.5, true)] {
            for roughness in [0.0, 0.3, 0.7, 1.0] {
                for mu in [0.3f64, 0.9] {
                    let wo = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
                    let glass = white(roughness, eta, is_wall);
                    let (mut sum, mut squares, n) = (0.0, 0.0, 40_000);
                    for _ in 0..n {
                        let weight = glass.sample(wo, &mut rng).map_or(0.0, |(_, weight, _)| weight.x);
                        (sum, squares) = (sum + weight, squares + weight * weight);
                    }
                    let mean = sum / f64::from(n);
                    let error = ((squares / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt();
                    let off = (mean - 1.0).abs();
                    assert!(off < 2e-3 + 4.0 * error, "{mean} ± {error}: {glass:?} at {mu}");
                }
            }
        }
    }

    #[test]
    fn a_wall_reflects_on_both_sides() {
        // A pane of index 1.5 at normal incidence: 2R/(1 + R), and (1 − R)/(1 + R).
        let [reflected, crossed] = white(0.5, 1.5, true).parts(1.0);
        assert!((reflected.x - 0.08 / 1.04).abs() < 1e-12 && (crossed.x - 0.96 / 1.04).abs() < 1e-12);
    }
}
