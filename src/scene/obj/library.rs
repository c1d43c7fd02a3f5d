//! From the material names of an OBJ file to materials of the scene, by way of its MTL files.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::scene::description::Surface;
use crate::scene::error::Location;
use crate::scene::materials::MaterialList;
use crate::scene::obj::model::Obj;
use crate::scene::obj::mtl::{GREY, parse_mtl};
use crate::scene::obj::names::{file_names, find_file, loose};
use crate::scene::read::{no_folder, read_file};

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
) -> Vec<u32> {
    let mut libraries = Libraries::default();
    for (library, line) in &obj.libraries {
        libraries.read(library, &Location::line(file, *line), base_dir, warnings);
    }
    let mut resolve = |name: Option<u32>| {
        if let Some((name, line)) = name.map(|index| &obj.material_names[index as usize]) {
            if let Some(LibraryMaterial { surface, warnings: of_material }) = libraries.find(name) {
                warnings.extend_from_slice(of_material);
                return materials.add(name, surface);
            }
            let at = Location::line(file, *line);
            warnings.push(format!("{at}: the material {name:?} is in no MTL file, {DEFAULT_MATERIAL} is used"));
        }
        materials.add(DEFAULT_MATERIAL, &Surface::diffuse(GREY))
    };
    let mut resolved = HashMap::new();
    used.map(|name| *resolved.entry(name).or_insert_with(|| resolve(name))).collect()
}

struct LibraryMaterial {
    surface: Surface,
    /// Given only if the material is used.
    warnings: Vec<String>,
}

/// The materials of all MTL files.
#[derive(Default)]
struct Libraries {
    materials: Vec<LibraryMaterial>,
    by_name: HashMap<String, usize>,
    /// By [`loose`] names; `None` where there are several of one.
    loosely: HashMap<String, Option<usize>>,
}

impl Libraries {
    /// The material of exactly this name, else the only one of a name that differs in quotation marks, case or a comment.
    fn find(&self, name: &str) -> Option<&LibraryMaterial> {
        let index = self.by_name.get(name).copied().or_else(|| *self.loosely.get(&loose(name))?)?;
        self.materials.get(index)
    }

    /// Reads what one `mtllib` names: a file with spaces in its name or, if there is none, several files. Of materials of
    /// the same name the last counts. A missing file is a warning: the mesh can be rendered without.
    fn read(&mut self, library: &str, at: &Location, base_dir: Option<&Path>, warnings: &mut Vec<String>) {
        if library.is_empty() {
            warnings.push(format!("{at}: \"mtllib\" has no file name, {DEFAULT_MATERIAL} is used for its materials"));
            return;
        }
        let Some(folder) = base_dir else {
            let error = no_folder(library);
            warnings.push(format!("{at}: {error}, {DEFAULT_MATERIAL} is used for its materials"));
            return;
        };
        for path in files_of(library, folder) {
            match read_file(&path) {
                Ok(bytes) => self.add(&path.display().to_string(), &bytes, warnings),
                Err(error) => warnings.push(format!("{at}: {error}, {DEFAULT_MATERIAL} is used for its materials")),
            }
        }
    }

    fn add(&mut self, path: &str, bytes: &[u8], warnings: &mut Vec<String>) {
        let (materials, of_file) = parse_mtl(bytes, path);
        warnings.extend(of_file);
        for material in materials {
            let place = Location::line(path, material.line);
            let mut warnings = Vec::new();
            let surface =
                material.surface(|text| warnings.push(format!("{place}: material {:?}: {text}", material.name)));
            let index = self.materials.len();
            self.materials.push(LibraryMaterial { surface, warnings });
            let is_new = self.by_name.insert(material.name.clone(), index).is_none();
            // Another name that is loosely the same leaves none of them; the same name once more is the last one.
            let loosely = self.loosely.entry(loose(&material.name)).or_insert(Some(index));
            *loosely = loosely.filter(|&known| !is_new || known == index).map(|_| index);
        }
    }
}

/// The files that a `mtllib` means: those that are found, and as they are written those that are not.
fn files_of(library: &str, folder: &Path) -> Vec<PathBuf> {
    let literal = folder.join(library);
    if literal.is_file() {
        return vec![literal];
    }
    let names = file_names(library);
    let are_all_libraries = names.iter().all(|name| name.to_lowercase().ends_with(".mtl"));
    if (names.len() < 2 || !are_all_libraries)
        && let Some(file) = find_file(folder, library)
    {
        return vec![file];
    }
    match names.len() {
        0 | 1 => vec![literal],
        _ => names.iter().map(|name| find_file(folder, name).unwrap_or_else(|| folder.join(name))).collect(),
    }
}
