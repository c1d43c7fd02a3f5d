//! Mirrors and glass against the laws of optics.

use glam::DVec3;
use photolith::oracle::{self, Pcg64, conductor, fresnel, reflect, refract};

use crate::*;

#[test]
fn furnace_stays_at_one() {
    let mut scene = empty();
    scene.background = grey(1.0);
    scene.integrator.max_depth = 10_000;
    scene.sphere(v(-1.5, 0.0, -5.0), 1.2, mirror(1.0));
    scene.sphere(v(1.2, 0.0, -5.0), 1.3, glass(1.5));
    scene.sphere(v(1.2, 0.0, -5.0), 1.2, glass(1.5)).inward = true;
    scene.sphere(v(0.0, 1.8, -6.0), 0.9, glass(2.4));
    scene.quad(floor(-1.4, 20.0), mirror(1.0));
    for mean in render(&scene, 64).mean {
        assert_eq!(mean, [1.0; 3]);
    }
}

/// Mirrors at x = ±1, a diffuse wall at z = -30; unfolded, the ray is straight.
#[test]
fn mirror_corridor_unfolds() {
    let (r, light, end) = (0.9f64, v(0.3, 0.2, -28.0), -30.0f64);
    let mut scene = empty();
    scene.integrator.max_depth = 40;
    scene.integrator.indirect = false;
    for x in [-1.0, 1.0] {
        scene.quad([v(x, -9.0, 9.0), v(x, 9.0, 9.0), v(x, 9.0, -90.0), v(x, -9.0, -90.0)], mirror(r));
    }
    scene.quad([v(-9.0, -9.0, end), v(9.0, -9.0, end), v(9.0, 9.0, end), v(-9.0, 9.0, end)], diffuse(0.5));
    scene.light(light, grey(100.0));
    let mut rng = Pcg64::new(0, 0);
    for bounces in 0..=30 {
        let unfolded = 2.0 * f64::from(bounces) + 0.37;
        let x = if bounces % 2 == 0 { 0.37 } else { -0.37 };
        let l = light - v(x, 0.0, end);
        let pi = std::f64::consts::PI;
        let expected = r.powi(bounces) * 0.5 / pi * 100.0 * l.z / (4.0 * pi * l.length().powi(3));
        assert_close(trace(&scene, DVec3::ZERO, v(unfolded, 0.0, end), &mut rng).x, expected, 1e-11);
    }
}

/// A slab of glass between z = -1 and z = -2, its normals outwards.
fn slab(ior: f64) -> Scene {
    let mut scene = empty();
    let face = |z: f64| [v(-50.0, -50.0, z), v(50.0, -50.0, z), v(50.0, 50.0, z), v(-50.0, 50.0, z)];
    scene.quad(face(-1.0), glass(ior));
    let mut back = face(-2.0);
    back.reverse();
    scene.quad(back, glass(ior));
    scene
}

#[test]
fn slab_transmits_by_fresnel_at_normal_incidence() {
    let mut scene = slab(1.5);
    scene.integrator.max_depth = 100;
    scene.quad([v(-9.0, -9.0, -3.0), v(9.0, -9.0, -3.0), v(9.0, 9.0, -3.0), v(-9.0, 9.0, -3.0)], emitter(1.0));
    assert_close(fresnel(1.0, 1.5), 0.04, 1e-15);
    let mut rng = Pcg64::new(16, 0);
    assert_mean((1.0 - 0.04) / (1.0 + 0.04), 1e-3, 200_000, || {
        trace(&scene, v(0.1, 0.2, 0.0), DVec3::NEG_Z, &mut rng).x
    });
}

#[test]
fn slab_shifts_oblique_rays_sideways() {
    let (scene, n) = (slab(1.5), 1.5f64);
    for degrees in [1.0f64, 20.0, 45.0, 70.0, 85.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let origin = v(0.0, 0.0, 0.0);
        let direction = v(sin, 0.0, -cos);
        let first = hit(&scene, origin, direction);
        assert!(first.front);
        let inside = refract(direction, first.normal, n).unwrap();
        let second = oracle::trace::closest_hit(&scene, &first.spawn(inside)).unwrap();
        assert!(!second.front);
        let outside = refract(inside, second.normal, 1.0 / n).unwrap();
        assert!((outside - direction).length() < 1e-14);
        let shift = (second.position - origin).cross(direction).length();
        assert_close(shift, sin * (1.0 - cos / (n * n - sin * sin).sqrt()), 1e-12);
    }
}

