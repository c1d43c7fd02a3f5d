//! From the material names of an OBJ file to materials of the scene, by way of its MTL files.

use std::collections::HashMap;
use std::path::Path;

use super::mtl::{GREY, parse_mtl};
use super::parse::Obj;
use crate::scene::description::Surface;
use crate::scene::error::{Location, SceneError};
use crate::scene::materials::MaterialList;
use crate::scene::read::read_relative;

/// Name of the surface of faces whose material is not known.
const DEFAULT_MATERIAL: &str = "default grey";

/// Indices of scene materials.
pub(super) struct MaterialOfName {
    /// By index into [`Obj::material_names`]; 0 where no triangle uses the name.
    named: Vec<u32>,
    /// Of faces without a name, and of all faces if `named` is empty.
    unnamed: u32,
}

impl MaterialOfName {
    /// The same for all faces.
    pub fn all(material: u32) -> Self {
        Self { named: Vec::new(), unnamed: material }
    }

    pub fn get(&self, name: Option<u32>) -> u32 {
        name.and_then(|name| self.named.get(name as usize).copied()).unwrap_or(self.unnamed)
    }
}

/// Reads the MTL files and adds to the scene those of their materials that a triangle uses.
pub(super) fn resolve_materials(
    obj: &Obj,
    used: impl Iterator<Item = Option<u32>>,
    file: &str,
    base_dir: Option<&Path>,
    materials: &mut MaterialList,
    warnings: &mut Vec<String>,
) -> Result<MaterialOfName, SceneError> {
    let mut surfaces = HashMap::new();
    for (library, line) in &obj.libraries {
        let at = Location::line(file, *line);
        read_library(library, &at, base_dir, &mut surfaces, warnings)?;
    }
    let mut is_used = vec![false; obj.material_names.len()];
    let mut is_unnamed_used = false;
    for name in used {
        match name {
            Some(name) => is_used[name as usize] = true,
            None => is_unnamed_used = true,
        }
    }
    let grey = Surface::Diffuse { reflectance: GREY };
    let mut of_name = MaterialOfName { named: vec![0; is_used.len()], unnamed: 0 };
    for (index, (name, line)) in obj.material_names.iter().enumerate().filter(|&(index, _)| is_used[index]) {
        of_name.named[index] = match surfaces.get(name) {
            Some(LibraryMaterial { surface, warnings: of_material }) => {
                warnings.extend_from_slice(of_material);
                materials.add(name, surface)
            }
            None => {
                let at = Location::line(file, *line);
                warnings.push(format!("{at}: the material {name:?} is in no MTL file, {DEFAULT_MATERIAL} is used"));
                materials.add(DEFAULT_MATERIAL, &grey)
            }
        };
    }
    if is_unnamed_used {
        of_name.unnamed = materials.add(DEFAULT_MATERIAL, &grey);
    }
    Ok(of_name)
}

struct LibraryMaterial {
    surface: Surface,
    /// Given only if the material is used.
    warnings: Vec<String>,
}

/// Reads what one `mtllib` names: a file with spaces in its name or, if there is none, several files. Of materials of
/// the same name the last counts. A missing file is a warning: the mesh can be rendered without.
fn read_library(
    library: &str,
    at: &Location,
    base_dir: Option<&Path>,
    surfaces: &mut HashMap<String, LibraryMaterial>,
    warnings: &mut Vec<String>,
) -> Result<(), SceneError> {
    let portable = library.replace('\\', "/");
    let files = match read_relative(base_dir, &portable) {
        Ok(file) => vec![Ok(file)],
        Err(error) => {
            let names: Vec<_> = portable.split_whitespace().collect();
            if names.len() > 1 {
                names.into_iter().map(|name| read_relative(base_dir, name)).collect()
            } else {
                vec![Err(error)]
            }
        }
    };
    for file in files {
        match file {
            Ok((path, bytes)) => {
                let path = path.display().to_string();
                for material in parse_mtl(&bytes, &path)? {
                    let place = Location::line(&path, material.line);
                    let mut warnings = Vec::new();
                    let surface = material
                        .surface(|text| warnings.push(format!("{place}: material {:?}: {text}", material.name)));
                    surfaces.insert(material.name, LibraryMaterial { surface, warnings });
                }
            }
            Err(error) => warnings.push(format!("{at}: {error}, {DEFAULT_MATERIAL} is used for its materials")),
        }
    }
    Ok(())
}
