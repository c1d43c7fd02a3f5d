//! Materials as the shaders see them (shaders/lib/material.glsl).

use crate::accel::Texel;
use crate::scene::{Bsdf, Conductor, Coverage, Material, MetallicRoughness, Reflection, Surface, TextureSlot};

use crate::render::kernel::layout::{bsdf as kind, flag};
use crate::render::scene::fresnel;
use crate::render::space::RenderSpace;

/// The textures of a material, in the order of their texels: those of its details, those of its layers, then that of what it
/// lets through.
pub(crate) const SLOTS: [TextureSlot; 13] = [
    TextureSlot::BaseColor,
    TextureSlot::MetallicRoughness,
    TextureSlot::Normal,
    TextureSlot::Emission,
    TextureSlot::Coat,
    TextureSlot::CoatRoughness,
    TextureSlot::CoatNormal,
    TextureSlot::Anisotropy,
    TextureSlot::SheenColor,
    TextureSlot::SheenRoughness,
    TextureSlot::Specular,
    TextureSlot::SpecularColor,
    TextureSlot::Transmission,
];
/// Texels of a material's details.
const DETAIL_TEXELS: usize = 6;
/// Texels of what lies over its base or makes that anisotropic.
const LAYER_TEXELS: usize = 5;

/// Records of all materials, and details.
#[derive(Debug, Default)]
pub(crate) struct MaterialTexels {
    pub records: Vec<[Texel; 2]>,
    pub details: Vec<Texel>,
}

impl MaterialTexels {
    /// `texture_of` has the number of a material's texture.
    ///
    /// A triangle with vertex colours needs details of its material; `all` gives some to each.
    pub fn of(
        materials: &[Material],
        space: &RenderSpace,
        all: bool,
        texture_of: impl Fn(usize, TextureSlot) -> Option<u32>,
    ) -> Self {
        let mut details: Vec<[f32; 4]> = Vec::new();
        let mut layers: Vec<(usize, [[f32; 4]; LAYER_TEXELS])> = Vec::new();
        let mut records = Vec::with_capacity(materials.len());
        for (index, material) in materials.iter().enumerate() {
            let number = (details.len() / DETAIL_TEXELS) as f32;
            let is_detailed = (all || material.has_details()) && !material.surface.is_dielectric();
            records.push(record(material, is_detailed.then_some(number)));
            if is_detailed {
                if material.has_layers() {
                    layers.push((details.len(), layer_texels(material, |slot| texture_of(index, slot))));
                }
                details.extend(detail_texels(material, space, |slot| texture_of(index, slot)));
            }
        }
        // After the details of all materials, which say where.
        for (of_material, texels) in layers {
            details[of_material + 2][1] = details.len() as f32;
            details.extend(texels);
        }
        let details = details.into_iter().map(|texel| texel.map(f32::to_bits)).collect();
        Self { records, details }
    }
}

fn record(material: &Material, details: Option<f32>) -> [Texel; 2] {
    let Surface { bsdf, emission, two_sided } = material.surface;
    let (kind, reflectance, ior) = match bsdf {
        Bsdf::Black => (kind::NONE, [0.0; 3], 1.0),
        Bsdf::Diffuse { reflectance } => (kind::DIFFUSE, reflectance, 1.0),
        Bsdf::Mirror { reflectance } => (kind::MIRROR, reflectance, 1.0),
        Bsdf::Dielectric { ior } => (kind::DIELECTRIC, [1.0; 3], ior),
        Bsdf::MetallicRoughness(m) => (kind::METALLIC_ROUGHNESS, m.base_color, 1.0),
        Bsdf::Conductor(_) => (kind::METALLIC_ROUGHNESS, [1.0; 3], 1.0),
    };
    let flags = [
        (two_sided, flag::TWO_SIDED),
        (details.is_some(), flag::DETAILED),
        (material.unlit, flag::UNLIT),
        (material.surface.is_conductor(), flag::CONDUCTOR),
    ];
    let kind = flags.iter().filter(|(is_set, _)| *is_set).fold(kind, |all, (_, flag)| all | flag);
    let last = details.unwrap_or(ior as f32);
    [rgb(reflectance, f32::from_bits(kind)), rgb(emission, last)].map(|texel| texel.map(f32::to_bits))
}

