//! The rendering equation, one path at a time. The module `oracle` states what a path is.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};

use crate::oracle::trace::{Hit, Ray, closest_hit, transmittance};
use crate::oracle::{Pcg64, bsdf};
use crate::scene::{Bsdf, Light, Material, Scene, Surface};

/// An estimate of the radiance that arrives at the ray's origin; its mean over `rng` is exact.
///
/// The ray's direction must be of unit length.
pub fn radiance(scene: &Scene, mut ray: Ray, rng: &mut Pcg64) -> DVec3 {
    let mut radiance = DVec3::ZERO;
    let mut throughput = DVec3::ONE;
    let mut last_hit = scene.integrator.max_depth;
    let mut depth = 0;
    let mut medium = DVec3::ZERO;
    let mut way = 0.0;
    while let Some(hit) = closest_hit(scene, &ray) {
        if hit.coverage < 1.0 && rng.uniform() >= hit.coverage {
            way += hit.t;
            ray = hit.spawn(ray.direction);
            continue;
        }
        depth += 1;
        let behind = absorption(&scene.materials[hit.material]);
        if let Some(body) = behind.filter(|_| !hit.front) {
            medium = body;
        }
        let sides = match behind {
            Some(body) => [medium, if hit.front { body } else { DVec3::ZERO }],
            None => [medium; 2],
        };
        throughput *= (-medium * (way + hit.t)).exp();
        way = 0.0;
        let Surface { bsdf, emission, two_sided } = hit.surface;
        if hit.front || two_sided {
            radiance += throughput * DVec3::from(emission);
        }
        if depth > last_hit {
            return radiance;
        }
        let wo = -ray.direction;
        radiance += throughput * direct_light(scene, &hit, sides, |wi| bsdf::eval(&bsdf, &hit, wo, wi));
        let Some(scattered) = bsdf::sample(&bsdf, &hit, wo, rng) else {
            return radiance;
        };
        if !scene.integrator.indirect && !scattered.is_delta {
            last_hit = depth;
        }
        throughput *= scattered.weight;
        medium = sides[usize::from(scattered.crosses)];
        if scene.integrator.russian_roulette.is_some_and(|first| depth >= first) {
            let survival = throughput.max_element().min(0.95);
            if rng.uniform() >= survival {
                return radiance;
            }
            throughput /= survival;
        }
        ray = hit.spawn(scattered.direction);
    }
    radiance + throughput * background(scene, ray.direction, depth > 0)
}

/// What a body absorbs on a length of 1; `None` for what has no inside.
fn absorption(material: &Material) -> Option<DVec3> {
    match material.surface.bsdf {
        Bsdf::MetallicRoughness(m) if m.has_volume && m.transmission > 0.0 => {
            let per_distance = DVec3::from(m.attenuation_color).max(DVec3::splat(1e-40)).map(f64::ln);
            Some(-per_distance / m.attenuation_distance)
        }
        _ => None,
    }
}

/// Radiance from where a ray meets nothing; `reflected`: not by the camera's own ray.
fn background(scene: &Scene, direction: DVec3, reflected: bool) -> DVec3 {
    let Some(map) = &scene.environment else { return scene.background.into() };
    if !map.visible && !reflected {
        return DVec3::ZERO;
    }
    let d = DQuat::from_rotation_y(-map.rotation.to_radians()) * direction;
    let (width, height) = (i64::from(map.width), i64::from(map.height));
    let x = (0.5 + d.x.atan2(-d.z) / TAU) * f64::from(map.width) - 0.5;
    let y = d.y.clamp(-1.0, 1.0).acos() / PI * f64::from(map.height) - 0.5;
    let pixel = |i: f64, j: f64| {
        let (i, j) = ((i as i64).rem_euclid(width), (j as i64).clamp(0, height - 1));
        DVec3::from(map.texels[(j * width + i) as usize].map(f64::from))
    };
    let row = |j: f64| pixel(x.floor(), j).lerp(pixel(x.floor() + 1.0, j), x - x.floor());
    map.scale * row(y.floor()).lerp(row(y.floor() + 1.0), y - y.floor())
}

/// Light from all point lights at a hit, as `scatter` (f·cos) passes it on. `sides`: what the media on the side that the ray came from,
/// and on the other one, absorb on a length of 1.
fn direct_light(scene: &Scene, hit: &Hit, sides: [DVec3; 2], scatter: impl Fn(DVec3) -> DVec3) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for light in &scene.lights {
        let (to_light, far) = match light {
            Light::Point { position, .. } | Light::Spot { position, .. } => (*position - hit.position, 1.0),
            Light::Directional { direction, .. } => (-direction.normalize(), f64::INFINITY),
        };
        let distance = to_light.length();
        // also false where the light lies on the very point
        let scattered = if distance > 0.0 { scatter(to_light / distance) } else { DVec3::ZERO };
        if scattered.max_element() > 0.0 {
            let medium = sides[usize::from(to_light.dot(hit.normal) <= 0.0)];
            // What goes to infinity is in no body.
            let left = if far.is_finite() { (-medium * distance).exp() } else { DVec3::ONE };
            let passes = transmittance(scene, &hit.spawn(to_light), far);
            sum += passes * left * irradiance(light, to_light / distance, distance) * scattered;
        }
    }
    sum
}

/// Irradiance at a distance from a light, which lies in the direction `wi`, on a surface that faces it.
fn irradiance(light: &Light, wi: DVec3, distance: f64) -> DVec3 {
    let color = DVec3::from(light.color());
    match *light {
        Light::Point { .. } => color / (4.0 * PI * distance * distance),
        Light::Directional { .. } => color,
        Light::Spot { direction, inner, outer, range, .. } => {
            let cosine = -wi.dot(direction.normalize());
            let [inner, outer] = [inner, outer].map(|angle: f64| angle.to_radians().cos());
            let part = if inner <= -1.0 { 1.0 } else { ((cosine - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0) };
            let window = (1.0 - (distance / range).powi(4)).max(0.0);
            color * part * part * window / (distance * distance)
        }
    }
}

/// Irradiance from all point lights at a hit, on the side that the ray came from.
pub fn direct_irradiance(scene: &Scene, hit: &Hit) -> DVec3 {
    let cosine = |wi: DVec3| if wi.dot(hit.normal) > 0.0 { wi.dot(hit.shading_normal).max(0.0) } else { 0.0 };
    direct_light(scene, hit, [DVec3::ZERO; 2], |wi| DVec3::splat(cosine(wi)))
}
