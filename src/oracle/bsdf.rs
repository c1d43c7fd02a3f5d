//! How surfaces scatter light: two functions for every BSDF, as in the shaders, but none of their code.
//!
//! `wo` points to where the path came from, `wi` to where it goes on, both of unit length. The path arrives on the side of the
//! hit's normals.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

use crate::oracle::glass::Glass;
use crate::oracle::layered::Local;
use crate::oracle::metallic_roughness::Grain;
use crate::oracle::{Hit, Pcg64, conductor, layered, metallic_roughness};
use crate::scene::{Bsdf, MetallicRoughness};

/// Where a path goes on.
#[derive(Debug, Clone, Copy)]
pub struct Scattered {
    /// Of unit length.
    pub direction: DVec3,
    /// f·|cos θi|/pdf.
    pub weight: DVec3,
    /// To the other side of the surface.
    pub crosses: bool,
    /// It is one of single directions.
    pub is_delta: bool,
}

/// The part of a material that lets light through, and what of its other parts is left.
fn split(m: &MetallicRoughness) -> (f64, MetallicRoughness) {
    let part = (1.0 - m.metallic) * m.transmission;
    let metallic = if part < 1.0 { m.metallic / (1.0 - part) } else { 0.0 };
    (part, MetallicRoughness { metallic, ..*m })
}

/// f(wo, wi)·|cos θi|; 0 where single directions are scattered into.
pub fn eval(bsdf: &Bsdf, hit: &Hit, wo: DVec3, wi: DVec3) -> DVec3 {
    let above = wi.dot(hit.normal) > 0.0;
    match *bsdf {
        Bsdf::Diffuse { .. } if !above => DVec3::ZERO,
        Bsdf::Diffuse { reflectance } => DVec3::from(reflectance) * wi.dot(hit.shading_normal).max(0.0) * FRAC_1_PI,
        Bsdf::Mirror { .. } | Bsdf::Dielectric { .. } | Bsdf::Black => DVec3::ZERO,
        Bsdf::MetallicRoughness(m) => {
            let frames = Frames::of(hit, wo);
            let (wo, wi) = (frames.to_local(wo), frames.to_local(wi));
            // The shading normal has it on the wrong side.
            if above != (wi.base.z > 0.0) {
                return DVec3::ZERO;
            }
            let (part, opaque) = split(&m);
            let glass = if part > 0.0 { part * Glass::of(&m, hit.front).eval(wo.base, wi.base) } else { DVec3::ZERO };
            if above { glass + (1.0 - part) * layered::eval(&opaque, wo, wi) } else { glass }
        }
        Bsdf::Conductor(c) => {
            let frame = Frame::of(hit.shading_normal, hit, wo);
            conductor::eval(&c, frame.to_local(wo), frame.to_local(wi))
        }
    }
}

/// Draws where a path goes on. `None` ends it: nothing is scattered, or the shading normal of a surface that is not smooth has sent the
/// ray to the wrong side.
///
/// Where that of a mirror or of smooth glass does, it is bent until the ray leaves within the surface.
pub fn sample(bsdf: &Bsdf, hit: &Hit, wo: DVec3, rng: &mut Pcg64) -> Option<Scattered> {
    let scattered = match *bsdf {
        Bsdf::Diffuse { reflectance } => Scattered {
            direction: cosine_hemisphere(hit.shading_normal, rng),
            weight: reflectance.into(),
            crosses: false,
            is_delta: false,
        },
        Bsdf::Mirror { reflectance } => Scattered {
            direction: reflect(-wo, hit.shading_normal),
            weight: reflectance.into(),
            crosses: false,
            is_delta: true,
        },
        Bsdf::Dielectric { ior } => {
            let normal = hit.shading_normal;
            let ior = if hit.front { ior } else { 1.0 / ior };
            let reflectance = fresnel(wo.dot(normal).max(0.0), ior);
            let refracted = refract(-wo, normal, ior).filter(|_| reflectance == 0.0 || rng.uniform() >= reflectance);
            Scattered {
                direction: refracted.unwrap_or_else(|| reflect(-wo, normal)),
                weight: DVec3::ONE,
                crosses: refracted.is_some(),
                is_delta: true,
            }
        }
        Bsdf::Black => return None,
        Bsdf::MetallicRoughness(m) => {
            let (part, opaque) = split(&m);
            if part > 0.0 && rng.uniform() < part {
                through_glass(&Glass::of(&m, hit.front), hit, wo, rng)?
            } else {
                let frames = Frames::of(hit, wo);
                let o = frames.to_local(wo);
                let direction = if layered::samples_coat(&opaque, rng) {
                    frames.coat.to_world(metallic_roughness::microfacet_sample(
                        Grain::even(m.coat_roughness),
                        o.coat,
                        rng,
                    ))
                } else {
                    frames.base.to_world(metallic_roughness::sample(Grain::of(&opaque), o.base, rng))
                };
                let i = frames.to_local(direction);
                let pdf = layered::pdf(&opaque, o, i);
                if pdf == 0.0 {
                    return None;
                }
                Scattered { direction, weight: layered::eval(&opaque, o, i) / pdf, crosses: false, is_delta: false }
            }
        }
        Bsdf::Conductor(c) => {
            let frame = Frame::of(hit.shading_normal, hit, wo);
            let (o, grain) = (frame.to_local(wo), Grain::even(c.roughness));
            let i = metallic_roughness::sample(grain, o, rng);
            if i.z <= 0.0 {
                return None;
            }
            let weight = conductor::eval(&c, o, i) / metallic_roughness::pdf(grain, o, i);
            Scattered { direction: frame.to_world(i), weight, crosses: false, is_delta: false }
        }
    };
    let up = if scattered.crosses { -hit.normal } else { hit.normal };
    let direction = match scattered.direction {
        direction if direction.dot(up) > 0.0 => direction,
        direction if scattered.is_delta => grazing(direction, up),
        _ => return None,
    };
    Some(Scattered { direction, ..scattered })
}

