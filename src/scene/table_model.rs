//! `[[mesh]]`, `[[model]]` and `[[instance]]`: files become meshes, and meshes copies of themselves.

use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};

use crate::host::available_memory;
use crate::scene::description::*;
use crate::scene::error::{Entity, SceneError};
use crate::scene::format::*;
use crate::scene::gltf;
use crate::scene::limits::MAX_MAGNITUDE;
use crate::scene::load_options::LoadOptions;
use crate::scene::materials::MaterialList;
use crate::scene::model::Model;
use crate::scene::named_camera::NamedCamera;
use crate::scene::obj::{self, MaterialSource, MeshRequest, NormalsChoice, VertexColors};
use crate::scene::placed::{bytes_of_copy, placed_camera, placed_light, placed_mesh};
use crate::scene::problem::{Problem, check_positive, check_vector, number};
use crate::scene::table_source::{Source, find_material};
use crate::scene::transform::Placement;

/// What tables of meshes, models and copies add to a scene.
#[derive(Default)]
pub(super) struct Content {
    pub meshes: Vec<Mesh>,
    pub lights: Vec<Light>,
    pub cameras: Vec<NamedCamera>,
    /// What can be copied, by name: ranges of `meshes` and `lights`.
    by_name: HashMap<String, (Range<usize>, Range<usize>)>,
}

impl Content {
    /// Reads one after the other.
    pub fn read(
        source: &Source<'_>,
        tables: &SceneTable,
        options: &LoadOptions,
        materials: &mut MaterialList,
        warnings: &mut Vec<String>,
    ) -> Result<Self, SceneError> {
        let mut content = Self::default();
        for (index, table) in tables.mesh.iter().enumerate() {
            let entity = Entity::Mesh(index);
            let from = content.sizes();
            content.meshes.push(read_mesh(source, entity, table, materials, warnings)?);
            content.name(entity, table.name.as_deref(), from).map_err(|problem| source.error(problem))?;
        }
        for (index, table) in tables.model.iter().enumerate() {
            let entity = Entity::Model(index);
            let from = content.sizes();
            content.add_model(source, entity, table, options, materials, warnings)?;
            content.name(entity, table.name.as_deref(), from).map_err(|problem| source.error(problem))?;
        }
        for (index, table) in tables.instance.iter().enumerate() {
            let entity = Entity::Instance(index);
            content.copy(entity, table).map_err(|problem| source.error(problem))?;
        }
        Ok(content)
    }

    fn sizes(&self) -> (usize, usize) {
        (self.meshes.len(), self.lights.len())
    }

    fn name(&mut self, entity: Entity, name: Option<&str>, from: (usize, usize)) -> Result<(), Problem> {
        let Some(name) = name else { return Ok(()) };
        let added = (from.0..self.meshes.len(), from.1..self.lights.len());
        match self.by_name.insert(name.to_owned(), added) {
            None => Ok(()),
            Some(_) => {
                Err(Problem::new(entity, "name", format!("{name:?}"), "a name that no earlier mesh or model has"))
            }
        }
    }