fn detail_texels(
    material: &Material,
    space: &RenderSpace,
    texture_of: impl Fn(TextureSlot) -> Option<u32>,
) -> [[f32; 4]; DETAIL_TEXELS] {
    let model = match material.surface.bsdf {
        Bsdf::MetallicRoughness(model) => model,
        Bsdf::Conductor(Conductor { roughness, .. }) => MetallicRoughness { roughness, ..MetallicRoughness::default() },
        _ => MetallicRoughness { metallic: 0.0, ..MetallicRoughness::default() },
    };
    let coverage = match material.coverage {
        Coverage::Opaque => 0.0,
        Coverage::Mask(least) => least.max(0.0) as f32,
        Coverage::Blend => -1.0,
    };
    let textures = numbers(&texture_of);
    let is_body = if model.has_volume && model.transmission > 0.0 { 1.0 } else { 0.0 };
    [
        [model.metallic as f32, model.roughness as f32, material.alpha as f32, coverage],
        dielectric_fresnel(&model, material.has_specular_textures()),
        [material.normal_scale as f32, -1.0, 0.0, 0.0],
        [textures[0], textures[1], textures[2], textures[3]],
        [model.transmission as f32, textures[12], model.ior as f32, is_body],
        rgb(model.absorption().map(|per_unit| space.scene_length(per_unit)), 0.0),
    ]
}

/// The numbers of the textures of a material, or −1.
fn numbers(texture_of: impl Fn(TextureSlot) -> Option<u32>) -> [f32; SLOTS.len()] {
    SLOTS.map(|slot| texture_of(slot).map_or(-1.0, |number| number as f32))
}

fn layer_texels(material: &Material, texture_of: impl Fn(TextureSlot) -> Option<u32>) -> [[f32; 4]; LAYER_TEXELS] {
    let model = match material.surface.bsdf {
        Bsdf::MetallicRoughness(model) => model,
        Bsdf::Conductor(conductor) => return conductor_texels(&conductor),
        _ => MetallicRoughness::default(),
    };
    let (sin, cos) = model.anisotropy_rotation.sin_cos();
    let textures = numbers(texture_of);
    [
        [model.coat as f32, model.coat_roughness as f32, material.coat_normal_scale as f32, 0.0],
        rgb(model.sheen_color, model.sheen_roughness as f32),
        [model.anisotropy as f32, cos as f32, sin as f32, 0.0],
        [textures[4], textures[5], textures[6], textures[7]],
        [textures[8], textures[9], textures[10], textures[11]],
    ]
}

fn conductor_texels(conductor: &Conductor) -> [[f32; 4]; LAYER_TEXELS] {
    let mean = rgb(fresnel::mean(&conductor.reflection), 0.0);
    let [first, second] = match conductor.reflection {
        Reflection::Constant(reflectance) => [rgb(reflectance, 0.0), [0.0; 4]],
        Reflection::Index { eta, k } => [rgb(eta, 1.0), rgb(k, 0.0)],
    };
    [first, second, mean, [0.0; 4], [0.0; 4]]
}

/// Reflectance of the dielectric at normal and at grazing incidence (KHR_materials_ior, KHR_materials_specular). Of one with textures
/// the first before it is limited to 1 and weakened.
fn dielectric_fresnel(model: &MetallicRoughness, has_textures: bool) -> [f32; 4] {
    let normal = ((model.ior - 1.0) / (model.ior + 1.0)).powi(2);
    let f0 = model.specular_color.map(|color| normal * color);
    let f0 = if has_textures { f0 } else { f0.map(|x| x.min(1.0) * model.specular) };
    rgb(f0, model.specular as f32)
}

/// A texel of a colour and another number.
pub(crate) fn rgb(c: [f64; 3], w: f32) -> [f32; 4] {
    [c[0] as f32, c[1] as f32, c[2] as f32, w]
}
