//! Materials of glTF, with those of its extensions that say how surfaces look.

use std::collections::BTreeMap;

use gltf::json::material::AlphaMode;
use gltf::json::texture::{MagFilter, WrappingMode};
use gltf::json::validation::Checked;
use serde::Deserialize;
use serde_json::{Map, Value};

use crate::scene::description::*;
use crate::scene::error::SceneError;
use crate::scene::gltf::document::{Document, number};
use crate::scene::texture::{Texture, TextureSlot, Wrap};

/// A texture as extensions name it.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Use {
    index: usize,
    #[serde(default)]
    tex_coord: u32,
    #[serde(default)]
    extensions: Map<String, Value>,
    /// Of a normal texture.
    #[serde(default = "one")]
    scale: f64,
}

fn one() -> f64 {
    1.0
}

fn white() -> Rgb {
    [1.0; 3]
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct TextureTransform {
    offset: [f64; 2],
    rotation: f64,
    scale: [f64; 2],
    tex_coord: Option<u32>,
}

impl Default for TextureTransform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Transmission {
    transmission_factor: f64,
    transmission_texture: Option<Use>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Volume {
    #[serde(default)]
    thickness_factor: f64,
    attenuation_distance: Option<f64>,
    #[serde(default = "white")]
    attenuation_color: Rgb,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Specular {
    #[serde(default = "one")]
    specular_factor: f64,
    specular_texture: Option<Use>,
    #[serde(default = "white")]
    specular_color_factor: Rgb,
    specular_color_texture: Option<Use>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Clearcoat {
    clearcoat_factor: f64,
    clearcoat_texture: Option<Use>,
    clearcoat_roughness_factor: f64,
    clearcoat_roughness_texture: Option<Use>,
    clearcoat_normal_texture: Option<Use>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Sheen {
    sheen_color_factor: Rgb,
    sheen_color_texture: Option<Use>,
    sheen_roughness_factor: f64,
    sheen_roughness_texture: Option<Use>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Anisotropy {
    anisotropy_strength: f64,
    anisotropy_rotation: f64,
    anisotropy_texture: Option<Use>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct SpecularGlossiness {
    #[serde(default = "opaque_white")]
    diffuse_factor: [f64; 4],
    diffuse_texture: Option<Use>,
    #[serde(default = "white")]
    specular_factor: Rgb,
    #[serde(default = "one")]
    glossiness_factor: f64,
    specular_glossiness_texture: Option<Use>,
}

fn opaque_white() -> [f64; 4] {
    [1.0; 4]
}

/// An image of roughness that is made of the glossiness in another one's alpha: 1 − factor · alpha.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Glossiness {
    /// Number in the file.
    pub image: usize,
    pub factor: f64,
}

#[derive(Deserialize)]
struct Ior {
    #[serde(default = "ior_of_glass")]
    ior: f64,
}

fn ior_of_glass() -> f64 {
    1.5
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct EmissiveStrength {
    #[serde(default = "one")]
    emissive_strength: f64,
}

impl Document<'_> {
    /// The material of that number, and the images that it uses by their numbers in the file; after these come those that are made of
    /// `glossiness`.
    pub fn material(&self, index: usize, glossiness: &mut Vec<Glossiness>) -> Result<Material, SceneError> {
        let material = self.get(&self.root.materials, index, "material", "mesh")?;
        let at = match &material.name {
            Some(name) => format!("material {index} ({name:?})"),
            None => format!("material {index}"),
        };
        let extensions = material.extensions.as_ref().map(|extensions| &extensions.others);
        let pbr = &material.pbr_metallic_roughness;
        let share = |x: f64| x.clamp(0.0, 1.0);
        let shares = |color: Rgb| color.map(share);
        let positive = |color: Rgb| color.map(|x| x.max(0.0));
        let [r, g, b, mut alpha] = pbr.base_color_factor.0.map(f64::from);
        let mut model = MetallicRoughness {
            base_color: shares([r, g, b]),
            metallic: share(f64::from(pbr.metallic_factor.0)),
            roughness: share(f64::from(pbr.roughness_factor.0)),
            ..MetallicRoughness::default()
        };
        let mut textures = Textures { document: self, at: &at, uses: BTreeMap::new() };
        textures.add(TextureSlot::BaseColor, pbr.base_color_texture.as_ref().map(info), true)?;
        textures.add(TextureSlot::MetallicRoughness, pbr.metallic_roughness_texture.as_ref().map(info), false)?;
        textures.add(TextureSlot::Emission, material.emissive_texture.as_ref().map(info), true)?;
        let normal = material.normal_texture.as_ref().map(|normal| Use {
            index: number(normal.index),
            tex_coord: normal.tex_coord,
            extensions: normal.extensions.as_ref().map(|e| e.others.clone()).unwrap_or_default(),
            scale: f64::from(normal.scale),
        });
        let normal_scale = normal.as_ref().map_or(1.0, |normal| normal.scale);
        textures.add(TextureSlot::Normal, normal, false)?;

        const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";
        let has_fallback = pbr.base_color_texture.is_some()
            || pbr.metallic_roughness_texture.is_some()
            || [r, g, b, alpha, model.metallic, model.roughness] != [1.0; 6];
        if let Some(given) =
            self.extension::<SpecularGlossiness>(extensions, SPECULAR_GLOSSINESS, &at)?.filter(|_| !has_fallback)
        {
            let [r, g, b, a] = given.diffuse_factor;
            alpha = a;
            // Any reflectance at normal incidence, in terms of that of the index.
            let of_index = ((model.ior - 1.0) / (model.ior + 1.0)).powi(2);
            model.base_color = shares([r, g, b]);
            model.metallic = 0.0;
            model.roughness = 1.0 - share(given.glossiness_factor);
            model.specular_color = shares(given.specular_factor).map(|specular| specular / of_index);
            textures.add(TextureSlot::BaseColor, given.diffuse_texture, true)?;
            textures.add(TextureSlot::SpecularColor, given.specular_glossiness_texture, true)?;
            if let Some(&specular) = textures.uses.get(&TextureSlot::SpecularColor) {
                let wanted = Glossiness { image: specular.image as usize, factor: share(given.glossiness_factor) };
                let number = glossiness.iter().position(|known| *known == wanted).unwrap_or_else(|| {
                    glossiness.push(wanted);
                    glossiness.len() - 1
                });
                let image = (self.root.images.len() + number) as u32;
                textures.uses.insert(TextureSlot::MetallicRoughness, Texture { image, srgb: false, ..specular });
                model.roughness = 1.0;
            }
        }
        let mut emission = material.emissive_factor.0.map(f64::from);
        if let Some(strength) =
            self.extension::<EmissiveStrength>(extensions, "KHR_materials_emissive_strength", &at)?
        {
            emission = emission.map(|x| x * strength.emissive_strength);
        }
        if let Some(ior) = self.extension::<Ior>(extensions, "KHR_materials_ior", &at)? {
            // 0 stands for a dielectric that reflects all.
            model.ior = if ior.ior == 0.0 { 1000.0 } else { ior.ior.clamp(1.0, 1000.0) };
        }
        if let Some(specular) = self.extension::<Specular>(extensions, "KHR_materials_specular", &at)? {
            model.specular = share(specular.specular_factor);
            model.specular_color = positive(specular.specular_color_factor);
            textures.add(TextureSlot::Specular, specular.specular_texture, false)?;
            textures.add(TextureSlot::SpecularColor, specular.specular_color_texture, true)?;
        }
        if let Some(transmission) = self.extension::<Transmission>(extensions, "KHR_materials_transmission", &at)? {
            model.transmission = share(transmission.transmission_factor);
            textures.add(TextureSlot::Transmission, transmission.transmission_texture, false)?;
        }
        if let Some(volume) = self.extension::<Volume>(extensions, "KHR_materials_volume", &at)? {
            model.has_volume = volume.thickness_factor > 0.0;
            model.attenuation_color = shares(volume.attenuation_color);
            model.attenuation_distance = volume.attenuation_distance.filter(|&d| d > 0.0).unwrap_or(f64::INFINITY);
        }
        let mut coat_normal_scale = 1.0;
        if let Some(coat) = self.extension::<Clearcoat>(extensions, "KHR_materials_clearcoat", &at)? {
            model.coat = share(coat.clearcoat_factor);
            model.coat_roughness = share(coat.clearcoat_roughness_factor);
            coat_normal_scale = coat.clearcoat_normal_texture.as_ref().map_or(1.0, |normal| normal.scale);
            textures.add(TextureSlot::Coat, coat.clearcoat_texture, false)?;
            textures.add(TextureSlot::CoatRoughness, coat.clearcoat_roughness_texture, false)?;
            textures.add(TextureSlot::CoatNormal, coat.clearcoat_normal_texture, false)?;
        }
        if let Some(sheen) = self.extension::<Sheen>(extensions, "KHR_materials_sheen", &at)? {
            model.sheen_color = shares(sheen.sheen_color_factor);
            model.sheen_roughness = share(sheen.sheen_roughness_factor);
            textures.add(TextureSlot::SheenColor, sheen.sheen_color_texture, true)?;
            textures.add(TextureSlot::SheenRoughness, sheen.sheen_roughness_texture, false)?;
        }
        if let Some(anisotropy) = self.extension::<Anisotropy>(extensions, "KHR_materials_anisotropy", &at)? {
            model.anisotropy = share(anisotropy.anisotropy_strength);
            model.anisotropy_rotation = anisotropy.anisotropy_rotation;
            textures.add(TextureSlot::Anisotropy, anisotropy.anisotropy_texture, false)?;
        }
        let mut uses = textures.uses;
        let unlit = extensions.is_some_and(|all| all.contains_key("KHR_materials_unlit"));
        let surface = if unlit {
            uses.retain(|slot, _| *slot == TextureSlot::BaseColor);
            if let Some(&base) = uses.get(&TextureSlot::BaseColor) {
                uses.insert(TextureSlot::Emission, base);
            }
            Surface { bsdf: Bsdf::Black, emission: model.base_color, two_sided: material.double_sided }
        } else {
            let emission = positive(emission);
            Surface { bsdf: Bsdf::MetallicRoughness(model), emission, two_sided: material.double_sided }
        };
        let name = material.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("material {index}"));
        Ok(Material {
            textures: uses,
            normal_scale,
            coat_normal_scale,
            alpha: share(alpha),
            coverage: match material.alpha_mode {
                Checked::Valid(AlphaMode::Mask) => {
                    Coverage::Mask(material.alpha_cutoff.as_ref().map_or(0.5, |cutoff| f64::from(cutoff.0)))
                }
                Checked::Valid(AlphaMode::Blend) => Coverage::Blend,
                _ => Coverage::Opaque,
            },
            // Light that has entered a body leaves it by its back.
            culls_back: !material.double_sided && model.transmission == 0.0,
            unlit,
            ..Material::new(name, surface)
        })
    }
}

fn info(info: &gltf::json::texture::Info) -> Use {
    Use {
        index: number(info.index),
        tex_coord: info.tex_coord,
        extensions: info.extensions.as_ref().map(|extensions| extensions.others.clone()).unwrap_or_default(),
        scale: 1.0,
    }
}

/// The textures of a material.
struct Textures<'a> {
    document: &'a Document<'a>,
    at: &'a str,
    uses: BTreeMap<TextureSlot, Texture>,
}

impl Textures<'_> {
    fn add(&mut self, slot: TextureSlot, given: Option<Use>, srgb: bool) -> Result<(), SceneError> {
        let Some(given) = given else { return Ok(()) };
        let document = self.document;
        let at = format!("{}, texture {}", self.at, given.index);
        let texture = document.get(&document.root.textures, given.index, "texture", self.at)?;
        let extensions = texture.extensions.as_ref().map(|extensions| &extensions.others);
        #[derive(Deserialize)]
        struct Source {
            source: usize,
        }
        let webp = document.extension::<Source>(extensions, "EXT_texture_webp", &at)?;
        let plain = Some(number(texture.source)).filter(|&source| source < document.root.images.len());
        let Some(image) = webp.map(|webp| webp.source).or(plain) else {
            return Err(document.error(at, "no image that can be read", "a source of type PNG, JPEG or WebP"));
        };
        let sampler = match texture.sampler {
            Some(index) => Some(document.get(&document.root.samplers, number(index), "sampler", &at)?),
            None => None,
        };
        let wrap = |mode: Checked<WrappingMode>| match mode {
            Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
            Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        let transform =
            document.extension::<TextureTransform>(Some(&given.extensions), "KHR_texture_transform", &at)?;
        let transform = transform.unwrap_or_default();
        let ([ox, oy], [sx, sy], (sin, cos)) = (transform.offset, transform.scale, transform.rotation.sin_cos());
        let uv_set = transform.tex_coord.unwrap_or(given.tex_coord);
        if uv_set > 1 {
            return Err(document.error(at, format!("texCoord {uv_set}"), "0 or 1"));
        }
        let texture = Texture {
            image: image as u32,
            srgb,
            wrap: sampler.map_or([Wrap::Repeat; 2], |s| [wrap(s.wrap_s), wrap(s.wrap_t)]),
            nearest: sampler.is_some_and(|s| matches!(s.mag_filter, Some(Checked::Valid(MagFilter::Nearest)))),
            uv_set,
            transform: [[sx * cos, sy * sin, ox], [-sx * sin, sy * cos, oy]],
        };
        self.uses.insert(slot, texture);
        Ok(())
    }
}
