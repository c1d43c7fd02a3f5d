//! What makes a scene renderable: every number finite and in range, every index in bounds.

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::description::*;
use crate::scene::environment::Environment;
use crate::scene::error::{Entity, Location, SceneError};
use crate::scene::limits::*;
use crate::scene::problem::*;
use crate::scene::triangle::has_area;
use crate::scene::unit::unit;
use crate::scene::validate_material::{check_image, check_materials};

/// Sine of the smallest angle between [`Camera::up`] and the optical axis: below it the image's orientation would be
/// made of rounding errors.
const MIN_UP_SINE: f64 = 1e-10;

impl Scene {
    /// Checks everything that rendering relies on.
    ///
    /// # Errors
    /// [`SceneError::Value`] or [`SceneError::EmptyScene`] for the first thing that is wrong, naming
    /// [`Scene::source`], the entity, what was found and what was expected.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.check_values().map_err(|problem| problem.at(Location::file(&self.source)))?;
        self.check_not_empty()
    }

    pub(super) fn check_not_empty(&self) -> Result<(), SceneError> {
        if self.spheres.is_empty() && self.triangle_count() == 0 {
            return Err(SceneError::EmptyScene { file: self.source.clone() });
        }
        Ok(())
    }

    pub(super) fn check_values(&self) -> Check {
        check_camera(&self.camera)?;
        check_film(&self.film)?;
        check_integrator(&self.integrator)?;
        check_non_negative(Entity::Background, "radiance", self.background)?;
        if let Some(map) = &self.environment {
            check_environment(map)?;
        }
        check_materials(&self.materials, &self.images)?;
        self.images.iter().enumerate().try_for_each(|(index, image)| check_image(index, image))?;
        for (index, sphere) in self.spheres.iter().enumerate() {
            let entity = Entity::Sphere(index);
            check_vector(entity, "center", sphere.center)?;
            check_positive(entity, "radius", sphere.radius)?;
            if sphere.radius < MIN_RADIUS {
                return Err(Problem::new(entity, "radius", number(sphere.radius), "a number of at least 1e-30"));
            }
            check_material_index(entity, sphere.material, self.materials.len())?;
        }
        for (index, mesh) in self.meshes.iter().enumerate() {
            check_mesh(Entity::Mesh(index), mesh, self.materials.len())?;
        }
        for (index, light) in self.lights.iter().enumerate() {
            let entity = Entity::Light(index);
            match light {
                Light::Point { position, power } => {
                    check_vector(entity, "position", *position)?;
                    check_non_negative(entity, "power", *power)?;
                }
                Light::Spot { position, direction, intensity, inner, outer, range } => {
                    check_vector(entity, "position", *position)?;
                    check_direction(entity, *direction)?;
                    check_non_negative(entity, "intensity", *intensity)?;
                    if !(0.0..=180.0).contains(outer) {
                        return Err(Problem::new(entity, "outer", number(*outer), "an angle from 0 to 180 degrees"));
                    }
                    if !(0.0..=*outer).contains(inner) {
                        let expected = format!("an angle from 0 to outer ({} degrees)", number(*outer));
                        return Err(Problem::new(entity, "inner", number(*inner), expected));
                    }
                    if range.is_nan() || *range <= 0.0 {
                        return Err(Problem::new(entity, "range", number(*range), "a number > 0, or inf"));
                    }
                }
                Light::Directional { direction, irradiance } => {
                    check_direction(entity, *direction)?;
                    check_non_negative(entity, "irradiance", *irradiance)?;
                }
            }
        }
        Ok(())
    }

    /// Whether anything can be seen: a light, an emitting surface that is in use, or a background.
    pub fn has_light(&self) -> bool {
        let positive = |rgb: &Rgb| rgb.iter().any(|&x| x > 0.0);
        let emits = |&material: &u32| {
            let material = self.materials.get(material as usize);
            material.and_then(|material| material.surface.emitted()).is_some_and(|radiance| positive(&radiance))
        };
        self.environment
            .as_ref()
            .is_some_and(|map| map.scale > 0.0 && map.texels.as_flattened().iter().any(|&x| x > 0.0))
            || positive(&self.background)
            || self.lights.iter().any(|light| positive(&light.color()))
            || self.spheres.iter().any(|sphere| emits(&sphere.material))
            || self.meshes.iter().any(|mesh| mesh.triangle_materials.iter().any(emits))
    }
}

fn check_camera(camera: &Camera) -> Check {
    let entity = Entity::Camera;
    check_vector(entity, "position", camera.position)?;
    check_vector(entity, "target", camera.target)?;
    check_vector(entity, "up", camera.up)?;
    let Some(forward) = unit(camera.target - camera.position) else {
        return Err(Problem::new(entity, "target", vector(camera.target), "a point apart from position"));
    };
    let Some(up) = unit(camera.up) else {
        return Err(Problem::new(entity, "up", vector(camera.up), "a vector of non-zero length"));
    };
    if forward.cross(up).length() < MIN_UP_SINE {
        let expected = "a vector that is not parallel to the view (target - position)";
        return Err(Problem::new(entity, "up", vector(camera.up), expected));
    }
    if let Some(width) = camera.orthographic_width {
        check_positive(entity, "width", width)?;
    }
    if let Some(lens) = camera.lens {
        check_positive(entity, "lens_radius", lens.radius)?;
        check_positive(entity, "focus", lens.focus)?;
    }
    let fov = camera.horizontal_fov;
    if !(fov > 0.0 && fov < 180.0) {
        let expected = "an angle between 0 and 180 degrees, both excluded";
        return Err(Problem::new(entity, "horizontal_fov", number(fov), expected));
    }
    Ok(())
}