    fn add_model(
        &mut self,
        source: &Source<'_>,
        entity: Entity,
        table: &ModelTable,
        options: &LoadOptions,
        materials: &mut MaterialList,
        warnings: &mut Vec<String>,
    ) -> Result<(), SceneError> {
        let given = table.material.as_deref().map(|name| find_material(materials, entity, name)).transpose();
        let given = given.map_err(|problem| source.error(problem))?;
        let to_scene = to_scene(entity, table.place()).map_err(|problem| source.error(problem))?;
        let (path, bytes) = source.read(entity, &table.file)?;
        let (name, files) = (path.display().to_string(), source.files.of(&path));
        let extension = Path::new(&table.file).extension().map(|extension| extension.to_ascii_lowercase());
        let model = match extension.as_ref().and_then(|extension| extension.to_str()) {
            Some("gltf" | "glb") => {
                let options = LoadOptions { time: table.time, variant: table.variant.clone(), ..options.clone() };
                gltf::load(&bytes, &name, files, &options, warnings)
            }
            Some("obj") => {
                let only_gltf = [("variant", table.variant.is_some()), ("time", table.time.is_some())];
                if let Some((field, _)) = only_gltf.into_iter().find(|(_, is_there)| *is_there) {
                    return Err(source.error(Problem::new(entity, field, "given", "none for an OBJ file")));
                }
                obj::load(&bytes, &name, files, warnings)
            }
            _ => {
                let expected = "a file whose name ends in .gltf, .glb or .obj";
                return Err(source.error(Problem::new(entity, "file", format!("{:?}", table.file), expected)));
            }
        };
        let model = model.map_err(|cause| source.cause(entity, cause))?;
        let Model { materials: of_model, images, meshes, lights, cameras } = model;
        let first_image: Vec<u32> = images
            .into_iter()
            .map(|mut image| {
                if !image.name.starts_with(&name) {
                    image.name = format!("{name}: {}", image.name);
                }
                materials.add_image(image)
            })
            .collect();
        let numbers: Vec<u32> = of_model
            .into_iter()
            .map(|mut material| {
                for texture in material.textures.values_mut() {
                    texture.image = first_image[texture.image as usize];
                }
                given.unwrap_or_else(|| materials.add(material))
            })
            .collect();
        let (first, has_meshes) = (self.meshes.len(), !meshes.is_empty());
        for mesh in meshes {
            let mut mesh = placed_mesh(&mesh, &to_scene);
            mesh.triangle_materials.iter_mut().for_each(|material| *material = numbers[*material as usize]);
            self.push(entity, mesh).map_err(|problem| source.error(problem))?;
        }
        if has_meshes && self.meshes.len() == first {
            let field = if table.matrix.is_some() { "matrix" } else { "scale" };
            return Err(source.error(Problem::new(
                entity,
                field,
                "one that leaves no triangle an area",
                "a larger one",
            )));
        }
        if table.lights {
            self.lights.extend(lights.iter().map(|light| placed_light(light, &to_scene)));
        }
        let camera = |named: NamedCamera| NamedCamera { camera: placed_camera(&named.camera, &to_scene), ..named };
        self.cameras.extend(cameras.into_iter().map(camera));
        Ok(())
    }

    /// Adds a mesh, unless nothing is left of it.
    fn push(&mut self, entity: Entity, mesh: Mesh) -> Result<(), Problem> {
        let is_beyond = |p: &&DVec3| p.to_array().iter().any(|x| x.is_nan() || x.abs() > MAX_MAGNITUDE);
        if let Some(position) = mesh.positions.iter().find(is_beyond) {
            let [x, y, z] = position.to_array().map(number);
            let expected = "three finite numbers of magnitude <= 1e30, after scale, rotate and translate";
            return Err(Problem::new(entity, "a vertex", format!("[{x}, {y}, {z}]"), expected));
        }
        if !mesh.triangles.is_empty() {
            self.meshes.push(mesh);
        }
        Ok(())
    }

    /// Adds a copy of what has that name.
    fn copy(&mut self, entity: Entity, table: &InstanceTable) -> Result<(), Problem> {
        let Some((meshes, lights)) = self.by_name.get(&table.of).cloned() else {
            let mut names: Vec<_> = self.by_name.keys().map(|name| format!("{name:?}")).collect();
            names.sort();
            let expected = match names.is_empty() {
                true => "the name of a [[mesh]] or [[model]], of which none has a name".to_owned(),
                false => format!("the name of a [[mesh]] or [[model]]: {}", names.join(", ")),
            };
            return Err(Problem::new(entity, "of", format!("{:?}", table.of), expected));
        };
        let to_scene = to_scene(entity, table.place())?;
        let bytes: u64 = self.meshes[meshes.clone()].iter().map(bytes_of_copy).sum();
        if let Some(available) = available_memory().filter(|&available| bytes > available) {
            let found = format!("{:?}, a copy of {} MB", table.of, bytes >> 20);
            return Err(Problem::new(
                entity,
                "of",
                found,
                format!("at most the {} MB of memory that are left", available >> 20),
            ));
        }
        for index in meshes {
            let mesh = placed_mesh(&self.meshes[index], &to_scene);
            self.push(entity, mesh)?;
        }
        let lights: Vec<Light> = self.lights[lights].iter().map(|light| placed_light(light, &to_scene)).collect();
        self.lights.extend(lights);
        Ok(())
    }
}

