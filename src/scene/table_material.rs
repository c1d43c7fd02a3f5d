//! From the tables of materials of a scene file to materials.

use crate::scene::description::*;
use crate::scene::error::Entity;
use crate::scene::format::*;
use crate::scene::materials::MaterialList;
use crate::scene::problem::Problem;
use crate::scene::table_texture::NamedTextures;

pub(super) fn define_material(
    materials: &mut MaterialList,
    index: usize,
    table: &MaterialTable,
    textures: &NamedTextures,
) -> Result<(), Problem> {
    let entity = Entity::Material(index);
    let (kind, surface) = match table.kind {
        MaterialKind::Diffuse => {
            let reflectance = required(entity, "reflectance", table.reflectance)?.0;
            ("diffuse", Surface::diffuse(reflectance))
        }
        MaterialKind::Mirror => {
            let reflectance = table.reflectance.map_or([1.0; 3], |triple| triple.0);
            let surface = match table.roughness {
                None | Some(0.0) => Surface::mirror(reflectance),
                Some(roughness) => conductor(Reflection::Constant(reflectance), roughness),
            };
            ("mirror", surface)
        }
        MaterialKind::Conductor => {
            let reflection = conductor_index(entity, table)?;
            ("conductor", conductor(reflection, table.roughness.unwrap_or(0.0)))
        }
        MaterialKind::Dielectric => ("dielectric", dielectric(entity, table)?),
        MaterialKind::Pbr => {
            let default = MetallicRoughness::default();
            let color = |triple: Option<Triple>| triple.map_or([1.0; 3], |triple| triple.0);
            let transmission = table.transmission.unwrap_or(default.transmission);
            let model = MetallicRoughness {
                transmission,
                has_volume: transmission > 0.0 && !table.thin.unwrap_or(false),
                base_color: color(table.base_color),
                metallic: table.metallic.unwrap_or(0.0),
                roughness: table.roughness.unwrap_or(default.roughness),
                ior: table.ior.unwrap_or(default.ior),
                specular: table.specular.unwrap_or(default.specular),
                specular_color: color(table.specular_color),
                coat: table.clearcoat.unwrap_or(default.coat),
                coat_roughness: table.clearcoat_roughness.unwrap_or(default.coat_roughness),
                sheen_color: table.sheen_color.map_or(default.sheen_color, |triple| triple.0),
                sheen_roughness: table.sheen_roughness.unwrap_or(default.sheen_roughness),
                anisotropy: table.anisotropy.unwrap_or(default.anisotropy),
                anisotropy_rotation: table.anisotropy_rotation.unwrap_or(0.0).to_radians(),
                ..with_attenuation(entity, table, default)?
            };
            if table.thin.is_some() && transmission == 0.0 {
                return Err(Problem::new(entity, "thin", "given", "none for a material without transmission"));
            }
            if table.attenuation_color.is_some() && !model.has_volume {
                let expected = "none for a material that is thin or without transmission";
                return Err(Problem::new(entity, "attenuation_color", "given", expected));
            }
            ("pbr", Surface { bsdf: Bsdf::MetallicRoughness(model), ..Surface::diffuse([0.0; 3]) })
        }
        MaterialKind::Emitter => {
            let radiance = required(entity, "radiance", table.radiance)?.0;
            ("emitter", Surface::emitter(radiance))
        }
    };
    let takes_reflectance = matches!(table.kind, MaterialKind::Diffuse | MaterialKind::Mirror);
    let is_pbr = matches!(table.kind, MaterialKind::Pbr);
    let is_dielectric = matches!(table.kind, MaterialKind::Dielectric);
    let is_emitter = matches!(table.kind, MaterialKind::Emitter);
    let is_conductor = matches!(table.kind, MaterialKind::Conductor);
    let may_be_rough = is_pbr || is_conductor || matches!(table.kind, MaterialKind::Mirror);
    let superfluous = [
        ("reflectance", table.reflectance.is_some() && !takes_reflectance),
        ("ior", table.ior.is_some() && !is_pbr && !is_dielectric),
        ("base_color", table.base_color.is_some() && !is_pbr),
        ("metallic", table.metallic.is_some() && !is_pbr),
        ("roughness", table.roughness.is_some() && !may_be_rough && !is_dielectric),
        ("transmission", table.transmission.is_some() && !is_pbr),
        ("thin", table.thin.is_some() && !is_pbr),
        ("attenuation_color", table.attenuation_color.is_some() && !is_pbr && !is_dielectric),
        ("attenuation_distance", table.attenuation_distance.is_some() && !is_pbr && !is_dielectric),
        ("specular", table.specular.is_some() && !is_pbr),
        ("specular_color", table.specular_color.is_some() && !is_pbr),
        ("clearcoat", table.clearcoat.is_some() && !is_pbr),
        ("clearcoat_roughness", table.clearcoat_roughness.is_some() && !is_pbr),
        ("sheen_color", table.sheen_color.is_some() && !is_pbr),
        ("sheen_roughness", table.sheen_roughness.is_some() && !is_pbr),
        ("anisotropy", table.anisotropy.is_some() && !is_pbr),
        ("anisotropy_rotation", table.anisotropy_rotation.is_some() && !is_pbr),
        ("eta", table.eta.is_some() && !is_conductor),
        ("k", table.k.is_some() && !is_conductor),
        ("preset", table.preset.is_some() && !is_conductor),
        ("radiance", table.radiance.is_some() && !is_emitter),
        ("emission", table.emission.is_some() && is_emitter),
    ];
    let emits = is_emitter || table.emission.is_some();
    if table.two_sided.is_some() && !emits {
        return Err(Problem::new(entity, "two_sided", "given", "none for a material that does not emit"));
    }
    if let Some((field, _)) = superfluous.into_iter().find(|&(_, is_there)| is_there) {
        return Err(Problem::new(entity, field, "given", format!("none for a material of type {kind:?}")));
    }
    let quoted_name = format!("{:?}", table.name);
    let surface = table.emission.map_or(surface, |emission| Surface { emission: emission.0, ..surface });
    let surface = Surface { two_sided: table.two_sided.unwrap_or(false), ..surface };
    let mut material = Material::new(&*table.name, surface);
    textures.apply(entity, table, &mut material)?;
    match materials.define(material) {
        Some(_) => Ok(()),
        None => Err(Problem::new(entity, "name", quoted_name, "a name that no earlier material has")),
    }
}

