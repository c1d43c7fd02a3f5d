//! What lies over the metallic-roughness model, as docs/rendering.md defines it.

use glam::DVec3;

use crate::oracle::Pcg64;
use crate::oracle::metallic_roughness::{self, Albedo, Grain, White, reflection};
use crate::oracle::sheen;
use crate::scene::MetallicRoughness;

/// A direction in the frames of the base and of the coat.
#[derive(Debug, Clone, Copy)]
pub struct Local {
    /// About the normal of the base.
    pub base: DVec3,
    /// About the normal of the coat.
    pub coat: DVec3,
}

/// Reflectance of a coat of index 1.5 at normal incidence.
const COAT_F0: f64 = 0.04;

/// f(wo, wi)·cos θi.
pub fn eval(m: &MetallicRoughness, wo: Local, wi: Local) -> DVec3 {
    let [mut specular, mut diffuse] = metallic_roughness::parts(m, wo.base, wi.base);
    if m.coat == 0.0 && m.sheen_color == [0.0; 3] {
        return (specular + diffuse) * wi.base.z;
    }
    let coat = coat_albedo(m);
    let of_coat = [wo, wi].map(|w| coat(w.coat.z));
    let of_sheen = [wo, wi].map(|w| sheen::albedo(m, w.base.z));
    let [coat_passes, sheen_passes] = [of_coat, of_sheen].map(|of| of.map(|albedo| 1.0 - albedo));
    let between = metallic_roughness::normal_reflectance(m) * of_coat[0].min(of_coat[1]);
    specular *= coat_passes[0] * coat_passes[1] / (1.0 - between) * sheen_passes[0].min(sheen_passes[1]);
    let base = metallic_roughness::let_through(m);
    let all = |cosine| base(cosine) * (1.0 - coat(cosine)) * (1.0 - sheen::albedo(m, cosine));
    diffuse *= coat_passes[0] * coat_passes[1] * sheen_passes[0] * sheen_passes[1] * mean(&base) / mean(all);
    let mut sum = (specular + diffuse) * wi.base.z;
    if m.sheen_color != [0.0; 3] {
        sum += sheen::eval(m, wo.base, wi.base) * coat_passes[0].min(coat_passes[1]);
    }
    if m.coat > 0.0 && wo.coat.z > 0.0 && wi.coat.z > 0.0 {
        let white = White::of(Grain::even(m.coat_roughness));
        sum += m.coat * reflection(&white, DVec3::splat(COAT_F0), 1.0, wo.coat, wi.coat) * wi.coat.z;
    }
    sum
}

/// The part of light under a cosine that the coat reflects.
fn coat_albedo(m: &MetallicRoughness) -> impl Fn(f64) -> f64 {
    let albedo = Albedo::of(White::of(Grain::even(m.coat_roughness)), COAT_F0, 1.0);
    let strength = m.coat;
    move |cosine| strength * albedo.at(DVec3::new(0.0, 0.0, cosine))
}

/// The mean over the hemisphere, weighted with the cosine.
fn mean(of: impl Fn(f64) -> f64) -> f64 {
    const POINTS: u32 = 64;
    // 2 μ dμ = 4 x³ dx where μ = x².
    let point = |i: u32| (f64::from(i) + 0.5) / f64::from(POINTS);
    let (mut sum, mut weights) = (0.0, 0.0);
    for x in (0..POINTS).map(point) {
        sum += x.powi(3) * of(x * x);
        weights += x.powi(3);
    }
    sum / weights
}

/// Density of directions of [`samples_coat`] and of the base together, per solid angle.
pub fn pdf(m: &MetallicRoughness, wo: Local, wi: Local) -> f64 {
    let base = metallic_roughness::pdf(Grain::of(m), wo.base, wi.base);
    if m.coat == 0.0 {
        return base;
    }
    let of_coat = if wi.coat.z > 0.0 {
        metallic_roughness::microfacet_pdf(Grain::even(m.coat_roughness), wo.coat, wi.coat)
    } else {
        0.0
    };
    COAT_SHARE * of_coat + (1.0 - COAT_SHARE) * base
}

/// Of directions where there is a coat.
const COAT_SHARE: f64 = 1.0 / 3.0;

/// Whether a direction is to be drawn by microfacets of the coat, and not by the base.
pub fn samples_coat(m: &MetallicRoughness, rng: &mut Pcg64) -> bool {
    m.coat > 0.0 && rng.uniform() < COAT_SHARE
}
