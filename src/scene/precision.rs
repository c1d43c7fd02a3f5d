//! What single precision, in which images are rendered, cannot carry.
//!
//! The camera is the origin then, so that places are told the less apart the farther they are from it, and one unit is about the
//! extent of the scene, so that squares of what is much smaller vanish.

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::description::{Mesh, Scene};
use crate::scene::error::Entity;
use crate::scene::problem::number;

/// Half the distance between numbers near 1.
const ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// How much larger than its place's rounding a thing has to be.
const CLEARLY: f64 = 100.0;

/// Of the scene's extent: squares of smaller lengths are no normal numbers any more.
const SMALLEST_PART: f64 = 1e-19;

/// Pairs of a light and a vertex that are looked at, at most.
const MOST_PAIRS: usize = 1 << 23;

/// What an image will not show as it is, each with its entity, and the key that has to do with it.
pub(super) fn lost(scene: &Scene) -> Vec<(Entity, &'static str, String)> {
    let camera = scene.camera.position;
    let mut found = Vec::new();
    let meshes: Vec<Extent> = scene.meshes.par_iter().map(|mesh| Extent::of(mesh, camera)).collect();
    let extent = extent(scene, &meshes);
    for (index, sphere) in scene.spheres.iter().enumerate() {
        let distance = (sphere.center.distance(camera) - sphere.radius).abs();
        let radius = number(sphere.radius);
        // The scene itself is given in double precision.
        let apart = 4.0 * f64::EPSILON * sphere.radius;
        if let Some(problem) = too_small(sphere.radius, distance, extent) {
            found.push((Entity::Sphere(index), "radius", format!("radius is {radius}, {problem}")));
        } else if distance < apart {
            let problem = "where double precision tells places hardly";
            let problem = format!("radius is {radius}, {problem} {} apart: the camera is as if on it", rounded(apart));
            found.push((Entity::Sphere(index), "radius", problem));
        }
    }
    for (index, (mesh, of_mesh)) in scene.meshes.iter().zip(&meshes).enumerate() {
        let entity = Entity::Mesh(index);
        if let Some(problem) = too_small(of_mesh.size, of_mesh.nearest, extent) {
            found.push((entity, "file", format!("it is {} across, {problem}", number(of_mesh.size))));
        } else if of_mesh.without_area > 0 {
            let all = mesh.triangles.len();
            let problem = "have no area in single precision, seen from so far, and are not rendered";
            found.push((entity, "file", format!("{} of {all} triangles {problem}", of_mesh.without_area)));
        }
    }
    let vertices: usize = scene.meshes.iter().map(|mesh| mesh.positions.len()).sum();
    let lights = if scene.lights.len().saturating_mul(vertices) > MOST_PAIRS { &[] } else { scene.lights.as_slice() };
    let positions = lights.iter().enumerate().filter_map(|(index, light)| Some((index, light.position()?)));
    for (index, position) in positions {
        let distance = position.distance(camera);
        let from_surface = distance_to_surfaces(scene, position);
        if from_surface > 0.0
            && let Some(problem) = too_small(from_surface, distance, extent)
        {
            let problem = format!("its distance from the nearest surface is {}, {problem}", number(from_surface));
            found.push((Entity::Light(index), "position", problem));
        }
    }
    found
}

/// Why a length does not count, at a distance from the camera.
fn too_small(length: f64, distance: f64, extent: f64) -> Option<String> {
    if length < SMALLEST_PART * extent {
        let extent = number(extent);
        return Some(format!("too small beside the extent of the scene, {extent}: single precision cannot hold both"));
    }
    let apart = distance * ROUNDING;
    (length < CLEARLY * apart).then(|| {
        let (distance, apart) = (rounded(distance), rounded(2.0 * apart));
        format!("at a distance of {distance} from the camera, where single precision tells places {apart} apart")
    })
}

/// With few digits.
fn rounded(x: f64) -> String {
    format!("{x:.1e}")
}

/// Largest distance from the camera that matters.
fn extent(scene: &Scene, meshes: &[Extent]) -> f64 {
    let camera = scene.camera.position;
    let lights = scene.lights.iter().filter_map(|light| Some(light.position()?.distance(camera)));
    let spheres = scene.spheres.iter().map(|sphere| (sphere.center.distance(camera) - sphere.radius).abs());
    lights.chain(spheres).chain(meshes.iter().map(|mesh| mesh.farthest)).fold(0.0, f64::max)
}

/// Of a mesh, as the camera sees it.
struct Extent {
    size: f64,
    nearest: f64,
    farthest: f64,
    /// Triangles that rounding leaves no area.
    without_area: usize,
}

impl Extent {
    fn of(mesh: &Mesh, camera: DVec3) -> Self {
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut nearest, mut farthest) = (f64::INFINITY, 0.0_f64);
        for &position in &mesh.positions {
            (lo, hi) = (lo.min(position), hi.max(position));
            let distance = position.distance_squared(camera);
            (nearest, farthest) = (nearest.min(distance), farthest.max(distance));
        }
        (nearest, farthest) = (nearest.sqrt(), farthest.sqrt());
        // As render space rounds: a unit that is a power of two changes nothing.
        let scale = 2f64.powi(-(farthest.max(f64::MIN_POSITIVE).log2() as i32));
        let vanishes = |triangle: &&[u32; 3]| {
            let corner = |vertex: u32| ((mesh.positions[vertex as usize] - camera) * scale).as_vec3().as_dvec3();
            let [a, b, c] = triangle.map(corner);
            (b - a).cross(c - a) == DVec3::ZERO
        };
        let without_area = mesh.triangles.par_iter().filter(vanishes).count();
        Self { size: lo.distance(hi), nearest, farthest, without_area }
    }
}

/// From spheres, and from vertices of meshes.
fn distance_to_surfaces(scene: &Scene, point: DVec3) -> f64 {
    let spheres = scene.spheres.iter().map(|sphere| (sphere.center.distance(point) - sphere.radius).abs());
    let nearest =
        |mesh: &Mesh| mesh.positions.par_iter().map(|p| p.distance_squared(point)).reduce(|| f64::INFINITY, f64::min);
    spheres.chain(scene.meshes.iter().map(|mesh| nearest(mesh).sqrt())).fold(f64::INFINITY, f64::min)
}