fn check_environment(map: &Environment) -> Check {
    let entity = Entity::Environment;
    if map.width == 0 || map.height == 0 || map.texels.len() != map.width as usize * map.height as usize {
        let expected = format!("{} x {}, at least 1", map.width, map.height);
        return Err(Problem::new(entity, "the number of pixels", map.texels.len(), expected));
    }
    if let Some(x) = map.texels.as_flattened().iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
        return Err(Problem::new(entity, "a pixel", x, "finite numbers >= 0"));
    }
    if !(0.0..=MAX_MAGNITUDE).contains(&map.scale) {
        return Err(Problem::new(entity, "scale", number(map.scale), "a finite number >= 0"));
    }
    match map.rotation.abs() <= MAX_MAGNITUDE {
        true => Ok(()),
        false => Err(Problem::new(entity, "rotation", number(map.rotation), "a finite number of degrees")),
    }
}

fn check_direction(entity: Entity, direction: DVec3) -> Check {
    check_vector(entity, "direction", direction)?;
    match unit(direction) {
        Some(_) => Ok(()),
        None => Err(Problem::new(entity, "direction", vector(direction), "a vector of non-zero length")),
    }
}

fn check_film(film: &Film) -> Check {
    for (field, side) in [("width", film.width), ("height", film.height)] {
        check_integer(Entity::Film, field, i64::from(side), 1, MAX_IMAGE_SIDE)?;
    }
    if let Exposure::Stops(stops) = film.exposure
        && (stops.is_nan() || stops.abs() > MAX_EXPOSURE)
    {
        return Err(Problem::new(Entity::Film, "exposure", number(stops), "a number from -64 to 64, or \"auto\""));
    }
    match film.transfer {
        Transfer::Gamma(gamma) => check_positive(Entity::Film, "gamma", gamma),
        Transfer::Srgb => Ok(()),
    }
}

fn check_integrator(integrator: &Integrator) -> Check {
    let entity = Entity::Integrator;
    check_integer(entity, "max_depth", i64::from(integrator.max_depth), 1, MAX_DEPTH)?;
    check_integer(entity, "samples", i64::from(integrator.samples), 1, MAX_SAMPLES)?;
    if let Some(depth) = integrator.russian_roulette {
        check_integer(entity, "russian_roulette", i64::from(depth), 1, u32::MAX)?;
    }
    Ok(())
}

fn check_mesh(entity: Entity, mesh: &Mesh, material_count: usize) -> Check {
    let count = mesh.positions.len();
    if let Some(index) = mesh.positions.par_iter().position_first(|&position| !in_range(position)) {
        let expected = "three finite numbers of magnitude <= 1e30, after scale, rotate and translate";
        let field = format!("vertex {}", index + 1);
        return Err(Problem::new(entity, field, vector(mesh.positions[index]), expected));
    }
    let expected_normals = if mesh.normals == Normals::Smooth { count } else { 0 };
    check_length(entity, "the number of vertex normals", mesh.vertex_normals.len(), expected_normals)?;
    if let Some(index) = mesh.vertex_normals.par_iter().position_first(|normal| !normal.is_normalized()) {
        let field = format!("vertex normal {}", index + 1);
        return Err(Problem::new(entity, field, vector(mesh.vertex_normals[index]), "a vector of length 1"));
    }
    for (what, found) in [
        ("the number of texture coordinates", mesh.uvs[0].len()),
        ("the number of second texture coordinates", mesh.uvs[1].len()),
        ("the number of tangents", mesh.tangents.len()),
        ("the number of vertex colours", mesh.colors.len()),
    ] {
        if found != 0 {
            check_length(entity, what, found, count)?;
        }
    }
    let is_finite = |x: &f32| x.is_finite();
    let attributes =
        [mesh.uvs[0].as_flattened(), mesh.uvs[1].as_flattened(), mesh.tangents.as_flattened().as_flattened()];
    if !attributes.iter().all(|numbers| numbers.par_iter().all(is_finite)) {
        return Err(Problem::new(
            entity,
            "texture coordinates or tangents",
            "a number that is not finite",
            "finite numbers",
        ));
    }
    if let Some(&x) = mesh.colors.as_flattened().iter().find(|&&x| !(x >= 0.0 && x.is_finite())) {
        return Err(Problem::new(entity, "vertex colours", x, "finite numbers >= 0"));
    }
    check_length(entity, "the number of triangle materials", mesh.triangle_materials.len(), mesh.triangles.len())?;
    if mesh.triangles.is_empty() {
        return Err(Problem::new(entity, "the number of triangles", 0, "at least 1"));
    }
    let wrong = |(index, triangle): (usize, &[u32; 3])| {
        let expected = match triangle.map(|vertex| mesh.positions.get(vertex as usize).copied()) {
            [Some(a), Some(b), Some(c)] if has_area(a, b, c) => return None,
            [Some(_), Some(_), Some(_)] => "a triangle with an area".to_owned(),
            _ => format!("indices below {count}"),
        };
        Some(Problem::new(entity, format!("triangle {}", index + 1), format!("{triangle:?}"), expected))
    };
    // The first of all that are wrong.
    if let Some(problem) = mesh.triangles.par_iter().enumerate().find_map_first(wrong) {
        return Err(problem);
    }
    mesh.triangle_materials.iter().try_for_each(|&material| check_material_index(entity, material, material_count))
}

fn check_length(entity: Entity, what: &'static str, found: usize, expected: usize) -> Check {
    if found == expected { Ok(()) } else { Err(Problem::new(entity, what, found, expected.to_string())) }
}

fn check_material_index(entity: Entity, material: u32, count: usize) -> Check {
    if (material as usize) < count {
        return Ok(());
    }
    Err(Problem::new(entity, "material", material, format!("an index below {count}")))
}
