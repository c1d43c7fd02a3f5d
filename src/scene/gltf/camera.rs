//! The camera: one of the file's, or one that sees all of it.

use glam::DVec3;

use crate::scene::description::{Camera, Film, Mesh};
use crate::scene::error::SceneError;
use crate::scene::gltf::document::{Document, number};
use crate::scene::gltf::nodes::Placed;
use crate::scene::gltf::valid;

/// Rows of the image, unless asked for otherwise.
const ROWS: u32 = 512;

/// Vertical angle of view of a camera that the file has not, degrees.
const FIT_FOV: f64 = 40.0;
/// Where it stands, seen from the middle: turned from +z to +x, and above the horizon; degrees.
const FIT_AZIMUTH: f64 = 25.0;
const FIT_ELEVATION: f64 = 15.0;
/// Free space around the model.
const FIT_MARGIN: f64 = 0.05;

impl Document<'_> {
    /// Camera and film.
    pub fn camera_and_film(
        &self,
        placed: &[Placed],
        meshes: &[Mesh],

        warnings: &mut Vec<String>,
    ) -> Result<(Camera, Film), SceneError> {
        for place in placed {
            let Some(index) = self.root.nodes[place.node].camera.map(number) else { continue };
            let camera = self.get(&self.root.cameras, index, "camera", format!("node {}", place.node))?;
            let Some(perspective) = &camera.perspective else {
                warnings.push(format!("{}: camera {index} is not of perspective and is left out", self.name));
                continue;
            };
            let _ = valid(&camera.type_);
            let yfov = f64::from(perspective.yfov);
            let aspect = perspective.aspect_ratio.map_or(1.0, f64::from);
            if !(yfov > 0.0 && yfov < std::f64::consts::PI && aspect > 0.0 && aspect.is_finite()) {
                return Err(self.error(
                    format!("camera {index}"),
                    format!("yfov {yfov}, aspectRatio {aspect}"),
                    "an angle in (0, π) and a ratio > 0",
                ));
            }
            let position = place.to_world.transform_point3(DVec3::ZERO);
            let forward = place.to_world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
            let up = place.to_world.transform_vector3(DVec3::Y).normalize_or(DVec3::Y);
            let width = (f64::from(ROWS) * aspect).round().clamp(1.0, 8192.0) as u32;
            // The vertical angle is what counts.
            let ratio = f64::from(width) / f64::from(ROWS);
            let horizontal_fov = (2.0 * (ratio * (yfov / 2.0).tan()).atan()).to_degrees();
            let camera = Camera { position, target: position + forward, up, horizontal_fov };
            return Ok((camera, Film { width, height: ROWS, ..Film::default() }));
        }
        warnings.push(format!("{}: no camera: the view is chosen to show all of it", self.name));
        Ok((fit(meshes), Film { width: ROWS, height: ROWS, ..Film::default() }))
    }
}

/// A camera for a square image that sees all of some meshes.
fn fit(meshes: &[Mesh]) -> Camera {
    let points = || {
        let used = |mesh: &'_ Mesh| -> Vec<DVec3> {
            mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize]).collect()
        };
        meshes.iter().flat_map(used)
    };
    let (lo, hi) = points().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let center = if lo.is_finite() && hi.is_finite() { lo.midpoint(hi) } else { DVec3::ZERO };
    let radius = points().map(|p| p.distance(center)).fold(0.0, f64::max).max(1e-9);
    let (azimuth, elevation) = (FIT_AZIMUTH.to_radians(), FIT_ELEVATION.to_radians());
    let direction = DVec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
    let distance = radius * (1.0 + FIT_MARGIN) / (FIT_FOV / 2.0).to_radians().sin();
    Camera { position: center + direction * distance, target: center, up: DVec3::Y, horizontal_fov: FIT_FOV }
}
