//! Conductors: Fresnel's equations for an index η + ik, with complex numbers, and microfacets as in the metallic-roughness model.

use glam::{DVec2, DVec3};

use crate::oracle::metallic_roughness::{Grain, White, scattering};
use crate::scene::{Conductor, Reflection};

/// f(wo, wi)·cos θi in the frame of the normal.
pub fn eval(c: &Conductor, wo: DVec3, wi: DVec3) -> DVec3 {
    if wo.z <= 0.0 || wi.z <= 0.0 {
        return DVec3::ZERO;
    }
    let cosine = (wo + wi).normalize().dot(wo);
    scattering(&White::of(Grain::even(c.roughness)), reflectance(c, cosine), mean_reflectance(c), wo, wi) * wi.z
}

fn reflectance(c: &Conductor, cosine: f64) -> DVec3 {
    match c.reflection {
        Reflection::Constant(reflectance) => reflectance.into(),
        Reflection::Index { eta, k } => [0, 1, 2].map(|i| fresnel(cosine, eta[i], k[i])).into(),
    }
}

/// Weighted with the cosine.
fn mean_reflectance(c: &Conductor) -> DVec3 {
    const POINTS: u32 = 100;
    let mu = |i: u32| (f64::from(i) + 0.5) / f64::from(POINTS);
    (0..POINTS).map(|i| 2.0 * mu(i) * reflectance(c, mu(i))).sum::<DVec3>() / f64::from(POINTS)
}

/// Part of unpolarised light that an interface of index η + ik reflects under a cosine.
pub fn fresnel(cosine: f64, eta: f64, k: f64) -> f64 {
    // Complex numbers are vectors.
    let times = |a: DVec2, b: DVec2| a.rotate(b);
    let index = DVec2::new(eta, k);
    let index2 = times(index, index);
    let inside = complex_root(index2 - DVec2::new(1.0 - cosine * cosine, 0.0));
    let outside = DVec2::new(cosine, 0.0);
    let part = |a: DVec2, b: DVec2| (a - b).length_squared() / (a + b).length_squared();
    0.5 * (part(outside, inside) + part(times(index2, outside), inside))
}

fn complex_root(z: DVec2) -> DVec2 {
    DVec2::from_angle(0.5 * z.y.atan2(z.x)) * z.length().sqrt()
}
