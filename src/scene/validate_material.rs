//! What makes materials and their textures renderable.

use std::collections::HashMap;

use crate::scene::description::*;
use crate::scene::error::Entity;
use crate::scene::limits::{EXPECTED_IOR, IOR_RANGE, MAX_MAGNITUDE};
use crate::scene::problem::{Check, Problem, check_non_negative, number, vector};
use crate::scene::texture::{Texels, Texture, TextureImage};

pub(super) fn check_materials(materials: &[Material], images: &[TextureImage]) -> Check {
    let mut first_of_name = HashMap::new();
    for (index, material) in materials.iter().enumerate() {
        let entity = Entity::Material(index);
        if material.name.is_empty() {
            return Err(Problem::new(entity, "name", "empty", "a name"));
        }
        if let Some(first) = first_of_name.insert(&material.name, index) {
            let expected = format!("a name of its own: it is taken by {}", Entity::Material(first));
            return Err(Problem::new(entity, "name", format!("{:?}", material.name), expected));
        }
        check_surface(entity, &material.surface)?;
        check_share(entity, "alpha", material.alpha)?;
        if let Coverage::Mask(cutoff) = material.coverage {
            check_finite(entity, "alpha_cutoff", cutoff)?;
        }
        check_finite(entity, "normal_scale", material.normal_scale)?;
        check_finite(entity, "coat_normal_scale", material.coat_normal_scale)?;
        material.textures.values().try_for_each(|texture| check_texture(entity, texture, images.len()))?;
    }
    Ok(())
}

fn check_surface(entity: Entity, surface: &Surface) -> Check {
    let Surface { bsdf, emission, .. } = *surface;
    match bsdf {
        Bsdf::Diffuse { reflectance } | Bsdf::Mirror { reflectance } => {
            check_shares(entity, "reflectance", reflectance)?
        }
        Bsdf::Dielectric { ior } => check_ior(entity, ior)?,
        Bsdf::MetallicRoughness(m) => check_metallic_roughness(entity, &m)?,
        Bsdf::Black => {}
    }
    let field = if bsdf == Bsdf::Black { "radiance" } else { "emission" };
    check_non_negative(entity, field, emission)
}

fn check_metallic_roughness(entity: Entity, m: &MetallicRoughness) -> Check {
    check_shares(entity, "base_color", m.base_color)?;
    check_shares(entity, "attenuation_color", m.attenuation_color)?;
    check_shares(entity, "sheen_color", m.sheen_color)?;
    check_non_negative(entity, "specular_color", m.specular_color)?;
    for (field, value) in [
        ("metallic", m.metallic),
        ("roughness", m.roughness),
        ("specular", m.specular),
        ("transmission", m.transmission),
        ("coat", m.coat),
        ("coat_roughness", m.coat_roughness),
        ("sheen_roughness", m.sheen_roughness),
        ("anisotropy", m.anisotropy),
    ] {
        check_share(entity, field, value)?;
    }
    check_finite(entity, "anisotropy_rotation", m.anisotropy_rotation)?;
    if m.has_volume {
        check_ior(entity, m.ior)?;
    } else if !(m.ior >= 1.0 && IOR_RANGE.contains(&m.ior)) {
        return Err(Problem::new(entity, "ior", number(m.ior), "a number from 1 to 1000"));
    }
    if m.attenuation_distance.is_nan() || m.attenuation_distance <= 0.0 {
        return Err(Problem::new(
            entity,
            "attenuation_distance",
            number(m.attenuation_distance),
            "a number > 0, or inf",
        ));
    }
    Ok(())
}

fn check_texture(entity: Entity, texture: &Texture, images: usize) -> Check {
    if texture.image as usize >= images {
        return Err(Problem::new(entity, "image", texture.image, format!("an index below {images}")));
    }
    if texture.uv_set > 1 {
        return Err(Problem::new(entity, "uv_set", texture.uv_set, "0 or 1"));
    }
    texture.transform.as_flattened().iter().try_for_each(|&x| check_finite(entity, "transform", x))
}

/// Checks that the pixels of an image are as many as it has, and finite.
pub(super) fn check_image(index: usize, image: &TextureImage) -> Check {
    let entity = Entity::Image(index);
    let pixels = image.width as usize * image.height as usize;
    let found = match &image.texels {
        Texels::Rgba8(texels) => texels.len(),
        Texels::Rgba16(texels) => texels.len(),
        Texels::Rgba32F(texels) => texels.len(),
    };
    if pixels == 0 || found != pixels {
        let expected = format!("{} x {}, at least 1", image.width, image.height);
        return Err(Problem::new(entity, "the number of pixels", found, expected));
    }
    if let Texels::Rgba32F(texels) = &image.texels {
        let is_wrong = |x: &&f32| !(x.is_finite() && **x >= 0.0);
        if let Some(x) = texels.as_flattened().iter().find(is_wrong) {
            return Err(Problem::new(entity, "a pixel", x, "finite numbers >= 0"));
        }
    }
    Ok(())
}

fn check_ior(entity: Entity, value: f64) -> Check {
    if IOR_RANGE.contains(&value) { Ok(()) } else { Err(Problem::new(entity, "ior", number(value), EXPECTED_IOR)) }
}

fn check_shares(entity: Entity, field: &'static str, value: Rgb) -> Check {
    if value.iter().all(|x| (0.0..=1.0).contains(x)) {
        return Ok(());
    }
    Err(Problem::new(entity, field, vector(value.into()), "three numbers from 0 to 1"))
}

fn check_share(entity: Entity, field: &'static str, value: f64) -> Check {
    if (0.0..=1.0).contains(&value) {
        Ok(())
    } else {
        Err(Problem::new(entity, field, number(value), "a number from 0 to 1"))
    }
}

fn check_finite(entity: Entity, field: &'static str, value: f64) -> Check {
    if value.abs() <= MAX_MAGNITUDE {
        Ok(())
    } else {
        Err(Problem::new(entity, field, number(value), "a finite number"))
    }
}
