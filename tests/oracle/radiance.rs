//! Diffuse scenes whose radiance is known.

use std::f64::consts::PI;

use glam::DVec3;
use photolith::oracle::{Hit, Pcg64, direct_irradiance};
use photolith::scene::*;

use crate::*;

/// A closed diffuse sphere of radius 3, the camera off its centre, a light of power 10.
fn closed_sphere(reflectance: Rgb, max_depth: u32, light: DVec3) -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = max_depth;
    scene.camera.position = v(0.3, -1.0, 1.2);
    scene.sphere(DVec3::ZERO, 3.0, Surface::diffuse(reflectance)).inward = true;
    scene.light(light, grey(10.0));
    scene
}

#[test]
fn closed_sphere_lit_from_its_centre_is_exact_in_every_sample() {
    let rho: Rgb = [0.2, 0.5, 0.9];
    for depth in [1, 2, 7] {
        let image = render(&closed_sphere(rho, depth, DVec3::ZERO), 4);
        for (mean, variance) in image.mean.iter().zip(&image.variance_of_mean) {
            for c in 0..3 {
                let series = (1.0 - rho[c].powi(depth as i32)) / (1.0 - rho[c]);
                let expected = 10.0 * rho[c] / (4.0 * PI * PI * 9.0) * series;
                assert_close(mean[c], expected, 1e-12);
                assert!(variance[c] <= (1e-12 * expected).powi(2));
            }
        }
    }
}

#[test]
fn closed_sphere_without_absorption_is_linear_in_the_depth() {
    let mut scene = closed_sphere(grey(1.0), 1000, DVec3::ZERO);
    (scene.film.width, scene.film.height) = (4, 4);
    for mean in render(&scene, 1).mean {
        assert_close(mean[0], 1000.0 * 10.0 / (4.0 * PI * PI * 9.0), 1e-12);
    }
}

#[test]
fn closed_sphere_lit_off_centre_has_a_constant_indirect_part() {
    let light = v(0.0, 1.5, 0.5);
    let scene = closed_sphere(grey(0.7), 6, light);
    let mut rng = Pcg64::new(2, 0);
    let direction = v(0.2, 0.9, -0.4);
    let seen = hit(&scene, scene.camera.position, direction).position;
    let to_light = light - seen;
    let direct = 10.0 * to_light.dot(-seen / 3.0) / (4.0 * PI * to_light.length().powi(3));
    let bounces: f64 = (1..6).map(|k| 0.7f64.powi(k)).sum();
    let expected = 0.7 / PI * (direct + bounces * 10.0 / (4.0 * PI * 9.0));
    assert_mean(expected, 1e-3, 100_000, || trace(&scene, scene.camera.position, direction, &mut rng).x);
}

#[test]
fn black_is_exactly_black() {
    let mut scene = closed_sphere(grey(0.0), 10, v(0.0, 1.5, 0.5));
    scene.background = grey(1.0);
    assert!(render(&scene, 4).mean.iter().all(|&m| m == [0.0; 3]));
}

/// Corners at distance `radius`, and triangles counter-clockwise from outside.
fn octahedron(radius: f64) -> ([DVec3; 6], [[u32; 3]; 8]) {
    let corners = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z].map(|p| radius * p);
    let faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
    (corners, faces)
}

