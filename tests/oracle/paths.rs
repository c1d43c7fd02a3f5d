//! What counts as a path: depth, direct light only, and one-sided emission. And the image as a whole.

use glam::DVec3;
use photolith::oracle::{OracleSettings, Pcg64, primary_ray, render as render_with};
use photolith::scene::*;

use crate::*;

/// A ray at 45 degrees between two horizontal plates hits 1 or 2 of them, then leaves for the background.
fn plates(surface: fn(f64) -> Surface, hits: u32) -> Scene {
    let mut scene = empty();
    scene.background = grey(3.0);
    scene.quad(floor(0.0, 1.0), surface(0.5));
    if hits == 2 {
        scene.quad([v(1.0, 2.0, -9.0), v(9.0, 2.0, -9.0), v(9.0, 2.0, 9.0), v(1.0, 2.0, 9.0)], surface(0.5));
    }
    scene
}

fn look(scene: &Scene, max_depth: u32, indirect: bool) -> f64 {
    let mut scene = scene.clone();
    scene.integrator.max_depth = max_depth;
    scene.integrator.indirect = indirect;
    trace(&scene, v(-1.0, 1.0, 0.0), v(1.0, -1.0, 0.0), &mut Pcg64::new(3, 3)).x
}

#[test]
fn the_last_hit_still_has_its_direct_light() {
    for background_is_emitter in [false, true] {
        let with = |surface: fn(f64) -> Surface, hits: u32| {
            let mut scene = plates(surface, hits);
            if background_is_emitter {
                scene.background = grey(0.0);
                scene.sphere(DVec3::ZERO, 100.0, emitter(3.0)).inward = true;
            }
            scene
        };
        assert_eq!(look(&with(mirror, 1), 1, true), 1.5);
        assert_eq!(look(&with(mirror, 2), 1, true), 0.0);
        assert_eq!(look(&with(mirror, 2), 2, true), 0.75);
        assert_eq!(look(&with(mirror, 2), 2, false), 0.75, "mirrors are followed without indirect light");
        assert_eq!(look(&with(diffuse, 1), 1, true), 1.5);
        assert_eq!(look(&with(diffuse, 1), 9, false), 1.5);
    }
}

#[test]
fn without_indirect_light_a_path_ends_at_the_first_diffuse_hit() {
    let mut closed = empty();
    closed.sphere(DVec3::ZERO, 9.0, diffuse(0.5));
    closed.light(DVec3::ZERO, grey(1.0));
    assert_eq!(look(&closed, 9, false), look(&closed, 1, true));
    assert!(look(&closed, 9, true) > 1.9 * look(&closed, 1, true));
}

#[test]
fn emitters_emit_from_the_front_only_and_reflect_nothing() {
    let mut scene = empty();
    scene.sphere(DVec3::ZERO, 1.0, emitter(2.0));
    scene.light(v(0.0, 0.0, 3.0), grey(50.0));
    scene.background = grey(7.0);
    let mut rng = Pcg64::new(0, 0);
    assert_eq!(trace(&scene, v(0.0, 0.0, 2.0), DVec3::NEG_Z, &mut rng).x, 2.0);
    assert_eq!(trace(&scene, DVec3::ZERO, DVec3::NEG_Z, &mut rng).x, 0.0);
    assert_eq!(trace(&scene, v(0.0, 0.0, 2.0), DVec3::Z, &mut rng).x, 7.0);
}

#[test]
fn film_is_seen_the_right_way_round() {
    let mut scene = empty();
    (scene.film.width, scene.film.height) = (40, 20);
    let half = 30f64.to_radians().tan();
    for (x, y, direction) in [
        (20.0, 10.0, v(0.0, 0.0, -1.0)),
        (0.0, 0.0, v(-half, half / 2.0, -1.0)),
        (40.0, 0.0, v(half, half / 2.0, -1.0)),
        (20.0, 20.0, v(0.0, -half / 2.0, -1.0)),
    ] {
        let ray = primary_ray(&scene, glam::DVec2::new(x, y), glam::DVec2::ZERO);
        assert!((ray.direction - direction.normalize()).length() < 1e-15);
    }
    scene.sphere(v(-2.0, 1.0, -5.0), 0.5, emitter(1.0));
    let image = render(&scene, 4);
    let brightest = (0..800).max_by(|&a, &b| image.mean[a][0].total_cmp(&image.mean[b][0])).unwrap();
    assert!(brightest % 40 < 20 && brightest / 40 < 10);
}

/// A scene with everything in it, for tests of invariance.
fn everything(scale: f64) -> Scene {
    let mut scene = empty();
    scene.camera.position = v(0.0, 0.5, 4.0) * scale;
    scene.camera.target = v(0.0, 0.0, -1.0) * scale;
    scene.film.filter = PixelFilter::Gaussian;
    scene.background = [0.1, 0.3, 0.2];
    scene.quad(floor(-1.0, 3.0).map(|p| p * scale), diffuse(0.7));
    scene.sphere(v(-1.0, 0.0, -1.0) * scale, 0.8 * scale, mirror(0.9));
    scene.sphere(v(1.0, 0.0, -1.0) * scale, 0.8 * scale, glass(1.5));
    scene.sphere(v(0.0, 0.0, -1003.0) * scale, 1000.0 * scale, diffuse(0.5));
    scene.sphere(v(2.0, 2.0, -1.0) * scale, 0.5 * scale, emitter(4.0));
    scene.light(v(1.0, 3.0, 2.0) * scale, grey(200.0 * scale * scale));
    scene
}

#[test]
fn scale_by_a_power_of_two_keeps_every_bit() {
    let expected = render(&everything(1.0), 16).mean;
    for exponent in [-200, -20, 20, 200] {
        assert!(render(&everything(2f64.powi(exponent)), 16).mean == expected, "2^{exponent}");
    }
}

#[test]
fn seed_alone_decides() {
    let scene = everything(1.0);
    let settings = OracleSettings { samples: 4, seed: 1 };
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let image = render_with(&scene, &settings);
    assert_eq!(image, one_thread.install(|| render_with(&scene, &settings)));
    assert_ne!(image, render_with(&scene, &OracleSettings { seed: 2, ..settings }));
}

/// The variance that the image states is that between images.
#[test]
fn stated_variance_is_the_real_one() {
    let scene = everything(1.0);
    let images: Vec<_> = (0..40).map(|seed| render_with(&scene, &OracleSettings { samples: 8, seed })).collect();
    let (mut between, mut stated) = (0.0, 0.0);
    for pixel in 0..64 {
        let values: Vec<f64> = images.iter().map(|i| i.mean[pixel][1]).collect();
        let mean = values.iter().sum::<f64>() / 40.0;
        between += values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 39.0;
        stated += images.iter().map(|i| i.variance_of_mean[pixel][1]).sum::<f64>() / 40.0;
    }
    assert_close(between, stated, 0.15);
}
