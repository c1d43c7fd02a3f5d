//! A scene around a mesh that comes without one: a camera that sees all of it, and light.

use std::f64::consts::PI;
use std::path::Path;

use glam::DVec3;

use crate::scene::description::*;
use crate::scene::error::SceneError;
use crate::scene::materials::MaterialList;
use crate::scene::obj::mesh::{MaterialSource, MeshRequest, NormalsChoice};
use crate::scene::transform::Placement;

/// Full angle of view of the camera, degrees; the image is square.
const FOV: f64 = 40.0;

/// From the mesh to the camera: in front (+z), a little above and to the side. Any length.
const TO_CAMERA: DVec3 = DVec3::new(0.3, 0.25, 1.0);

/// From the mesh to the light: left, above, in front. Any length.
const TO_LIGHT: DVec3 = DVec3::new(-1.0, 1.5, 1.5);

/// Distance of the light from the middle of the mesh, in radii of the mesh.
const LIGHT_DISTANCE: f64 = 3.0;

/// Free space around the mesh, of the image's width.
const MARGIN: f64 = 0.02;

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
    let (center, radius) = bounding_sphere(&mesh.positions);
    let camera_distance = radius * (1.0 + 2.0 * MARGIN) / (FOV / 2.0).to_radians().sin();
    let light_distance = radius * LIGHT_DISTANCE;
    // Radiance 1 of a white diffuse surface is irradiance π = power / (4π d²).
    let light = Light::Point {
        position: center + TO_LIGHT.normalize() * light_distance,
        power: [4.0 * PI * PI * light_distance * light_distance; 3],
    };
    let materials = materials.into_vec();
    let emits = materials.iter().any(|material| material.surface.emits());
    Ok(Scene {
        source: file.to_owned(),
        camera: Camera {
            position: center + TO_CAMERA.normalize() * camera_distance,
            target: center,
            up: DVec3::Y,
            horizontal_fov: FOV,
        },
        film: Film::default(),
        integrator: Integrator::default(),
        background: if emits { [0.0; 3] } else { BACKGROUND },
        materials,
        images: vec![],
        spheres: Vec::new(),
        meshes: vec![mesh],
        lights: if emits { Vec::new() } else { vec![light] },
    })
}

/// Centre of the bounding box, and the largest distance of a vertex from it.
fn bounding_sphere(positions: &[DVec3]) -> (DVec3, f64) {
    let lowest = positions.iter().fold(DVec3::INFINITY, |lowest, &p| lowest.min(p));
    let highest = positions.iter().fold(DVec3::NEG_INFINITY, |highest, &p| highest.max(p));
    let center = lowest.midpoint(highest);
    let radius = positions.iter().fold(0.0, |radius: f64, p| radius.max(p.distance(center)));
    (center, radius)
}
