//! `[[texture]]`, and the keys of materials that name one.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::scene::description::{Bsdf, Coverage, Material};
use crate::scene::error::{Entity, SceneError};
use crate::scene::format::*;
use crate::scene::image_file::{KINDS, decode};
use crate::scene::materials::MaterialList;
use crate::scene::problem::{Check, Problem, number};
use crate::scene::table_source::Source;
use crate::scene::texture::{Texels, Texture, TextureImage, TextureSlot, Wrap};

/// The textures of a scene file, by name.
pub(super) struct NamedTextures {
    by_name: HashMap<String, Named>,
}

#[derive(Clone, Copy)]
struct Named {
    texture: Texture,
    color: ColorName,
    has_floats: bool,
}

impl NamedTextures {
    /// Reads their images into the list.
    pub fn read(source: &Source<'_>, tables: &[TextureTable], list: &mut MaterialList) -> Result<Self, SceneError> {
        let read = |(index, table): (usize, &TextureTable)| -> Result<TextureImage, SceneError> {
            let entity = Entity::Texture(index);
            let (path, bytes) = source.read(entity, &table.file)?;
            decode(&bytes, &path.display().to_string()).map_err(|found| {
                let found = format!("{:?}: {found}", table.file);
                source.error(Problem::new(entity, "file", found, format!("an image of type {KINDS}")))
            })
        };
        let images: Vec<_> = tables.par_iter().enumerate().map(read).collect::<Result<_, _>>()?;
        let mut by_name = HashMap::new();
        for ((index, table), image) in tables.iter().enumerate().zip(images) {
            let entity = Entity::Texture(index);
            let has_floats = matches!(image.texels, Texels::Rgba32F(_));
            let texture = texture(entity, table, list.add_image(image)).map_err(|problem| source.error(problem))?;
            let named = Named { texture, color: table.color, has_floats };
            if by_name.insert(table.name.clone(), named).is_some() {
                let found = format!("{:?}", table.name);
                return Err(source.error(Problem::new(entity, "name", found, "a name that no earlier texture has")));
            }
        }
        Ok(Self { by_name })
    }

    fn find(&self, entity: Entity, field: &'static str, name: &str, is_color: bool) -> Result<Texture, Problem> {
        let Some(named) = self.by_name.get(name) else {
            let mut names: Vec<_> = self.by_name.keys().map(|name| format!("{name:?}")).collect();
            names.sort();
            let expected = match names.is_empty() {
                true => "the name of a [[texture]], of which there are none".to_owned(),
                false => format!("the name of a [[texture]]: {}", names.join(", ")),
            };
            return Err(Problem::new(entity, field, format!("{name:?}"), expected));
        };
        let srgb = match named.color {
            ColorName::Srgb => true,
            ColorName::Linear => false,
            // Floats are radiance or shares, and no codes.
            ColorName::Auto => is_color && !named.has_floats,
        };
        Ok(Texture { srgb, ..named.texture })
    }

    /// Adds what a material's table says of textures and alpha.
    pub fn apply(&self, entity: Entity, table: &MaterialTable, material: &mut Material) -> Check {
        let is_pbr = matches!(table.kind, MaterialKind::Pbr);
        let is_glass = matches!(table.kind, MaterialKind::Dielectric);
        let is_emitter = matches!(table.kind, MaterialKind::Emitter);
        let own = if is_emitter { TextureSlot::Emission } else { TextureSlot::BaseColor };
        let no_alpha = table.alpha.is_none() && table.opacity.is_none();
        for (field, name, slot, is_taken) in [
            ("texture", &table.texture, own, !is_pbr && !is_glass),
            ("base_color_texture", &table.base_color_texture, TextureSlot::BaseColor, is_pbr),
            ("metallic_roughness_texture", &table.metallic_roughness_texture, TextureSlot::MetallicRoughness, is_pbr),
            ("normal_texture", &table.normal_texture, TextureSlot::Normal, !is_glass && !is_emitter),
            ("emission_texture", &table.emission_texture, TextureSlot::Emission, !is_glass && !is_emitter),
        ] {
            let Some(name) = name else { continue };
            if !is_taken {
                return Err(Problem::new(entity, field, "given", "none for a material of this type"));
            }
            let is_color = !matches!(slot, TextureSlot::MetallicRoughness | TextureSlot::Normal);
            material.textures.insert(slot, self.find(entity, field, name, is_color)?);
        }
        let superfluous = [
            (
                "normal_scale",
                table.normal_scale.is_some() && table.normal_texture.is_none(),
                "a normal_texture beside it",
            ),
            (
                "emission_texture",
                table.emission_texture.is_some() && table.emission.is_none(),
                "an emission beside it, which it multiplies",
            ),
            (
                "alpha_cutoff",
                table.alpha_cutoff.is_some() && table.alpha != Some(AlphaName::Mask),
                "alpha = \"mask\" beside it",
            ),
            (
                "opacity",
                table.opacity.is_some() && table.alpha.unwrap_or_default() == AlphaName::Opaque,
                "alpha beside it",
            ),
            ("alpha", !no_alpha && is_glass, "none for a material of this type"),
        ];
        if let Some((field, _, expected)) = superfluous.into_iter().find(|(_, is_there, _)| *is_there) {
            return Err(Problem::new(entity, field, "given", expected));
        }
        if let Some(opacity) = table.opacity.filter(|opacity| !(0.0..=1.0).contains(opacity)) {
            return Err(Problem::new(entity, "opacity", number(opacity), "a number from 0 to 1"));
        }
        material.normal_scale = table.normal_scale.unwrap_or(1.0);
        material.alpha = table.opacity.unwrap_or(1.0);
        material.coverage = match table.alpha.unwrap_or_default() {
            AlphaName::Opaque => Coverage::Opaque,
            AlphaName::Mask => Coverage::Mask(table.alpha_cutoff.unwrap_or(0.5)),
            AlphaName::Blend => Coverage::Blend,
        };
        let is_double_sided = table.double_sided.unwrap_or(true);
        if !is_double_sided && matches!(material.surface.bsdf, Bsdf::Dielectric { .. }) {
            return Err(Problem::new(
                entity,
                "double_sided",
                "false",
                "true: light that has entered leaves by the back",
            ));
        }
        material.culls_back = !is_double_sided;
        Ok(())
    }
}

fn texture(entity: Entity, table: &TextureTable, image: u32) -> Result<Texture, Problem> {
    let wrap = |name: WrapName| match name {
        WrapName::Repeat => Wrap::Repeat,
        WrapName::Mirror => Wrap::Mirror,
        WrapName::Clamp => Wrap::Clamp,
    };
    let ([ox, oy], [sx, sy], (sin, cos)) = (table.offset.0, table.scale.0, table.rotate.to_radians().sin_cos());
    for (field, x) in [("offset", ox), ("offset", oy), ("scale", sx), ("scale", sy), ("rotate", table.rotate)] {
        if !x.is_finite() {
            return Err(Problem::new(entity, field, number(x), "finite numbers"));
        }
    }
    let uv_set = match table.uv {
        0 => 0,
        1 => 1,
        other => return Err(Problem::new(entity, "uv", other, "0 or 1")),
    };
    Ok(Texture {
        wrap: table.wrap.0.map(wrap),
        nearest: table.filter == TextureFilterName::Nearest,
        uv_set,
        transform: [[sx * cos, sy * sin, ox], [-sx * sin, sy * cos, oy]],
        ..Texture::new(image, false)
    })
}
