//! Light that must not be lost: emitters in the plane of what they are fixed to, mirrors and glass with smooth normals, emitters that
//! shine on both sides.

use crate::harness::{context, render};
use glam::DVec3;
use photolith::oracle::{self, OracleSettings};
use photolith::scene::{
    Camera, Film as FilmShape, Integrator, Material, Mesh, Normals, PixelFilter, Surface, Transfer,
};
use photolith::{Context, RenderSettings, Scene};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Nothing, seen by a camera.
fn empty(position: DVec3, target: DVec3, horizontal_fov: f64, side: u32, samples: u32) -> Scene {
    Scene {
        source: "test".into(),
        camera: Camera { position, target, up: DVec3::Y, horizontal_fov, ..Camera::default() },
        film: FilmShape {
            width: side,
            height: side,
            filter: PixelFilter::Box,
            transfer: Transfer::Srgb,
            ..FilmShape::default()
        },
        integrator: Integrator { max_depth: 1, samples, russian_roulette: None, indirect: true },
        ..Scene::default()
    }
}

fn material(scene: &mut Scene, surface: Surface) -> u32 {
    scene.materials.push(Material::new(scene.materials.len().to_string(), surface));
    scene.materials.len() as u32 - 1
}

/// A square of n×n quadrilaterals around a point at height y, whose front is below.
fn square(scene: &mut Scene, y: f64, half: f64, n: u32, surface: Surface) {
    let material = material(scene, surface);
    let step = |i: u32| half * (2.0 * f64::from(i) / f64::from(n) - 1.0);
    let positions = (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))).map(|(i, j)| v(step(i), y, step(j))).collect();
    let at = |i: u32, j: u32| j * (n + 1) + i;
    let triangles: Vec<_> = (0..n)
        .flat_map(|j| (0..n).map(move |i| (i, j)))
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
        .collect();
    scene.meshes.push(Mesh {
        name: "square".into(),
        positions,
        vertex_normals: vec![],
        triangle_materials: vec![material; triangles.len()],
        triangles,
        normals: Normals::Flat,
        ..Mesh::default()
    });
}

/// The pixels' means and what these are on average.
fn pixels(context: &Context, scene: &Scene) -> (Vec<f64>, f64) {
    let film = render(context, scene, &RenderSettings::of(scene));
    let pixels: Vec<f64> = film.sums().iter().zip(film.counts()).map(|(sum, &n)| sum[1] / f64::from(n)).collect();
    let mean = pixels.iter().sum::<f64>() / pixels.len() as f64;
    (pixels, mean)
}

#[test]
fn an_emitter_in_a_ceiling_loses_nothing() {
    let context = context();
    for (of_ceiling, of_emitter) in [(1, 1), (6, 8)] {
        let room = |position: DVec3, target: DVec3, fov: f64, side: u32, samples: u32| {
            let mut scene = empty(position, target, fov, side, samples);
            square(&mut scene, 0.0, 3.0, 1, Surface::diffuse([0.5; 3]));
            square(&mut scene, 2.0, 3.0, of_ceiling, Surface::diffuse([0.5; 3]));
            square(&mut scene, 2.0, 2.0, of_emitter, Surface::emitter([1.0; 3]));
            scene
        };
        // Lambert: of a square as seen from below its middle, F = 4/π·(a/√(1+a²))·atan(a/√(1+a²)), a = 1.
        let exact = 0.5 * 4.0 / std::f64::consts::PI * 0.5f64.sqrt() * 0.5f64.sqrt().atan();
        let (_, mean) = pixels(&context, &room(v(0.0, 0.3, 0.05), DVec3::ZERO, 0.2, 16, 256));
        assert!((mean / exact - 1.0).abs() < 1e-3, "{of_ceiling}, {of_emitter}: {mean}, expected {exact}");
    }
}

/// A tetrahedron around the origin, with normals as if it were a sphere.
fn tetrahedron(surface: Surface) -> Scene {
    let mut scene = empty(v(0.5, 0.25, 4.0), DVec3::ZERO, 40.0, 16, 1);
    scene.background = [1.0; 3];
    scene.integrator.max_depth = 256;
    let material = material(&mut scene, surface);
    let positions = vec![v(1.0, 1.0, 1.0), v(1.0, -1.0, -1.0), v(-1.0, 1.0, -1.0), v(-1.0, -1.0, 1.0)];
    scene.meshes.push(Mesh {
        name: "tetrahedron".into(),
        vertex_normals: positions.iter().map(|p| p.normalize()).collect(),
        positions,
        triangles: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
        triangle_materials: vec![material; 4],
        normals: Normals::Smooth,
        ..Mesh::default()
    });
    scene
}

/// (By the renderer: `energy/low-poly` of `check`.)
#[test]
fn smooth_normals_take_nothing_from_a_mirror_or_glass_in_the_oracle() {
    for surface in [Surface::mirror([1.0; 3]), Surface::dielectric(1.5)] {
        let scene = tetrahedron(surface);
        // Some light stays within glass for longer than paths do.
        let allowed = if surface == Surface::mirror([1.0; 3]) { 1e-6 } else { 1e-3 };
        let (of_oracle, _) = oracle::render(&scene, &OracleSettings { samples: 8, seed: 1 }).global_mean();
        assert!((of_oracle[1] - 1.0).abs() < allowed, "{surface:?}: {of_oracle:?} by the oracle");
    }
}

/// A plate that shines, between a floor and a ceiling that the camera sees both.
#[test]
fn what_shines_on_both_sides_does_so_in_the_oracle() {
    let context = context();
    let mut scene = empty(v(0.0, 1.0, 6.0), v(0.0, 1.0, 0.0), 50.0, 16, 1024);
    square(&mut scene, 0.0, 3.0, 1, Surface::diffuse([0.5; 3]));
    square(&mut scene, 2.0, 3.0, 1, Surface::diffuse([0.75; 3]));
    square(&mut scene, 1.25, 1.0, 1, Surface { two_sided: true, ..Surface::emitter([1.0; 3]) });
    scene.integrator.max_depth = 3;
    let (_, mean) = pixels(&context, &scene);
    let oracle = oracle::render(&scene, &OracleSettings { samples: 1024, seed: 2 });
    let (expected, error) = oracle.global_mean();
    assert!((mean - expected[1]).abs() < 5.0 * error[1], "{mean}, expected {} ± {}", expected[1], error[1]);
    let one_sided = {
        scene.materials[2].surface.two_sided = false;
        pixels(&context, &scene).1
    };
    assert!(one_sided < 0.8 * mean, "one side alone gives {one_sided} of {mean}");
}
