//! The rendering equation, one path at a time. The module `oracle` states what a path is.

use std::f64::consts::PI;

use glam::DVec3;

use crate::oracle::trace::{Hit, Ray, closest_hit, transmittance};
use crate::oracle::{Pcg64, bsdf};
use crate::scene::{Bsdf, Light, Scene, Surface};

/// An estimate of the radiance that arrives at the ray's origin; its mean over `rng` is exact.
///
/// The ray's direction must be of unit length.
pub fn radiance(scene: &Scene, mut ray: Ray, rng: &mut Pcg64) -> DVec3 {
    let mut radiance = DVec3::ZERO;
    let mut throughput = DVec3::ONE;
    let mut last_hit = scene.integrator.max_depth;
    let mut depth = 0;
    while let Some(hit) = closest_hit(scene, &ray) {
        if hit.coverage < 1.0 && rng.uniform() >= hit.coverage {
            ray = hit.spawn(ray.direction);
            continue;
        }
        depth += 1;
        let Surface { bsdf, emission, two_sided } = hit.surface;
        if hit.front || two_sided {
            radiance += throughput * DVec3::from(emission);
        }
        if depth > last_hit {
            return radiance;
        }
        let wo = -ray.direction;
        radiance += throughput * direct_light(scene, &hit, |wi| bsdf::eval(&bsdf, &hit, wo, wi));
        if !scene.integrator.indirect && matches!(bsdf, Bsdf::Diffuse { .. } | Bsdf::MetallicRoughness(_)) {
            last_hit = depth;
        }
        let Some((direction, weight)) = bsdf::sample(&bsdf, &hit, wo, rng) else {
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

/// Light from all point lights at a hit, on the side that the ray came from, as `scatter` (f·cos) passes it on.
fn direct_light(scene: &Scene, hit: &Hit, scatter: impl Fn(DVec3) -> DVec3) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for light in &scene.lights {
        let Light::Point { position, power } = light;
        let to_light = *position - hit.position;
        let distance = to_light.length();
        // also false where the light lies on the very point
        if to_light.dot(hit.normal) > 0.0 {
            let passes = transmittance(scene, &hit.spawn(to_light), 1.0);
            let irradiance = passes * DVec3::from(*power) / (4.0 * PI * distance * distance);
            sum += irradiance * scatter(to_light / distance);
        }
    }
    sum
}

/// Irradiance from all point lights at a hit, on the side that the ray came from.
pub fn direct_irradiance(scene: &Scene, hit: &Hit) -> DVec3 {
    direct_light(scene, hit, |wi| DVec3::splat(wi.dot(hit.shading_normal).max(0.0)))
}
