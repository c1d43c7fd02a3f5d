//! What a file of a model has: surfaces, light and cameras, but no scene around them.

use crate::scene::description::{Exposure, Film, Integrator, Light, Material, Mesh, Scene, Tone, Transfer};
use crate::scene::environment::Environment;
use crate::scene::limits::MAX_IMAGE_SIDE;
use crate::scene::named_camera::NamedCamera;
use crate::scene::texture::{TextureImage, TextureSlot};

/// Longest chain of surface hits of the paths of a model alone: light passes several layers of glass.
const MAX_DEPTH: u32 = 16;

/// Stops by which the 8-bit picture of a model in the studio is brightened: white that faces the lamp is just not cut off.
const STUDIO_EXPOSURE: f64 = -2.0 / 3.0;

/// Rows of the image of a model alone.
const ROWS: u32 = 512;

/// A model as its file has it.
#[derive(Debug, Default)]
pub(super) struct Model {
    pub materials: Vec<Material>,
    /// That textures of the materials refer to.
    pub images: Vec<TextureImage>,
    pub meshes: Vec<Mesh>,
    pub lights: Vec<Light>,
    pub cameras: Vec<NamedCamera>,
}

impl Model {
    /// Whether light comes from it. Textures of emission are decoration more often than sources of light.
    fn shines(&self) -> bool {
        let is_lamp = |&material: &u32| {
            let material = &self.materials[material as usize];
            material.surface.emits() && !material.unlit && !material.textures.contains_key(&TextureSlot::Emission)
        };
        !self.lights.is_empty() || self.meshes.iter().any(|mesh| mesh.triangle_materials.iter().any(is_lamp))
    }

    /// A scene of the model alone: its first camera, or a view of all of it; its light, or a studio. Its own light may be of any strength,
    /// and 8-bit pictures of it are exposed by what they show.
    pub fn into_scene(self, name: &str) -> (Scene, Vec<NamedCamera>) {
        let is_lit = self.shines();
        let aspect = self.cameras.first().and_then(|camera| camera.vertical?.aspect).unwrap_or(1.0);
        let width = (f64::from(ROWS) * aspect).round().clamp(1.0, f64::from(MAX_IMAGE_SIDE)) as u32;
        let mut scene = Scene {
            source: name.to_owned(),
            film: Film {
                width,
                height: ROWS,
                exposure: if is_lit { Exposure::Auto } else { Exposure::Stops(STUDIO_EXPOSURE) },
                tone: Tone::Neutral,
                transfer: Transfer::Srgb,
                ..Film::default()
            },
            integrator: Integrator { max_depth: MAX_DEPTH, ..Integrator::default() },
            materials: self.materials,
            images: self.images,
            environment: (!is_lit).then(Environment::studio),
            meshes: self.meshes,
            lights: self.lights,
            ..Scene::default()
        };
        scene.camera = match self.cameras.first() {
            Some(camera) => camera.for_image(width, ROWS).0,
            None => scene.fitting_camera(),
        };
        (scene, self.cameras)
    }
}
