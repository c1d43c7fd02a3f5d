//! Emitters that shine to where nothing is.

use std::collections::BTreeSet;

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::description::{Bsdf, Mesh, Scene};
use crate::scene::error::Entity;

/// Pairs of a face and a vertex that are looked at, at most, for an emitter.
const MOST_PAIRS: usize = 1 << 27;

/// How far before a plane something lies at least, of its distance from there: what lies lower hardly gets light.
const BEFORE: f64 = 0.005;

/// The emitters all of whose faces look away from the camera and from all that reflects, each with the name of its material.
pub(super) fn looking_away(scene: &Scene) -> Vec<(Entity, String)> {
    let mut found = Vec::new();
    let emits = |material: u32| scene.surface(material).emits() && !scene.surface(material).two_sided;
    for (index, sphere) in scene.spheres.iter().enumerate().filter(|(_, sphere)| emits(sphere.material)) {
        let is_seen = |point: DVec3, radius: f64| {
            let distance = point.distance(sphere.center);
            if sphere.inward { distance - radius < sphere.radius } else { distance + radius > sphere.radius }
        };
        if !anything(scene, &is_seen) {
            found.push((Entity::Sphere(index), scene.materials[sphere.material as usize].name.clone()));
        }
    }
    for (index, mesh) in scene.meshes.iter().enumerate() {
        let emitters: BTreeSet<u32> = mesh.triangle_materials.iter().copied().filter(|&m| emits(m)).collect();
        let away = emitters.into_iter().filter(|&material| looks_away(scene, mesh, material));
        found.extend(away.map(|material| (Entity::Mesh(index), scene.materials[material as usize].name.clone())));
    }
    found
}

fn looks_away(scene: &Scene, mesh: &Mesh, material: u32) -> bool {
    let of_material = || mesh.triangles.iter().zip(&mesh.triangle_materials).filter(|(_, m)| **m == material);
    let vertices: usize = scene.meshes.iter().map(|mesh| mesh.positions.len()).sum();
    if of_material().count().saturating_mul(vertices) > MOST_PAIRS {
        return false;
    }
    of_material().all(|(triangle, _)| {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let is_before = |point: DVec3, radius: f64| {
            let to = point - a;
            normal.dot(to) + radius > BEFORE * to.length()
        };
        !anything(scene, &is_before)
    })
}

/// Whether the camera or something that reflects is seen: a point, with a radius around it.
fn anything(scene: &Scene, is_seen: &(impl Fn(DVec3, f64) -> bool + Sync)) -> bool {
    let reflects = |material: u32| scene.surface(material).bsdf != Bsdf::Black;
    let of_mesh = |mesh: &Mesh| {
        let triangles = mesh.triangles.par_iter().zip(&mesh.triangle_materials).filter(|(_, m)| reflects(**m));
        triangles.any(|(triangle, _)| triangle.iter().any(|&vertex| is_seen(mesh.positions[vertex as usize], 0.0)))
    };
    is_seen(scene.camera.position, 0.0)
        || scene.spheres.iter().any(|s| reflects(s.material) && is_seen(s.center, s.radius))
        || scene.meshes.iter().any(of_mesh)
}
