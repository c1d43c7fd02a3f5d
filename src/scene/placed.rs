//! Meshes, lights and cameras in another place.

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

use crate::scene::description::{Camera, Light, Mesh};
use crate::scene::transform::cofactors;
use crate::scene::triangle::has_area;
use crate::scene::unit::unit;

/// A copy of a mesh. Triangles that have no area there are dropped. A map that mirrors exchanges front and back of none.
pub(super) fn placed_mesh(mesh: &Mesh, to_scene: &DAffine3) -> Mesh {
    let positions: Vec<DVec3> = mesh.positions.par_iter().map(|&p| to_scene.transform_point3(p)).collect();
    let is_mirrored = to_scene.matrix3.determinant() < 0.0;
    let of_normals: DMat3 = cofactors(to_scene.matrix3) * if is_mirrored { -1.0 } else { 1.0 };
    let normal = |&normal: &DVec3| unit(of_normals * normal).unwrap_or(normal);
    let direction = |v: [f32; 3]| {
        let v = to_scene.transform_vector3(DVec3::from(v.map(f64::from)));
        unit(v).unwrap_or(DVec3::ZERO).as_vec3().to_array()
    };
    let keeps: Vec<bool> = mesh
        .triangles
        .par_iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
            // What is not finite is told of later.
            !(a.is_finite() && b.is_finite() && c.is_finite()) || has_area(a, b, c)
        })
        .collect();
    let ordered = |&[a, b, c]: &[u32; 3]| if is_mirrored { [a, c, b] } else { [a, b, c] };
    let kept = || keeps.iter().enumerate().filter(|(_, keeps)| **keeps).map(|(triangle, _)| triangle);
    Mesh {
        name: mesh.name.clone(),
        vertex_normals: mesh.vertex_normals.par_iter().map(normal).collect(),
        uvs: mesh.uvs.clone(),
        tangents: mesh.tangents.par_iter().map(|frame| frame.map(direction)).collect(),
        colors: mesh.colors.clone(),
        triangles: kept().map(|triangle| ordered(&mesh.triangles[triangle])).collect(),
        triangle_materials: kept().map(|triangle| mesh.triangle_materials[triangle]).collect(),
        normals: mesh.normals,
        degenerate_dropped: mesh.degenerate_dropped + keeps.iter().filter(|keeps| !**keeps).count(),
        positions,
    }
}

/// Bytes that a copy takes, about.
pub(super) fn bytes_of_copy(mesh: &Mesh) -> u64 {
    (size_of::<Mesh>() + mesh.positions.len() * 128 + mesh.triangles.len() * 16) as u64
}

/// A light; how bright it is does not depend on scale.
pub(super) fn placed_light(light: &Light, to_scene: &DAffine3) -> Light {
    let mut light = light.clone();
    match &mut light {
        Light::Point { position, .. } => *position = to_scene.transform_point3(*position),
        Light::Spot { position, direction, .. } => {
            (*position, *direction) = (to_scene.transform_point3(*position), to_scene.transform_vector3(*direction));
        }
        Light::Directional { direction, .. } => *direction = to_scene.transform_vector3(*direction),
    }
    light
}

/// A camera; what it shows from side to side of parallel rays, and its lens, keep their size.
pub(super) fn placed_camera(camera: &Camera, to_scene: &DAffine3) -> Camera {
    Camera {
        position: to_scene.transform_point3(camera.position),
        target: to_scene.transform_point3(camera.target),
        up: to_scene.transform_vector3(camera.up),
        ..camera.clone()
    }
}
