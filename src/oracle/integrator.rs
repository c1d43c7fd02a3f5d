//! The rendering equation, one path at a time. The module `oracle` states what a path is.

use std::f64::consts::PI;

use glam::DVec3;

use super::Pcg64;
use super::bsdf::{cosine_hemisphere, fresnel, reflect, refract};
use super::trace::{Hit, Ray, closest_hit, occluded};
use crate::scene::{Light, Scene, Surface};

/// An estimate of the radiance that arrives at the ray's origin; its mean over `rng` is exact.
///
/// The ray's direction must be of unit length.
pub fn radiance(scene: &Scene, mut ray: Ray, rng: &mut Pcg64) -> DVec3 {
    let mut radiance = DVec3::ZERO;
    let mut throughput = DVec3::ONE;
    let mut last_hit = scene.integrator.max_depth;
    let mut depth = 0;
    while let Some(hit) = closest_hit(scene, &ray) {
        depth += 1;
        let surface = &scene.materials[hit.material].surface;
        if let Surface::Emitter { radiance: emitted } = surface {
            let emitted = if hit.front { DVec3::from(*emitted) } else { DVec3::ZERO };
            return radiance + throughput * emitted;
        }
        if depth > last_hit {
            return radiance;
        }
        if let Surface::Diffuse { reflectance } = surface {
            radiance += throughput * DVec3::from(*reflectance) / PI * direct_irradiance(scene, &hit);
            if !scene.integrator.indirect {
                last_hit = depth;
            }
        }
        let Some((direction, weight)) = scatter(surface, ray.direction, &hit, rng) else {
            return radiance;
        };
        throughput *= weight;
        if scene.integrator.russian_roulette.is_some_and(|first| depth >= first) {
            let survival = throughput.max_element().min(0.95);
            if rng.uniform() >= survival {
                return radiance;
            }
            throughput /= survival;
        }
        ray = hit.spawn(direction);
    }
    radiance + throughput * DVec3::from(scene.background)
}

/// Draws where a path goes on, and its weight BSDF·cos/pdf. `None` ends it: the surface only emits, or the
/// shading normal has sent the ray to the wrong side of the surface.
fn scatter(surface: &Surface, direction: DVec3, hit: &Hit, rng: &mut Pcg64) -> Option<(DVec3, DVec3)> {
    let normal = hit.shading_normal;
    let (scattered, weight, crosses) = match *surface {
        Surface::Diffuse { reflectance } => (cosine_hemisphere(normal, rng), reflectance.into(), false),
        Surface::Mirror { reflectance } => (reflect(direction, normal), reflectance.into(), false),
        Surface::Dielectric { ior } => {
            let ior = if hit.front { ior } else { 1.0 / ior };
            let reflectance = fresnel((-direction.dot(normal)).max(0.0), ior);
            match refract(direction, normal, ior) {
                Some(refracted) if reflectance == 0.0 || rng.uniform() >= reflectance => (refracted, DVec3::ONE, true),
                _ => (reflect(direction, normal), DVec3::ONE, false),
            }
        }
        Surface::Emitter { .. } => return None,
    };
    let side = scattered.dot(hit.normal);
    let allowed = if crosses { side < 0.0 } else { side > 0.0 };
    allowed.then_some((scattered, weight))
}

/// Irradiance from all point lights at a hit, on the side that the ray came from.
pub fn direct_irradiance(scene: &Scene, hit: &Hit) -> DVec3 {
    let mut irradiance = DVec3::ZERO;
    for light in &scene.lights {
        let Light::Point { position, power } = light;
        let to_light = *position - hit.position;
        let distance = to_light.length();
        // also false where the light lies on the very point
        let lit = to_light.dot(hit.normal) > 0.0 && to_light.dot(hit.shading_normal) > 0.0;
        if lit && !occluded(scene, &hit.spawn(to_light), 1.0) {
            let cosine = to_light.dot(hit.shading_normal) / distance;
            irradiance += DVec3::from(*power) * cosine / (4.0 * PI * distance * distance);
        }
    }
    irradiance
}
