//! From the tables of a scene file to a scene: names become indices, meshes are read.

use std::path::Path;

use glam::DVec3;

use crate::scene::description::*;
use crate::scene::environment::Environment;
use crate::scene::error::{Entity, Location, SceneError};
use crate::scene::format::*;
use crate::scene::limits::{MAX_DEPTH, MAX_IMAGE_SIDE, MAX_SAMPLES};
use crate::scene::locate::locate_value;
use crate::scene::materials::MaterialList;
use crate::scene::obj::{MaterialSource, MeshRequest, NormalsChoice};
use crate::scene::problem::{Problem, check_integer, check_positive, check_vector, number};
use crate::scene::read::read_relative;
use crate::scene::transform::Placement;

/// The text that a scene is being built from.
pub(super) struct Source<'a> {
    pub text: &'a str,
    pub name: &'a str,
    /// Folder that the paths in the file start from; without one no other file can be read.
    pub base_dir: Option<&'a Path>,
}

impl Source<'_> {
    pub fn locate(&self, entity: Entity, field: &str) -> Location {
        locate_value(self.text, self.name, entity, field)
    }

    pub fn error(&self, problem: Problem) -> SceneError {
        let at = self.locate(problem.entity, &problem.field);
        problem.at(at)
    }
}

/// Builds the scene. Its values are not validated yet, except those that the scene's own types could not hold.
pub(super) fn build(source: &Source<'_>, tables: SceneTable, warnings: &mut Vec<String>) -> Result<Scene, SceneError> {
    let mut materials = MaterialList::default();
    for (index, table) in tables.material.into_iter().enumerate() {
        define_material(&mut materials, index, table).map_err(|problem| source.error(problem))?;
    }
    let integrator = integrator(&tables.integrator).map_err(|problem| source.error(problem))?;
    let camera = camera(&tables.camera).map_err(|problem| source.error(problem))?;
    let film = film(&tables.film).map_err(|problem| source.error(problem))?;
    let spheres = tables.sphere.into_iter().enumerate().map(|(index, table)| {
        let material = find_material(&materials, Entity::Sphere(index), &table.material)?;
        Ok(Sphere { center: table.center.0.into(), radius: table.radius, material, inward: table.inward })
    });
    let spheres = spheres.collect::<Result<_, _>>().map_err(|problem| source.error(problem))?;
    let mut meshes = Vec::with_capacity(tables.mesh.len());
    for (index, table) in tables.mesh.iter().enumerate() {
        meshes.push(load_mesh(source, index, table, &mut materials, warnings)?);
    }
    let lights = tables.light.iter().enumerate().map(|(index, table)| light(Entity::Light(index), table));
    let lights = lights.collect::<Result<_, _>>().map_err(|problem| source.error(problem))?;
    let environment = match &tables.environment {
        Some(table) => Some(environment(source, table, warnings)?),
        None => None,
    };
    if environment.is_some() && tables.background.radiance.0 != [0.0; 3] {
        let problem = Problem::new(Entity::Background, "radiance", "given", "none beside an [environment]");
        return Err(source.error(problem));
    }
    Ok(Scene {
        source: source.name.to_owned(),
        camera,
        film,
        integrator,
        background: tables.background.radiance.0,
        lights,
        materials: materials.into_vec(),
        images: Vec::new(),
        environment,
        spheres,
        meshes,
    })
}

/// Width of the sensor behind a lens whose focal length is not stated: that of 35 mm film.
const SENSOR_MM: f64 = 36.0;

fn camera(table: &CameraTable) -> Result<Camera, Problem> {
    let entity = Entity::Camera;
    let needed = |field, value: Option<f64>, kind| {
        value.ok_or_else(|| Problem::new(entity, field, "missing", format!("a number: {kind} camera needs one")))
    };
    let unwanted = |field, value: Option<f64>, expected: &'static str| match value {
        Some(found) => Err(Problem::new(entity, field, number(found), expected)),
        None => Ok(()),
    };
    let (position, target) = (table.position.0.into(), table.target.0.into());
    let mut camera = Camera { position, target, up: table.up.0.into(), ..Camera::default() };
    match table.kind {
        CameraKind::Perspective => {
            camera.horizontal_fov = needed("horizontal_fov", table.horizontal_fov, "a perspective")?;
            unwanted("width", table.width, "none: only an orthographic camera has one")?;
        }
        CameraKind::Orthographic => {
            camera.orthographic_width = Some(needed("width", table.width, "an orthographic")?);
            unwanted("horizontal_fov", table.horizontal_fov, "none: an orthographic camera has width instead")?;
        }
    }
    let radius = match (table.lens_radius, table.f_number) {
        (Some(_), Some(f_number)) => {
            return Err(Problem::new(entity, "f_number", number(f_number), "none beside lens_radius, or that alone"));
        }
        (Some(radius), None) => {
            unwanted("focal_length_mm", table.focal_length_mm, "none: it goes with f_number")?;
            radius
        }
        (None, Some(f_number)) => {
            check_positive(entity, "f_number", f_number)?;
            let half_angle = camera.horizontal_fov.to_radians() / 2.0;
            let focal_length = match (table.focal_length_mm, table.kind) {
                (Some(focal_length), _) => focal_length,
                (None, CameraKind::Perspective) => SENSOR_MM / 2.0 / half_angle.tan(),
                (None, CameraKind::Orthographic) => needed("focal_length_mm", None, "with f_number, an orthographic")?,
            };
            check_positive(entity, "focal_length_mm", focal_length)?;
            // A unit is a metre.
            focal_length / f_number / 2.0 / 1000.0
        }
        (None, None) => {
            unwanted("focal_length_mm", table.focal_length_mm, "none: it goes with f_number")?;
            if table.focus.is_some() {
                return Err(Problem::new(entity, "focus", "there", "lens_radius or f_number beside it"));
            }
            return Ok(camera);
        }
    };
    let focus = match table.focus {
        Some(FocusValue::Distance(distance)) => distance,
        Some(FocusValue::Target) | None => position.distance(target),
    };
    // A lens without extent is none.
    camera.lens = (radius != 0.0).then_some(Lens { radius, focus });
    Ok(camera)
}

