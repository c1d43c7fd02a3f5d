//! Scenes of any size, made here, to measure growth with.

use std::f64::consts::PI;

use glam::DVec3;

use crate::oracle::Pcg64;
use crate::scene::{
    Camera, Film, Integrator, Light, Material, Mesh, Normals, PixelFilter, Scene, Sphere, Surface, Transfer,
};

/// Sides of the square that scenes stand on, scene units.
const SIDE: f64 = 10.0;

/// A landscape of at least `triangles` triangles that fills the view, under one point light.
pub fn terrain(triangles: u64) -> Scene {
    let cells = ((triangles as f64 / 2.0).sqrt().ceil() as u32).max(1);
    let mut scene = empty("terrain", 3);
    scene.materials.push(diffuse("ground", [0.6, 0.55, 0.45]));
    scene.meshes.push(height_field(cells, height, 0));
    scene.lights.push(point(DVec3::new(3.0, 9.0, 4.0), 4000.0));
    scene
}

/// `count` diffuse and mirror spheres, jittered on a grid in a cube that fills the view.
pub fn spheres(count: u64) -> Scene {
    let mut scene = empty("spheres", 4);
    scene.materials.push(diffuse("white", [0.75, 0.75, 0.75]));
    let reflectance = [0.9, 0.9, 0.9];
    scene.materials.push(Material::new("mirror", Surface::mirror(reflectance)));
    let per_side = (count as f64).cbrt().ceil() as u64;
    let cell = SIDE / per_side as f64;
    let mut random = Pcg64::for_pixel(1, 0);
    for i in 0..count {
        let corner = [i % per_side, i / per_side % per_side, i / per_side / per_side];
        let jitter = DVec3::new(random.uniform(), random.uniform(), random.uniform()) * 0.3;
        let place = DVec3::from(corner.map(|c| c as f64)) + 0.35 + jitter;
        scene.spheres.push(Sphere {
            center: place * cell - SIDE / 2.0,
            radius: 0.3 * cell,
            material: u32::from(i % 4 == 3),
            inward: false,
        });
    }
    scene.camera.position = DVec3::new(0.0, 6.0, 13.0);
    scene.background = [0.4, 0.5, 0.6];
    scene.lights.push(point(DVec3::new(8.0, 12.0, 9.0), 6000.0));
    scene
}

/// A landscape of 2048 triangles under `count` point lights that shine with the same power in all.
pub fn lights(count: u64) -> Scene {
    let mut scene = terrain(2048);
    scene.source = "lights".to_owned();
    scene.lights.clear();
    let mut random = Pcg64::for_pixel(2, 0);
    for _ in 0..count {
        let (x, y, z) = (random.uniform(), random.uniform(), random.uniform());
        let place = DVec3::new(SIDE * (x - 0.5), 1.5 + 2.0 * y, SIDE * (z - 0.5));
        scene.lights.push(point(place, 4000.0 / count as f64));
    }
    scene
}

/// A landscape of 20,000 triangles as a square image of at least `count` pixels.
pub fn pixels(count: u64) -> Scene {
    let mut scene = terrain(20_000);
    let side = (count as f64).sqrt().ceil() as u32;
    scene.film.width = side;
    scene.film.height = side;
    scene
}

/// A closed room with a sphere in it, bright enough that paths of `hits` surface hits carry light.
pub fn depth(hits: u64) -> Scene {
    let mut scene = empty("depth", hits as u32);
    scene.materials.push(diffuse("wall", [0.9, 0.9, 0.9]));
    // A cube from two triangles a side; diffuse surfaces reflect on both.
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 8.0 - 4.0;
    let sides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangles: Vec<_> = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    scene.meshes.push(mesh("room", (0..8).map(corner).collect(), triangles, 0));
    scene.spheres.push(Sphere { center: DVec3::new(0.0, -2.5, 0.0), radius: 1.5, material: 0, inward: false });
    scene.camera.position = DVec3::new(0.0, 0.0, 3.8);
    scene.camera.target = DVec3::new(0.0, -0.5, 0.0);
    scene.camera.horizontal_fov = 80.0;
    scene.lights.push(point(DVec3::new(0.0, 3.0, 0.0), 300.0));
    scene
}

fn empty(source: &str, max_depth: u32) -> Scene {
    Scene {
        source: source.to_owned(),
        camera: Camera {
            position: DVec3::new(0.0, 5.0, 4.8),
            target: DVec3::new(0.0, 0.0, 0.0),
            up: DVec3::Y,
            horizontal_fov: 50.0,
            ..Camera::default()
        },
        film: Film { width: 256, height: 256, filter: PixelFilter::Box, transfer: Transfer::Srgb, ..Film::default() },
        integrator: Integrator { max_depth, samples: 16, russian_roulette: None, indirect: true },
        ..Scene::default()
    }
}

fn diffuse(name: &str, reflectance: [f64; 3]) -> Material {
    Material::new(name.to_owned(), Surface::diffuse(reflectance))
}

fn point(position: DVec3, power: f64) -> Light {
    Light::Point { position, power: [power; 3] }
}

fn mesh(name: &str, positions: Vec<DVec3>, triangles: Vec<[u32; 3]>, material: u32) -> Mesh {
    Mesh {
        name: name.to_owned(),
        positions,
        vertex_normals: Vec::new(),
        triangle_materials: vec![material; triangles.len()],
        triangles,
        normals: Normals::Flat,
        ..Mesh::default()
    }
}

/// cells² squares of two triangles each over the square around the origin.
fn height_field(cells: u32, height: fn(f64, f64) -> f64, material: u32) -> Mesh {
    let row = cells + 1;
    let at = |i: u32| SIDE * (f64::from(i) / f64::from(cells) - 0.5);
    let positions = (0..row * row)
        .map(|i| {
            let (x, z) = (at(i % row), at(i / row));
            DVec3::new(x, height(x, z), z)
        })
        .collect();
    let triangles = (0..cells * cells)
        .flat_map(|i| {
            let a = i / cells * row + i % cells;
            let (b, c, d) = (a + 1, a + row, a + row + 1);
            [[a, c, b], [b, c, d]]
        })
        .collect();
    mesh("height field", positions, triangles, material)
}

/// Hills on hills: eight octaves of sines in turned directions.
fn height(x: f64, z: f64) -> f64 {
    (0..8)
        .map(|octave| {
            let (sin, cos) = (1.9 * f64::from(octave)).sin_cos();
            let scale = f64::powi(1.9, octave) * 2.0 * PI / SIDE;
            let (u, v) = (cos * x - sin * z, sin * x + cos * z);
            0.8 / f64::powi(2.1, octave) * (scale * u + 0.7).sin() * (scale * v).cos()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_valid_and_as_large_as_asked() {
        for n in [1, 1000, 5001] {
            let scene = terrain(n);
            scene.validate().unwrap();
            assert!((n as usize..=n as usize + n as usize / 8 + 8).contains(&scene.triangle_count()));
        }
        assert_eq!(spheres(100).spheres.len(), 100);
        assert_eq!(lights(17).lights.len(), 17);
        assert_eq!(pixels(4096).film.width, 64);
        assert_eq!(depth(5).integrator.max_depth, 5);
        for scene in [spheres(100), lights(17), pixels(4096), depth(5)] {
            scene.validate().unwrap();
        }
    }
}
