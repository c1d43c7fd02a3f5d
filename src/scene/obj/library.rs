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

/// Reads the MTL files and adds to the scene those of their materials that are used. `used` holds an index into
/// [`Obj::material_names`] for each triangle, and the result one into the scene's materials.
pub(super) fn resolve_materials(
    obj: &Obj,
    used: impl Iterator<Item = Option<u32>>,
    file: &str,
    base_dir: Option<&Path>,
    materials: &mut MaterialList,
    warnings: &mut Vec<String>,
) -> Result<Vec<u32>, SceneError> {
    let mut surfaces = HashMap::new();
    for (library, line) in &obj.libraries {
        let at = Location::line(file, *line);
        read_library(library, &at, base_dir, &mut surfaces, warnings)?;
    }
    let mut resolve = |name: Option<u32>| {
        if let Some((name, line)) = name.map(|index| &obj.material_names[index as usize]) {
            if let Some(LibraryMaterial { surface, warnings: of_material }) = surfaces.get(name) {
                warnings.extend_from_slice(of_material);
                return materials.add(name, surface);
            }
            let at = Location::line(file, *line);
            warnings.push(format!("{at}: the material {name:?} is in no MTL file, {DEFAULT_MATERIAL} is used"));
        }
        materials.add(DEFAULT_MATERIAL, &Surface::diffuse(GREY))
    };
    let mut resolved = HashMap::new();
    Ok(used.map(|name| *resolved.entry(name).or_insert_with(|| resolve(name))).collect())
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
    if library.is_empty() {
        warnings.push(format!("{at}: \"mtllib\" has no file name, {DEFAULT_MATERIAL} is used for its materials"));
        return Ok(());
    }
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