fn film(table: &FilmTable) -> Result<Film, Problem> {
    let side = |field, value| integer(Entity::Film, field, value, MAX_IMAGE_SIDE);
    Ok(Film {
        width: side("width", table.width)?,
        height: side("height", table.height)?,
        filter: match table.filter {
            FilterName::Gaussian => PixelFilter::Gaussian,
            FilterName::Box => PixelFilter::Box,
        },
        transfer: match table.gamma {
            GammaValue::Number(gamma) => Transfer::Gamma(gamma),
            GammaValue::Srgb => Transfer::Srgb,
        },
        exposure: match table.exposure {
            ExposureValue::Stops(stops) => Exposure::Stops(stops),
            ExposureValue::Auto => Exposure::Auto,
        },
        tone: match table.tone {
            ToneName::None => Tone::None,
            ToneName::Neutral => Tone::Neutral,
            ToneName::Agx => Tone::Agx,
        },
        transparent: table.transparent,
    })
}

fn integrator(table: &IntegratorTable) -> Result<Integrator, Problem> {
    let entity = Entity::Integrator;
    Ok(Integrator {
        max_depth: integer(entity, "max_depth", table.max_depth, MAX_DEPTH)?,
        samples: integer(entity, "samples", table.samples, MAX_SAMPLES)?,
        russian_roulette: match table.russian_roulette {
            RouletteValue::From(depth) => Some(integer(entity, "russian_roulette", depth, u32::MAX)?),
            RouletteValue::Off => None,
        },
        indirect: table.indirect,
    })
}

