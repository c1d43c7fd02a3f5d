//! From the material names of an OBJ file to materials of the scene, by way of its MTL files.

use std::collections::HashMap;
use std::path::PathBuf;

use crate::scene::description::{Material, Surface};
use crate::scene::error::Location;
use crate::scene::materials::MaterialList;
use crate::scene::obj::material::MapImages;
use crate::scene::obj::model::Obj;
use crate::scene::obj::mtl::{MtlMaterial, parse_mtl};
use crate::scene::obj::names::{file_names, find_file, loose};
use crate::scene::obj::surface::GREY;
use crate::scene::read::{Files, no_folder, read_file};

/// Name of the surface of faces whose material is not known.
const DEFAULT_MATERIAL: &str = "default grey";

/// Reads the MTL files and adds to the scene those of their materials that are used, with their images. `used` holds an index into
/// [`Obj::material_names`] for each triangle, and the result one into the scene's materials.
pub(super) fn resolve_materials(
    obj: &Obj,
    used: impl Iterator<Item = Option<u32>>,
    file: &str,
    files: Files<'_>,
    materials: &mut MaterialList,
    warnings: &mut Vec<String>,
) -> Vec<u32> {
    let mut libraries = Libraries::default();
    for (library, line) in &obj.libraries {
        libraries.read(library, &Location::line(file, *line), files, warnings);
    }
    // In order of use.
    let used: Vec<_> = used.collect();
    let mut names: Vec<Option<u32>> = Vec::new();
    let mut number_of = HashMap::new();
    for &name in &used {
        number_of.entry(name).or_insert_with(|| {
            names.push(name);
            names.len() - 1
        });
    }
    let name_of = |name: Option<u32>| name.map(|index| &obj.material_names[index as usize]);
    let found = |name| libraries.find(&name_of(name)?.0);
    let mut images = MapImages::new(files);
    images.read_all(names.iter().filter_map(|&name| found(name)).map(|m| (&m.material, m.file.as_path())), materials);
    let mut resolve = |name: Option<u32>| {
        if let Some(LibraryMaterial { material, file }) = found(name) {
            let place = Location::line(file.display().to_string(), material.line);
            let mut warn = |text: &str| warnings.push(format!("{place}: material {:?}: {text}", material.name));
            let mut becomes = material.material(&images, file, materials, &mut warn);
            if let Some((name, _)) = name_of(name) {
                becomes.name.clone_from(name);
            }
            return materials.add(becomes);
        }
        if let Some((name, line)) = name_of(name) {
            let at = Location::line(file, *line);
            warnings.push(format!("{at}: the material {name:?} is in no MTL file, {DEFAULT_MATERIAL} is used"));
        }
        materials.add(Material::new(DEFAULT_MATERIAL, Surface::diffuse(GREY)))
    };
    let resolved: Vec<u32> = names.iter().map(|&name| resolve(name)).collect();
    used.iter().map(|name| resolved[number_of[name]]).collect()
}

struct LibraryMaterial {
    material: MtlMaterial,
    /// That it is in.
    file: PathBuf,
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
    fn read(&mut self, library: &str, at: &Location, files: Files<'_>, warnings: &mut Vec<String>) {
        if library.is_empty() {
            warnings.push(format!("{at}: \"mtllib\" has no file name, {DEFAULT_MATERIAL} is used for its materials"));
            return;
        }
        if files.base_dir.is_none() {
            let error = no_folder(library);
            warnings.push(format!("{at}: {error}, {DEFAULT_MATERIAL} is used for its materials"));
            return;
        }
        for (name, path) in files_of(library, files) {
            let bytes = match &path {
                Some(path) => read_file(path).map(|bytes| (path.clone(), bytes)),
                None => files.read(&name),
            };
            match bytes {
                Ok((path, bytes)) => self.add(path, &bytes, warnings),
                Err(error) => warnings.push(format!("{at}: {error}, {DEFAULT_MATERIAL} is used for its materials")),
            }
        }
    }

    fn add(&mut self, file: PathBuf, bytes: &[u8], warnings: &mut Vec<String>) {
        let (materials, of_file) = parse_mtl(bytes, &file.display().to_string());
        warnings.extend(of_file);
        for material in materials {
            let index = self.materials.len();
            let is_new = self.by_name.insert(material.name.clone(), index).is_none();
            // Another name that is loosely the same leaves none of them; the same name once more is the last one.
            let loosely = self.loosely.entry(loose(&material.name)).or_insert(Some(index));
            *loosely = loosely.filter(|&known| !is_new || known == index).map(|_| index);
            self.materials.push(LibraryMaterial { material, file: file.clone() });
        }
    }
}

/// The files that a `mtllib` means: those that are found, and as they are written those that are not.
fn files_of(library: &str, files: Files<'_>) -> Vec<(String, Option<PathBuf>)> {
    let names = file_names(library);
    let are_all_libraries = names.iter().all(|name| name.to_lowercase().ends_with(".mtl"));
    let is_one = names.len() < 2 || !are_all_libraries;
    let literal =
        files.base_dir.map(|folder| folder.join(library)).filter(|path| path.is_file() && files.may_read(path));
    if let Some(file) = literal.or_else(|| find_file(files, library).filter(|_| is_one)) {
        return vec![(library.to_owned(), Some(file))];
    }
    match names.len() {
        0 | 1 => vec![(library.to_owned(), None)],
        _ => names.into_iter().map(|name| (name.clone(), find_file(files, &name))).collect(),
    }
}