/// What a table says of where something is.
struct Place {
    scale: Option<Numbers<3>>,
    rotate: Option<Triple>,
    translate: Option<Triple>,
    matrix: Option<Rows>,
}

impl ModelTable {
    fn place(&self) -> Place {
        Place { scale: self.scale, rotate: self.rotate, translate: self.translate, matrix: self.matrix }
    }
}

impl InstanceTable {
    fn place(&self) -> Place {
        Place { scale: self.scale, rotate: self.rotate, translate: self.translate, matrix: self.matrix }
    }
}

/// The map that a table says: scale, then rotate, then translate, or a matrix.
fn to_scene(entity: Entity, place: Place) -> Result<DAffine3, Problem> {
    let affine = match place.matrix {
        Some(Rows(rows)) => {
            let others = [
                ("translate", place.translate.is_some()),
                ("rotate", place.rotate.is_some()),
                ("scale", place.scale.is_some()),
            ];
            if let Some((field, _)) = others.into_iter().find(|(_, is_there)| *is_there) {
                return Err(Problem::new(entity, field, "given", "none beside matrix"));
            }
            let column = |i: usize| DVec3::new(rows[0][i], rows[1][i], rows[2][i]);
            DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
        }
        None => {
            let rotate = DVec3::from(place.rotate.unwrap_or_default().0);
            let translate = DVec3::from(place.translate.unwrap_or_default().0);
            let scale = DVec3::from(place.scale.map_or([1.0; 3], |scale| scale.0));
            check_vector(entity, "rotate", rotate)?;
            check_vector(entity, "translate", translate)?;
            check_vector(entity, "scale", scale)?;
            let rotation = Placement { rotate, ..Placement::default() }.rotation();
            DAffine3 { matrix3: rotation * DMat3::from_diagonal(scale), translation: translate }
        }
    };
    let field = if place.matrix.is_some() { "matrix" } else { "scale" };
    let determinant = affine.matrix3.determinant();
    if !affine.is_finite() || determinant == 0.0 || !determinant.is_finite() {
        return Err(Problem::new(
            entity,
            field,
            format!("of determinant {}", number(determinant)),
            "one that keeps volumes above 0",
        ));
    }
    Ok(affine)
}

fn read_mesh(
    source: &Source<'_>,
    entity: Entity,
    table: &MeshTable,
    materials: &mut MaterialList,
    warnings: &mut Vec<String>,
) -> Result<Mesh, SceneError> {
    let request = mesh_request(entity, table, materials).map_err(|problem| source.error(problem))?;
    let (path, bytes) = source.read(entity, &table.file)?;
    let mesh = request.build(&bytes, &path.display().to_string(), source.files.of(&path), materials, warnings);
    mesh.map_err(|cause| source.cause(entity, cause))
}

fn mesh_request(entity: Entity, table: &MeshTable, materials: &MaterialList) -> Result<MeshRequest, Problem> {
    let is_obj = Path::new(&table.file).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    if !is_obj {
        let expected = "a file whose name ends in .obj (a glTF file is a [[model]])";
        return Err(Problem::new(entity, "file", format!("{:?}", table.file), expected));
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
        colors: match table.vertex_colors {
            VertexColorsName::Srgb => VertexColors::Srgb,
            VertexColorsName::Linear => VertexColors::Linear,
        },
    })
}