fn light(entity: Entity, table: &LightTable) -> Result<Light, Problem> {
    let triple = |field, value: Option<Triple>| match value {
        Some(triple) => Ok(triple.0),
        None => Err(Problem::new(entity, field, "missing", "a value: the light's type needs one")),
    };
    let is_superfluous = |keys: &[(&'static str, bool)]| {
        let found = keys.iter().find(|(_, is_there)| *is_there);
        found.map_or(Ok(()), |&(field, _)| Err(Problem::new(entity, field, "given", "none for a light of this type")))
    };
    let has_cone = table.inner.is_some() || table.outer.is_some();
    let (power, intensity) = (("power", table.power.is_some()), ("intensity", table.intensity.is_some()));
    let (direction, irradiance) =
        (("direction", table.direction.is_some()), ("irradiance", table.irradiance.is_some()));
    let (cone, range) = (("inner and outer", has_cone), ("range", table.range.is_some()));
    match table.kind {
        LightKind::Point => {
            is_superfluous(&[intensity, direction, irradiance, cone, range])?;
            let position = triple("position", table.position)?.into();
            Ok(Light::Point { position, power: triple("power", table.power)? })
        }
        LightKind::Spot => {
            is_superfluous(&[power, irradiance])?;
            let outer = table.outer.unwrap_or(45.0);
            Ok(Light::Spot {
                position: triple("position", table.position)?.into(),
                direction: triple("direction", table.direction)?.into(),
                intensity: triple("intensity", table.intensity)?,
                inner: table.inner.unwrap_or(0.0),
                outer,
                range: table.range.unwrap_or(f64::INFINITY),
            })
        }
        LightKind::Directional => {
            is_superfluous(&[("position", table.position.is_some()), power, intensity, cone, range])?;
            let direction = triple("direction", table.direction)?.into();
            Ok(Light::Directional { direction, irradiance: triple("irradiance", table.irradiance)? })
        }
    }
}

fn environment(
    source: &Source<'_>,
    table: &EnvironmentTable,
    warnings: &mut Vec<String>,
) -> Result<Environment, SceneError> {
    let entity = Entity::Environment;
    let (path, bytes) = read_relative(source.base_dir, &table.file)?;
    let read = Environment::read(&bytes, &path.display().to_string());
    let (map, warning) = read.map_err(|found| {
        source.error(Problem::new(
            entity,
            "file",
            format!("{:?}: {found}", table.file),
            "an environment map: .hdr, .exr or a picture",
        ))
    })?;
    warnings.extend(warning);
    Ok(Environment { rotation: table.rotation, scale: table.scale, visible: table.visible, ..map })
}

fn define_material(materials: &mut MaterialList, index: usize, table: MaterialTable) -> Result<(), Problem> {
    let entity = Entity::Material(index);
    let (kind, surface) = match table.kind {
        MaterialKind::Diffuse => {
            let reflectance = required(entity, "reflectance", table.reflectance)?.0;
            ("diffuse", Surface::diffuse(reflectance))
        }
        MaterialKind::Mirror => ("mirror", Surface::mirror(table.reflectance.map_or([1.0; 3], |triple| triple.0))),
        MaterialKind::Dielectric => ("dielectric", dielectric(entity, &table)?),
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
                ..with_attenuation(entity, &table, default)?
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
    let superfluous = [
        ("reflectance", table.reflectance.is_some() && !takes_reflectance),
        ("ior", table.ior.is_some() && !is_pbr && !is_dielectric),
        ("base_color", table.base_color.is_some() && !is_pbr),
        ("metallic", table.metallic.is_some() && !is_pbr),
        ("roughness", table.roughness.is_some() && !is_pbr && !is_dielectric),
        ("transmission", table.transmission.is_some() && !is_pbr),
        ("thin", table.thin.is_some() && !is_pbr),
        ("attenuation_color", table.attenuation_color.is_some() && !is_pbr && !is_dielectric),
        ("attenuation_distance", table.attenuation_distance.is_some() && !is_pbr && !is_dielectric),
        ("specular", table.specular.is_some() && !is_pbr),
        ("specular_color", table.specular_color.is_some() && !is_pbr),
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
    match materials.define(table.name, surface) {
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

fn required<T>(entity: Entity, field: &'static str, value: Option<T>) -> Result<T, Problem> {
    value.ok_or_else(|| Problem::new(entity, field, "missing", "a value: the material's type needs one"))
}

fn find_material(materials: &MaterialList, entity: Entity, name: &str) -> Result<u32, Problem> {
    materials.find(name).ok_or_else(|| {
        let names = materials.names();
        let expected = if names.is_empty() {
            "the name of a [[material]], of which there are none".to_owned()
        } else {
            format!("the name of a [[material]]: {names}")
        };
        Problem::new(entity, "material", format!("{name:?}"), expected)
    })
}

fn load_mesh(
    source: &Source<'_>,
    index: usize,
    table: &MeshTable,
    materials: &mut MaterialList,
    warnings: &mut Vec<String>,
) -> Result<Mesh, SceneError> {
    let entity = Entity::Mesh(index);
    let request = mesh_request(entity, table, materials).map_err(|problem| source.error(problem))?;
    let mesh = read_relative(source.base_dir, &table.file).and_then(|(path, bytes)| {
        request.build(&bytes, &path.display().to_string(), path.parent(), materials, warnings)
    });
    mesh.map_err(|cause| SceneError::Mesh { at: source.locate(entity, "file"), entity, cause: Box::new(cause) })
}

fn mesh_request(entity: Entity, table: &MeshTable, materials: &MaterialList) -> Result<MeshRequest, Problem> {
    let is_obj = Path::new(&table.file).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    if !is_obj {
        return Err(Problem::new(entity, "file", format!("{:?}", table.file), "a file whose name ends in .obj"));
    }
    // Checked before they are used, so that they and not the vertices are blamed.
    check_positive(entity, "scale", table.scale)?;
    let (rotate, translate) = (DVec3::from(table.rotate.0), DVec3::from(table.translate.0));
    check_vector(entity, "rotate", rotate)?;
    check_vector(entity, "translate", translate)?;
    Ok(MeshRequest {
        placement: Placement { scale: table.scale, rotate, translate },
        normals: match table.normals {
            NormalsName::Flat => NormalsChoice::Flat,
            NormalsName::Smooth => NormalsChoice::Smooth,
        },
        material: match &table.material {
            Some(name) => MaterialSource::Given(find_material(materials, entity, name)?),
            None => MaterialSource::Mtl,
        },
    })
}

/// A number that the scene's `u32` can hold.
fn integer(entity: Entity, field: &'static str, value: i64, most: u32) -> Result<u32, Problem> {
    check_integer(entity, field, value, 1, most)?;
    Ok(value as u32)
}
