//! Materials as the shaders see them (shaders/lib/material.glsl).

use crate::accel::Texel;
use crate::scene::{Bsdf, Coverage, Material, MetallicRoughness, Surface, TextureSlot};

use crate::render::kernel::layout::{bsdf as kind, flag};
use crate::render::space::RenderSpace;

/// The textures of a material's details; the first four in the order of their texel.
pub(crate) const SLOTS: [TextureSlot; 5] = [
    TextureSlot::BaseColor,
    TextureSlot::MetallicRoughness,
    TextureSlot::Normal,
    TextureSlot::Emission,
    TextureSlot::Transmission,
];
/// Texels of a material's details.
const DETAIL_TEXELS: usize = 6;

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
        let mut records = Vec::with_capacity(materials.len());
        for (index, material) in materials.iter().enumerate() {
            let number = (details.len() / DETAIL_TEXELS) as f32;
            let is_detailed = (all || material.has_details()) && !material.surface.is_dielectric();
            records.push(record(material, is_detailed.then_some(number)));
            if is_detailed {
                details.extend(detail_texels(material, space, |slot| texture_of(index, slot)));
            }
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
    };
    let flags = [
        (two_sided, flag::TWO_SIDED),
        (details.is_some(), flag::DETAILED),
        (material.culls_back, flag::CULLS_BACK),
        (material.unlit, flag::UNLIT),
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
        _ => MetallicRoughness { metallic: 0.0, ..MetallicRoughness::default() },
    };
    let coverage = match material.coverage {
        Coverage::Opaque => 0.0,
        Coverage::Mask(least) => least.max(0.0) as f32,
        Coverage::Blend => -1.0,
    };
    let (f0, f90) = dielectric_fresnel(&model);
    let number = |slot| texture_of(slot).map_or(-1.0, |number| number as f32);
    let [first, second, third, fourth, transmission] = SLOTS.map(number);
    let is_body = if model.has_volume && model.transmission > 0.0 { 1.0 } else { 0.0 };
    [
        [model.metallic as f32, model.roughness as f32, material.alpha as f32, coverage],
        rgb(f0, f90 as f32),
        [material.normal_scale as f32, 0.0, 0.0, 0.0],
        [first, second, third, fourth],
        [model.transmission as f32, transmission, model.ior as f32, is_body],
        rgb(model.absorption().map(|per_unit| space.scene_length(per_unit)), 0.0),
    ]
}

/// Reflectance of the dielectric at normal and at grazing incidence (KHR_materials_ior, KHR_materials_specular).
fn dielectric_fresnel(model: &MetallicRoughness) -> ([f64; 3], f64) {
    let normal = ((model.ior - 1.0) / (model.ior + 1.0)).powi(2);
    (model.specular_color.map(|color| (normal * color).min(1.0) * model.specular), model.specular)
}

/// A texel of a colour and another number.
pub(crate) fn rgb(c: [f64; 3], w: f32) -> [f32; 4] {
    [c[0] as f32, c[1] as f32, c[2] as f32, w]
}
