//! The cameras of the scene's nodes.

use glam::DVec3;

use crate::scene::description::Camera;
use crate::scene::error::SceneError;
use crate::scene::gltf::document::{Document, number};
use crate::scene::gltf::nodes::Placed;
use crate::scene::named_camera::{NamedCamera, Vertical};

impl Document<'_> {
    /// Cameras in the order of the nodes. They look along −z of their node.
    pub fn cameras(&self, placed: &[Placed]) -> Result<Vec<NamedCamera>, SceneError> {
        let mut cameras = Vec::new();
        for place in placed {
            let node = &self.root.nodes[place.node];
            let Some(index) = node.camera.map(number) else { continue };
            let camera = self.get(&self.root.cameras, index, "camera", format!("node {}", place.node))?;
            let at = format!("camera {index}");
            let positive = |what: &str, value: f32| match value > 0.0 && value.is_finite() {
                true => Ok(f64::from(value)),
                false => Err(self.error(&at, format!("{what} {value}"), "a number > 0")),
            };
            let position = place.to_world.transform_point3(DVec3::ZERO);
            let forward = place.to_world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
            let up = place.to_world.transform_vector3(DVec3::Y).normalize_or(DVec3::Y);
            let mut placed = Camera { position, target: position + forward, up, ..Camera::default() };
            let vertical = if let Some(orthographic) = &camera.orthographic {
                let (width, height) = (positive("xmag", orthographic.xmag)?, positive("ymag", orthographic.ymag)?);
                placed.orthographic_width = Some(2.0 * width);
                Vertical { extent: 2.0 * height, aspect: Some(width / height) }
            } else if let Some(perspective) = &camera.perspective {
                let extent = positive("yfov", perspective.yfov)?.to_degrees();
                if extent >= 180.0 {
                    return Err(self.error(at, format!("yfov {}", perspective.yfov), "an angle below π"));
                }
                let aspect = perspective.aspect_ratio.map(|ratio| positive("aspectRatio", ratio)).transpose()?;
                Vertical { extent, aspect }
            } else {
                return Err(self.error(at, "neither perspective nor orthographic", "one of them"));
            };
            let name = [&camera.name, &node.name].into_iter().flatten().next().cloned().unwrap_or_default();
            cameras.push(NamedCamera { name, camera: placed, vertical: Some(vertical) });
        }
        Ok(cameras)
    }
}
