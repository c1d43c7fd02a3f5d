//! A scene around a mesh that comes without one: a camera that sees all of it, and light.

use std::f64::consts::PI;
use std::path::Path;

use glam::DVec3;

use crate::scene::description::*;
use crate::scene::error::SceneError;
use crate::scene::materials::MaterialList;
use crate::scene::obj::mesh::{MaterialSource, MeshRequest, NormalsChoice};
use crate::scene::transform::Placement;

/// From the mesh to the light: left, above, in front. Any length.
const TO_LIGHT: DVec3 = DVec3::new(-1.0, 1.5, 1.5);

/// Distance of the light from the middle of the mesh, in radii of the mesh.
const LIGHT_DISTANCE: f64 = 3.0;

/// Radiance of the background, unless the mesh itself emits light.
const BACKGROUND: Rgb = [0.3; 3];

/// Makes a scene of an OBJ file alone. `bytes` is the file, `file` its name, `base_dir` where its MTL files are.
///
/// The point light gives a white surface that faces it from the middle of the mesh the radiance 1. Where the mesh has
/// emitters, these are the only light.
pub(in crate::scene) fn preview(
    bytes: &[u8],
    file: &str,
    base_dir: Option<&Path>,
    warnings: &mut Vec<String>,
) -> Result<Scene, SceneError> {
    let mut materials = MaterialList::default();
    let request = MeshRequest {
        placement: Placement::default(),
        normals: NormalsChoice::AsInFile,
        material: MaterialSource::Mtl,
    };
    let mesh = request.build(bytes, file, base_dir, &mut materials, warnings)?;
    let mut scene = Scene { source: file.to_owned(), meshes: vec![mesh], ..Scene::default() };
    let (center, radius) = scene.bounding_sphere();
    scene.camera = scene.fitting_camera();
    let light_distance = radius * LIGHT_DISTANCE;
    // Radiance 1 of a white diffuse surface is irradiance π = power / (4π d²).
    let light = Light::Point {
        position: center + TO_LIGHT.normalize() * light_distance,
        power: [4.0 * PI * PI * light_distance * light_distance; 3],
    };
    scene.materials = materials.into_vec();
    if !scene.materials.iter().any(|material| material.surface.emits()) {
        scene.background = BACKGROUND;
        scene.lights = vec![light];
    }
    Ok(scene)
}