/// Fresnel's equations keep the normal of what is smooth, that of what is rough is bent.
fn through_glass(glass: &Glass, hit: &Hit, wo: DVec3, rng: &mut Pcg64) -> Option<Scattered> {
    let is_delta = glass.is_smooth();
    let normal = hit.shading_normal;
    let frame = if is_delta { Frame::about(hit, normal) } else { Frame::of(normal, hit, wo) };
    let (wi, weight, crosses) = glass.sample(frame.to_local(wo), rng)?;
    Some(Scattered { direction: frame.to_world(wi), weight, crosses, is_delta })
}

/// Two tangents and the normal that a microfacet model is evaluated about: the shading normal, or, where that would show the mirror
/// image of what lies below the surface, the one that shows what lies just above (Keller et al., "The Iray light transport simulation
/// and rendering system", 2017, A.3).
struct Frame([DVec3; 3]);

/// Those of a base and of its coat.
struct Frames {
    base: Frame,
    coat: Frame,
}

impl Frames {
    fn of(hit: &Hit, wo: DVec3) -> Self {
        let [base, coat] = [hit.shading_normal, hit.coat_normal].map(|normal| Frame::of(normal, hit, wo));
        Self { base, coat }
    }

    fn to_local(&self, w: DVec3) -> Local {
        Local { base: self.base.to_local(w), coat: self.coat.to_local(w) }
    }
}

impl Frame {
    fn of(shading_normal: DVec3, hit: &Hit, wo: DVec3) -> Self {
        let mirror = reflect(-wo, shading_normal);
        let normal = if mirror.dot(hit.normal) > 0.0 {
            shading_normal
        } else {
            (wo + (mirror.reject_from_normalized(hit.normal) + 1e-6 * hit.normal).normalize()).normalize()
        };
        Self::about(hit, normal)
    }

    fn about(hit: &Hit, normal: DVec3) -> Self {
        let tangent = hit.tangent.reject_from_normalized(normal).normalize_or(normal.any_orthonormal_vector());
        Self([tangent, normal.cross(tangent), normal])
    }

    fn to_local(&self, w: DVec3) -> DVec3 {
        self.0.map(|axis| axis.dot(w)).into()
    }

    fn to_world(&self, w: DVec3) -> DVec3 {
        (w.x * self.0[0] + w.y * self.0[1] + w.z * self.0[2]).normalize()
    }
}

/// The direction just above a surface that is nearest to one below it.
fn grazing(direction: DVec3, up: DVec3) -> DVec3 {
    (direction.reject_from_normalized(up) + 1e-4 * up).normalize()
}

/// Share of unpolarised light that a smooth interface reflects (Fresnel's equations).
///
/// `cosine` is that of the angle of incidence, 0..=1; `ior` the index of the far side over that of the near
/// side. 1 on total internal reflection; 0 for `ior == 1` at any angle.
pub fn fresnel(cosine: f64, ior: f64) -> f64 {
    if ior == 1.0 {
        return 0.0;
    }
    let Some(transmitted) = transmitted_cosine(cosine, ior) else {
        return 1.0;
    };
    let perpendicular = (cosine - ior * transmitted) / (cosine + ior * transmitted);
    let parallel = (ior * cosine - transmitted) / (ior * cosine + transmitted);
    0.5 * (perpendicular * perpendicular + parallel * parallel)
}

/// Cosine of the angle of refraction by Snell's law; `None` on total internal reflection, grazing included.
fn transmitted_cosine(cosine: f64, ior: f64) -> Option<f64> {
    // cos² = 1 - sin²θ / ior², written so that nothing cancels where θ or ior - 1 is small
    let cosine2 = ((ior - 1.0) * (ior + 1.0) + cosine * cosine) / (ior * ior);
    (cosine2 > 0.0).then(|| cosine2.sqrt())
}

/// The mirror direction of `direction` about `normal` (of either sign).
pub fn reflect(direction: DVec3, normal: DVec3) -> DVec3 {
    (direction - 2.0 * direction.dot(normal) * normal).normalize()
}

/// The direction behind the interface, or `None` on total internal reflection. `ior` as for [`fresnel`].
pub fn refract(direction: DVec3, normal: DVec3, ior: f64) -> Option<DVec3> {
    if ior == 1.0 {
        return Some(direction);
    }
    let cosine = -direction.dot(normal);
    let transmitted = transmitted_cosine(cosine, ior)?;
    Some((direction / ior + (cosine / ior - transmitted) * normal).normalize())
}

/// A direction about `normal` with density cos θ / π in solid angle (Malley's method).
pub fn cosine_hemisphere(normal: DVec3, rng: &mut Pcg64) -> DVec3 {
    let (u, v) = (rng.uniform(), rng.uniform());
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let (sin, cos) = (TAU * v).sin_cos();
    (u.sqrt() * (cos * tangent + sin * bitangent) + (1.0 - u).sqrt() * normal).normalize()
}