/// Glass that is rough or absorbs light is of the metallic-roughness model.
fn dielectric(entity: Entity, table: &MaterialTable) -> Result<Surface, Problem> {
    let ior = required(entity, "ior", table.ior)?;
    let roughness = table.roughness.unwrap_or(0.0);
    let model =
        MetallicRoughness { metallic: 0.0, roughness, ior, transmission: 1.0, has_volume: true, ..Default::default() };
    let model = with_attenuation(entity, table, model)?;
    let is_plain = roughness == 0.0 && model.attenuation_distance == f64::INFINITY;
    let rough = Surface { bsdf: Bsdf::MetallicRoughness(model), ..Surface::diffuse([0.0; 3]) };
    Ok(if is_plain { Surface::dielectric(ior) } else { rough })
}

fn with_attenuation(
    entity: Entity,
    table: &MaterialTable,
    model: MetallicRoughness,
) -> Result<MetallicRoughness, Problem> {
    match (table.attenuation_color, table.attenuation_distance) {
        (None, None) => Ok(model),
        (Some(color), Some(attenuation_distance)) => {
            Ok(MetallicRoughness { attenuation_color: color.0, attenuation_distance, ..model })
        }
        (None, _) => {
            Err(Problem::new(entity, "attenuation_color", "missing", "a value: attenuation_distance is given"))
        }
        (_, None) => {
            Err(Problem::new(entity, "attenuation_distance", "missing", "a value: attenuation_color is given"))
        }
    }
}

fn conductor(reflection: Reflection, roughness: f64) -> Surface {
    Surface { bsdf: Bsdf::Conductor(Conductor { reflection, roughness }), ..Surface::diffuse([0.0; 3]) }
}

/// The index of a conductor: its own, or that of a metal.
fn conductor_index(entity: Entity, table: &MaterialTable) -> Result<Reflection, Problem> {
    let Some(metal) = table.preset else {
        let (eta, k) = (required(entity, "eta", table.eta)?.0, required(entity, "k", table.k)?.0);
        return Ok(Reflection::Index { eta, k });
    };
    for (field, is_there) in [("eta", table.eta.is_some()), ("k", table.k.is_some())] {
        if is_there {
            return Err(Problem::new(entity, field, "given", "none beside preset, or eta and k alone"));
        }
    }
    let [eta, k] = metal.index();
    Ok(Reflection::Index { eta, k })
}

fn required<T>(entity: Entity, field: &'static str, value: Option<T>) -> Result<T, Problem> {
    value.ok_or_else(|| Problem::new(entity, field, "missing", "a value: the material's type needs one"))
}
