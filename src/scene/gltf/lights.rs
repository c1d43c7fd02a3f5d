//! KHR_lights_punctual. Intensities are taken as they are: a candela is a unit of radiant intensity.

use std::f64::consts::PI;

use glam::DVec3;
use serde::Deserialize;

use crate::scene::description::{Light, Rgb};
use crate::scene::error::SceneError;
use crate::scene::gltf::document::Document;
use crate::scene::gltf::nodes::Placed;

#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Punctual {
    #[serde(rename = "type")]
    kind: String,
    #[serde(default = "white")]
    color: Rgb,
    #[serde(default = "one")]
    intensity: f64,
}

fn white() -> Rgb {
    [1.0; 3]
}

fn one() -> f64 {
    1.0
}

#[derive(Deserialize)]
struct Lights {
    lights: Vec<Punctual>,
}

#[derive(Deserialize)]
struct Reference {
    light: usize,
}

const NAME: &str = "KHR_lights_punctual";

impl Document<'_> {
    /// The lights of the scene's nodes, in world space.
    pub fn lights(&self, placed: &[Placed]) -> Result<Vec<Light>, SceneError> {
        let extensions = self.root.extensions.as_ref().map(|extensions| &extensions.others);
        let all = self.extension::<Lights>(extensions, NAME, "file")?.map_or(Vec::new(), |all| all.lights);
        let mut lights = Vec::new();
        for place in placed {
            let at = format!("node {}", place.node);
            let extensions = self.root.nodes[place.node].extensions.as_ref().map(|extensions| &extensions.others);
            let Some(reference) = self.extension::<Reference>(extensions, NAME, &at)? else { continue };
            let light = self.get(&all, reference.light, "light", &at)?;
            let power = light.color.map(|x| 4.0 * PI * x.max(0.0) * light.intensity.max(0.0));
            let position = place.to_world.transform_point3(DVec3::ZERO);
            match light.kind.as_str() {
                "point" => lights.push(Light::Point { position, power }),
                kind => {
                    return Err(self.error(format!("light {}", reference.light), format!("type {kind:?}"), "point"));
                }
            }
        }
        Ok(lights)
    }
}
