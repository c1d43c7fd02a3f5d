//! From the tables of a scene file to a scene: names become indices, meshes are read.

use crate::scene::description::*;
use crate::scene::environment::Environment;
use crate::scene::error::{Entity, SceneError};
use crate::scene::format::*;
use crate::scene::limits::{MAX_DEPTH, MAX_IMAGE_SIDE, MAX_SAMPLES};
use crate::scene::load_options::LoadOptions;
use crate::scene::materials::MaterialList;
use crate::scene::named_camera::NamedCamera;
use crate::scene::problem::{Problem, check_integer, check_positive, number};
use crate::scene::table_material::define_material;
use crate::scene::table_model::Content;
use crate::scene::table_source::{Source, find_material};
use crate::scene::table_texture::NamedTextures;

/// Builds the scene, and lists its cameras: its own, then those of models. Its values are not validated yet, except those that the
/// scene's own types could not hold.
pub(super) fn build(
    source: &Source<'_>,
    tables: SceneTable,
    options: &LoadOptions,
    warnings: &mut Vec<String>,
) -> Result<(Scene, Vec<NamedCamera>), SceneError> {
    let mut materials = MaterialList::default();
    let textures = NamedTextures::read(source, &tables.texture, &mut materials)?;
    for (index, table) in tables.material.iter().enumerate() {
        define_material(&mut materials, index, table, &textures).map_err(|problem| source.error(problem))?;
    }
    let integrator = integrator(&tables.integrator).map_err(|problem| source.error(problem))?;
    let camera = camera(&tables.camera).map_err(|problem| source.error(problem))?;
    let film = film(&tables.film).map_err(|problem| source.error(problem))?;
    let spheres = tables.sphere.iter().enumerate().map(|(index, table)| {
        let material = find_material(&materials, Entity::Sphere(index), &table.material)?;
        Ok(Sphere { center: table.center.0.into(), radius: table.radius, material, inward: table.inward })
    });
    let spheres: Vec<Sphere> = spheres.collect::<Result<_, _>>().map_err(|problem| source.error(problem))?;
    for (index, sphere) in spheres.iter().enumerate() {
        let material = materials.get(sphere.material);
        if !material.textures.is_empty() || material.lets_rays_pass() {
            let (entity, at) = (Entity::Sphere(index), source.locate(Entity::Sphere(index), "material"));
            warnings.push(format!(
                "{at}: {entity}: textures, alpha and double_sided of {:?} are of meshes only",
                material.name
            ));
        }
    }
    let Content { meshes, lights: of_models, cameras, .. } =
        Content::read(source, &tables, options, &mut materials, warnings)?;
    let lights = tables.light.iter().enumerate().map(|(index, table)| light(Entity::Light(index), table));
    let mut lights: Vec<Light> = lights.collect::<Result<_, _>>().map_err(|problem| source.error(problem))?;
    lights.extend(of_models);
    let environment = match &tables.environment {
        Some(table) => Some(environment(source, table, warnings)?),
        None => None,
    };
    if environment.is_some() && tables.background.radiance.0 != [0.0; 3] {
        let problem = Problem::new(Entity::Background, "radiance", "given", "none beside an [environment]");
        return Err(source.error(problem));
    }
    let (materials, images) = materials.into_parts();
    let own = NamedCamera { name: "camera".to_owned(), camera: camera.clone(), vertical: None };
    let scene = Scene {
        source: source.name.to_owned(),
        camera,
        film,
        integrator,
        background: tables.background.radiance.0,
        lights,
        materials,
        images,
        environment,
        spheres,
        meshes,
    };
    Ok((scene, [own].into_iter().chain(cameras).collect()))
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
    let (path, bytes) = source.read(entity, &table.file)?;
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

/// A number that the scene's `u32` can hold.
fn integer(entity: Entity, field: &'static str, value: i64, most: u32) -> Result<u32, Problem> {
    check_integer(entity, field, value, 1, most)?;
    Ok(value as u32)
}