#[test]
fn fresnel_and_snell_agree_with_textbook_angles() {
    for ior in [1.0001, 1.33, 1.5, 2.4, 1.0 / 1.5, 1.0 / 1.33] {
        for i in 1..900 {
            let theta = (f64::from(i) / 10.0).to_radians();
            let sin_t = theta.sin() / ior;
            let f = fresnel(theta.cos(), ior);
            let refracted = refract(v(theta.sin(), 0.0, -theta.cos()), DVec3::Z, ior);
            if sin_t >= 1.0 {
                assert_eq!((f, refracted), (1.0, None));
                continue;
            }
            // Fresnel's sine and tangent laws
            let t = sin_t.asin();
            let s = (theta - t).sin() / (theta + t).sin();
            let p = (theta - t).tan() / (theta + t).tan();
            assert!((f - 0.5 * (s * s + p * p)).abs() < 1e-9, "ior {ior}, {} degrees", f64::from(i) / 10.0);
            assert!((refracted.unwrap() - v(t.sin(), 0.0, -t.cos())).length() < 1e-12);
        }
        let brewster = ior.atan();
        let s = (brewster - (brewster.sin() / ior).asin()).sin();
        assert_close(fresnel(brewster.cos(), ior), 0.5 * s * s, 1e-6);
        // grazing: F = 1 - 2 cos (ior² + 1) / sqrt(ior² - 1) to first order
        if ior > 1.01 {
            let slope = 2.0 * (ior * ior + 1.0) / (ior * ior - 1.0).sqrt();
            assert!((fresnel(1e-8, ior) - (1.0 - 1e-8 * slope)).abs() < 1e-12);
        }
        assert_eq!(fresnel(0.0, ior), 1.0);
    }
    assert_eq!(reflect(v(0.6, 0.0, -0.8), DVec3::Z), v(0.6, 0.0, 0.8));
}

/// Numbers of Mitsuba 3.9.1 (`fresnel_conductor`, single precision).
#[test]
fn conductors_reflect_what_others_say() {
    for (cosine, eta, k, expected) in [
        (0.5, 0.2, 3.9, 0.94588208),
        (0.05, 1.6575, 9.2238, 0.87771428),
        (0.9, 1.1, 2.1, 0.50150996),
        (1.0, 0.143, 3.983, 0.96668738),
    ] {
        assert_close(conductor::fresnel(cosine, eta, k), expected, 1e-6);
    }
}

#[test]
fn fresnel_is_continuous_at_the_critical_angle() {
    let critical = (1.0f64 - 1.0 / 2.25).sqrt();
    for step in 0..1000 {
        let above = critical * (1.0 + 1e-10 * f64::from(step));
        let f = fresnel(above, 1.0 / 1.5);
        assert!((0.0..=1.0).contains(&f) && 1.0 - f < 3e-3);
        assert!(step == 0 || f < 1.0);
        assert_eq!(fresnel(critical * (1.0 - 1e-10 * f64::from(step + 1)), 1.0 / 1.5), 1.0);
    }
}

#[test]
fn glass_of_index_one_is_invisible() {
    let mut bare = empty();
    bare.background = [0.1, 0.2, 0.3];
    bare.sphere(v(0.5, 0.2, -9.0), 2.0, emitter(2.0));
    let mut with_glass = bare.clone();
    with_glass.sphere(v(0.0, 0.0, -4.0), 1.5, glass(1.0));
    with_glass.quad(floor(-0.5, 3.0), glass(1.0));
    assert_eq!(render(&bare, 16).mean, render(&with_glass, 16).mean);
    for degrees in 0..=80 {
        let cosine = f64::from(degrees).to_radians().cos();
        assert_eq!(fresnel(cosine, 1.0), 0.0);
        assert!(fresnel(cosine, 1.0001) < 1e-4 && fresnel(cosine, 1.0 / 1.0001) < 1e-4);
    }
}

#[test]
fn camera_in_a_glass_sphere_sees_out_below_the_critical_angle() {
    let mut scene = empty();
    scene.background = grey(1.0);
    scene.integrator.max_depth = 2000;
    scene.sphere(DVec3::ZERO, 2.0, glass(1.5));
    let mut rng = Pcg64::new(21, 0);
    let distance = 1.8;
    for i in 1..180 {
        let psi = f64::from(i).to_radians();
        let direction = v(psi.sin(), 0.0, psi.cos());
        let incidence = distance * psi.sin() / 2.0;
        let seen = hit(&scene, v(0.0, 0.0, distance), direction);
        assert!((-seen.normal.dot(direction) - (1.0 - incidence * incidence).sqrt()).abs() < 1e-14);
        // a chord of a sphere keeps its angle: what is reflected totally once is so for ever
        let out = trace(&scene, v(0.0, 0.0, distance), direction, &mut rng).x;
        assert_eq!(out, if incidence > 1.0 / 1.5 { 0.0 } else { 1.0 }, "at {i} degrees");
    }
}