#[test]
fn convex_body_in_a_uniform_background_shows_its_reflectance() {
    let (mut sphere, mut octahedron) = (empty(), empty());
    sphere.sphere(DVec3::ZERO, 2.0, diffuse(0.6));
    let (points, faces) = self::octahedron(2.0);
    octahedron.mesh(&points, &faces, diffuse(0.6));
    for mut scene in [sphere, octahedron] {
        scene.background = grey(1.0);
        scene.camera = Camera {
            position: v(3.0, 5.0, 6.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            horizontal_fov: 9.0,
            ..Camera::default()
        };
        for mean in render(&scene, 4).mean {
            assert_close(mean[0], 0.6, 1e-15);
        }
    }
}

#[test]
fn lambert_plane_and_sphere_under_a_point_light() {
    let light = v(3.0, 7.0, -2.0);
    let mut scene = empty();
    scene.integrator.max_depth = 1;
    scene.quad(floor(-1.0, 50.0), diffuse(0.4));
    scene.sphere(v(0.0, 2.0, -20.0), 3.0, diffuse(0.8));
    scene.light(light, grey(500.0));
    let lambert = |p: DVec3, n: DVec3, rho: f64| {
        let l = light - p;
        rho / PI * 500.0 * l.dot(n).max(0.0) / (4.0 * PI * l.length().powi(3))
    };
    let mut rng = Pcg64::new(1, 1);
    for i in 0..100 {
        let p = v(f64::from(i) / 10.0, -1.0, -8.0 - f64::from(i % 7));
        assert_close(trace(&scene, DVec3::ZERO, p, &mut rng).x, lambert(p, DVec3::Y, 0.4), 1e-12);
        let n = (v(0.0, -0.3, 1.0) + 0.4 * uniform_direction(&mut rng)).normalize();
        let p = v(0.0, 2.0, -20.0) + 3.0 * n;
        assert_close(trace(&scene, DVec3::ZERO, p, &mut rng).x, lambert(p, n, 0.8), 1e-10);
    }
}

#[test]
fn irradiance_of_a_spherical_emitter() {
    let mut scene = empty();
    scene.integrator.max_depth = 1;
    scene.quad(floor(0.0, 1.0), diffuse(0.5));
    scene.sphere(v(3.0, 4.0, 0.0), 2.0, emitter(6.0));
    let mut rng = Pcg64::new(5, 0);
    // the whole emitter is above the horizon: E = pi L (r/d)^2 cos, so that the radiance is rho L (r/d)^2 cos
    assert_mean(0.5 * 6.0 * (2.0f64 / 5.0).powi(2) * 0.8, 6e-3, 200_000, || {
        trace(&scene, v(-1.0, 1.0, 0.0), v(1.0, -1.0, 0.0), &mut rng).x
    });
}

/// All flux of an emitting body arrives at the closed shell around it, and none that the body absorbs comes back.
#[test]
fn flux_of_emitters_in_a_closed_sphere() {
    let (rho, shell) = (0.5, 3.0f64);
    let (sphere, octahedron) = (1.2f64, 2.0f64);
    let absorbed = (sphere / shell).powi(2);
    // (body, area, depth, the shell's gain: 1 after one hit, a geometric series in (1 - absorbed) rho after many)
    for (body, area, depth, gain) in [
        (0, 4.0 * PI * sphere * sphere, 1, 1.0),
        (0, 4.0 * PI * sphere * sphere, 200, 1.0 / (1.0 - (1.0 - absorbed) * rho)),
        (1, 8.0 * 3f64.sqrt() / 4.0 * 2.0 * octahedron * octahedron, 1, 1.0),
    ] {
        let mut scene = empty();
        scene.integrator.max_depth = depth;
        scene.integrator.russian_roulette = Some(3);
        scene.sphere(DVec3::ZERO, shell, diffuse(rho)).inward = true;
        if body == 0 {
            scene.sphere(DVec3::ZERO, sphere, emitter(7.0));
        } else {
            let (points, faces) = self::octahedron(octahedron);
            scene.mesh(&points, &faces, emitter(7.0));
        }
        let expected = rho / PI * (PI * 7.0 * area) / (4.0 * PI * shell * shell) * gain;
        let mut rng = Pcg64::new(8, u128::from(depth));
        assert_mean(expected, 5e-3, 400_000, || {
            let n = uniform_direction(&mut rng);
            trace(&scene, 2.5 * n, n, &mut rng).x
        });
    }
}

/// Concentric spheres, which become parallel plates as their gap closes: by symmetry of the form factors
/// the mean radiosities obey the two-surface balance exactly, however uneven the light is.
#[test]
fn light_between_two_spheres_balances() {
    let (r1, r2, rho1, rho2, power, d) = (6.0f64, 10.0f64, 0.6, 0.8, 100.0, 8.2f64);
    let mut scene = empty();
    scene.integrator.max_depth = 200;
    scene.integrator.russian_roulette = Some(4);
    scene.sphere(DVec3::ZERO, r1, diffuse(rho1));
    scene.sphere(DVec3::ZERO, r2, diffuse(rho2)).inward = true;
    scene.light(v(0.0, d, 0.0), grey(power));
    let direct1 = power * 0.5 * (1.0 - (1.0 - (r1 / d).powi(2)).sqrt());
    let f21 = (r1 / r2).powi(2);
    // in1 = direct1 + f21 out2, in2 = direct2 + out1 + (1 - f21) out2, out = rho in
    let in2 = (power - direct1 + rho1 * direct1) / (1.0 - rho2 * (1.0 - f21) - f21 * rho1 * rho2);
    let in1 = direct1 + f21 * rho2 * in2;
    let mut rng = Pcg64::new(14, 0);
    for (sign, radiosity) in [(-1.0, rho1 * in1 / (4.0 * PI * r1 * r1)), (1.0, rho2 * in2 / (4.0 * PI * r2 * r2))] {
        let start = 0.5 * (r1 + r2);
        assert_mean(radiosity / PI, 5e-3, 200_000, || {
            let n = uniform_direction(&mut rng);
            trace(&scene, start * n, sign * n, &mut rng).x
        });
    }
}

#[test]
fn roulette_keeps_the_mean() {
    let mut scene = closed_sphere([0.3, 0.5, 0.7], 30, v(0.0, 1.5, 0.5));
    let (without, error) = render(&scene, 300).global_mean();
    scene.integrator.russian_roulette = Some(1);
    let (with, roulette_error) = render(&scene, 300).global_mean();
    for c in 0..3 {
        let sigma = error[c].hypot(roulette_error[c]);
        assert!(sigma < 0.01 * without[c] && (with[c] - without[c]).abs() < 4.0 * sigma);
    }
}

#[test]
fn shading_normals_give_the_cosine_and_geometry_the_side() {
    let tilted = v(1.0, 1.0, 0.0).normalize();
    let irradiance = |light: DVec3| {
        let mut scene = empty();
        let mesh = scene.quad(floor(0.0, 10.0), diffuse(1.0));
        mesh.normals = Normals::Smooth;
        mesh.vertex_normals = vec![tilted; 4];
        scene.light(light, grey(4.0 * PI));
        let seen: Hit = hit(&scene, v(0.1, 1.0, 0.2), DVec3::NEG_Y);
        assert_close(seen.shading_normal.dot(tilted), 1.0, 1e-15);
        assert_eq!(seen.normal, DVec3::Y);
        (direct_irradiance(&scene, &seen).x, light - seen.position)
    };
    let (lit, l) = irradiance(v(0.5, 2.0, 0.0));
    assert_close(lit, l.normalize().dot(tilted) / l.length_squared(), 1e-14);
    assert_eq!(irradiance(v(5.0, -1.0, 0.0)).0, 0.0, "in front by the shading normal only");
    assert_eq!(irradiance(v(-5.0, 1.0, 0.0)).0, 0.0, "in front by the geometric normal only");
}

/// What a tilted shading normal scatters below the surface is lost: of a cosine lobe tilted by α, (1 - cos α)/2. Single directions are bent
/// until they leave the surface.
#[test]
fn nothing_is_scattered_through_an_opaque_surface() {
    let alpha = 50f64.to_radians();
    let tilted = v(alpha.sin(), alpha.cos(), 0.0);
    let mut rng = Pcg64::new(50, 0);
    let floor_of = |surface: Surface, direction: DVec3| {
        let mut scene = empty();
        scene.background = grey(1.0);
        let mesh = scene.quad(floor(0.0, 10.0), surface);
        mesh.normals = Normals::Smooth;
        mesh.vertex_normals = vec![tilted; 4];
        move |rng: &mut Pcg64| trace(&scene, v(0.1, 1.0, 0.2), direction, rng).x
    };
    let lobe = floor_of(diffuse(1.0), DVec3::NEG_Y);
    assert_mean(0.5 * (1.0 + alpha.cos()), 2e-3, 100_000, || lobe(&mut rng));
    // the mirror direction of a vertical ray lies 2α from the zenith: below the horizon here
    assert_eq!(floor_of(mirror(1.0), DVec3::NEG_Y)(&mut rng), 1.0);
    assert_eq!(floor_of(mirror(1.0), v(-0.5, -1.0, 0.0))(&mut rng), 1.0);
}

#[test]
fn lights_enclosed_or_touching_do_not_break_anything() {
    let mut scene = empty();
    scene.quad(floor(0.0, 10.0), diffuse(1.0));
    scene.sphere(v(0.0, 3.0, 0.0), 1.0, glass(1.5));
    scene.light(v(0.0, 3.0, 0.0), grey(1.0));
    let seen = hit(&scene, v(2.0, 1.0, 0.0), DVec3::NEG_Y);
    assert_eq!(direct_irradiance(&scene, &seen), DVec3::ZERO, "glass casts full shadows");
    scene.light(seen.position, grey(1.0));
    assert_eq!(direct_irradiance(&scene, &seen), DVec3::ZERO, "a light on the very point");
}
