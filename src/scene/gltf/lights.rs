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
    range: Option<f64>,
    spot: Option<Cone>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Cone {
    inner_cone_angle: f64,
    outer_cone_angle: f64,
}

impl Default for Cone {
    fn default() -> Self {
        Self { inner_cone_angle: 0.0, outer_cone_angle: std::f64::consts::FRAC_PI_4 }
    }
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
            let intensity = light.color.map(|x| x.max(0.0) * light.intensity.max(0.0));
            let position = place.to_world.transform_point3(DVec3::ZERO);
            let direction = place.to_world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
            let range = light.range.filter(|&range| range > 0.0).unwrap_or(f64::INFINITY);
            let spot = |inner: f64, outer: f64| Light::Spot { position, direction, intensity, inner, outer, range };
            lights.push(match light.kind.as_str() {
                "point" if range.is_infinite() => Light::Point { position, power: intensity.map(|x| 4.0 * PI * x) },
                "point" => spot(180.0, 180.0),
                "spot" => {
                    let cone = light.spot.unwrap_or_default();
                    let outer = cone.outer_cone_angle.to_degrees().clamp(0.0, 90.0);
                    spot(cone.inner_cone_angle.to_degrees().clamp(0.0, outer), outer)
                }
                "directional" => Light::Directional { direction, irradiance: intensity },
                kind => {
                    let found = format!("type {kind:?}");
                    return Err(self.error(format!("light {}", reference.light), found, "point, spot or directional"));
                }
            });
        }
        Ok(lights)
    }
}
