//! Random scenes, on the device and by the oracle: the same geometry is seen, and the same light.

use std::ops::ControlFlow;

use glam::DVec3;
use photolith::oracle::{self, OracleSettings};
use photolith::scene::*;
use photolith::{Context, RenderSettings, Renderer};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};

use crate::harness::context;

const SIDE: u32 = 16;
/// Images of each scene.
const SEEDS: u32 = 16;
/// Deviations beyond this many standard errors fail: with the fixed seed of the runner, chance has had its say.
const ALLOWED: f64 = 5.0;

fn point(half: f64) -> impl Strategy<Value = DVec3> {
    [-half..half, -half..half, -half..half].prop_map(DVec3::from)
}

fn surface() -> impl Strategy<Value = Surface> {
    let rgb = || [0.1..0.95, 0.1..0.95, 0.1..0.95];
    prop_oneof![
        3 => rgb().prop_map(Surface::diffuse),
        1 => rgb().prop_map(Surface::mirror),
        1 => (1.05..2.0).prop_map(Surface::dielectric),
        1 => rgb().prop_map(Surface::emitter),
    ]
}

/// Triangles of a box turned about an axis.
fn block(center: DVec3, half: DVec3, turn: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        let p = half * DVec3::new(sign(0), sign(1), sign(2));
        center + glam::DQuat::from_rotation_y(turn) * p
    };
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    ((0..8).map(corner).collect(), triangles)
}

fn scene() -> impl Strategy<Value = Scene> {
    let spheres = prop::collection::vec((point(3.0), 0.2..1.2, surface()), 1..5);
    let blocks = prop::collection::vec((point(3.0), 0.2..1.0, 0.0..3.0, surface()), 0..3);
    let lights = prop::collection::vec((point(4.0), 5.0..80.0), 0..3);
    let background = [0.0..0.5, 0.0..0.5, 0.0..0.5];
    (spheres, blocks, lights, background, 1u32..6).prop_map(|(spheres, blocks, lights, background, max_depth)| {
        let mut scene = Scene {
            source: "random".into(),
            camera: Camera {
                position: DVec3::new(0.5, 1.0, 8.0),
                target: DVec3::ZERO,
                up: DVec3::Y,
                horizontal_fov: 50.0,
                ..Camera::default()
            },
            film: Film {
                width: SIDE,
                height: SIDE,
                filter: PixelFilter::Gaussian,
                transfer: Transfer::Srgb,
                ..Film::default()
            },
            integrator: Integrator { max_depth, samples: 1, russian_roulette: None, indirect: true },
            background,
            lights: lights.into_iter().map(|(position, power)| Light::Point { position, power: [power; 3] }).collect(),
            ..Scene::default()
        };
        let mut material = |surface| {
            let name = scene.materials.len().to_string();
            scene.materials.push(Material::new(name, surface));
            scene.materials.len() as u32 - 1
        };
        for (center, radius, surface) in spheres {
            let material = material(surface);
            // The camera stays outside, and a light inside of a sphere is a case of its own.
            scene.spheres.push(Sphere { center, radius, material, inward: false });
        }
        for (center, half, turn, surface) in blocks {
            let material = material(surface);
            let (positions, triangles) = block(center, half * DVec3::new(1.0, 0.7, 0.5), turn);
            scene.meshes.push(Mesh {
                name: "block".into(),
                triangle_materials: vec![material; triangles.len()],
                positions,
                vertex_normals: vec![],
                triangles,
                normals: Normals::Flat,
                ..Mesh::default()
            });
        }
        scene
    })
}

/// The scene with every surface shining in a colour of its own: what is seen is which surface is nearest.
fn painted(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.lights.clear();
    scene.integrator.max_depth = 1;
    scene.background = [0.0; 3];
    for (i, material) in scene.materials.iter_mut().enumerate() {
        let shade = |k: usize| 0.25 + 0.75 * ((i * k + k) % 7) as f64 / 7.0;
        material.surface = Surface::emitter([shade(1), shade(2), shade(3)]);
    }
    scene
}

/// Mean of an image, per channel.
fn mean(film: &photolith::Film) -> [f64; 3] {
    let of = |c: usize| film.sums().iter().zip(film.counts()).map(|(sum, &n)| sum[c] / f64::from(n)).sum::<f64>();
    [0, 1, 2].map(|c| of(c) / f64::from(SIDE * SIDE))
}

/// Deviation of the image's mean from the oracle's in standard errors, the worst of the channels. Pixels may share paths, so that
/// images of several seeds tell the error.
fn deviation(context: &Context, scene: &Scene, samples: u32, oracle_samples: u32) -> f64 {
    let settings = RenderSettings { samples: samples / SEEDS, ..RenderSettings::of(scene) };
    let mut renderer = Renderer::new(context, scene, &settings).expect("a renderer");
    let mut image = |seed| {
        renderer.set_seed(seed);
        mean(&renderer.render(|_| ControlFlow::Continue(())).expect("a film"))
    };
    let means: Vec<_> = (0..SEEDS).map(&mut image).collect();
    let (exact, exact_error) =
        oracle::render(scene, &OracleSettings { samples: oracle_samples, seed: 5 }).global_mean();
    let n = f64::from(SEEDS);
    let of_channel = |c: usize| {
        let mean = means.iter().map(|m| m[c]).sum::<f64>() / n;
        let variance = means.iter().map(|m| (m[c] - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
        let off = (mean - exact[c]).abs();
        if off < 1e-6 { 0.0 } else { off / (variance + exact_error[c].powi(2)).sqrt() }
    };
    let all = [0, 1, 2].map(of_channel);
    assert!(all.iter().all(|z| z.is_finite()), "{all:?}");
    all.into_iter().fold(0.0, f64::max)
}

#[test]
fn random_scenes_agree_with_the_oracle() {
    let context = context();
    // The default runner draws a new seed each time; this one does not.
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut runner = TestRunner::new_with_rng(Config { cases: 8, max_shrink_iters: 24, ..Config::default() }, rng);
    let outcome = runner.run(&scene(), |scene| {
        scene.validate().map_err(|e| TestCaseError::reject(e.to_string()))?;
        let geometry = deviation(&context, &painted(&scene), 64, 256);
        prop_assert!(geometry < ALLOWED, "geometry is off by {geometry:.1} standard errors");
        let light = deviation(&context, &scene, 256, 256);
        prop_assert!(light < ALLOWED, "light is off by {light:.1} standard errors");
        Ok(())
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
}
