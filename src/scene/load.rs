//! Loading a scene from a file or from memory.

use std::collections::HashSet;
use std::path::Path;

use crate::scene::description::Scene;
use crate::scene::error::{Entity, Location, SceneError};
use crate::scene::facing::looking_away;
use crate::scene::from_table::build;
use crate::scene::gltf;
use crate::scene::gltf::is_glb;
use crate::scene::load_options::LoadOptions;
use crate::scene::model::Model;
use crate::scene::named_camera::NamedCamera;
use crate::scene::obj;
use crate::scene::parse::parse;
use crate::scene::precision::lost;
use crate::scene::read::{Files, read_file};
use crate::scene::table_source::Source;
use crate::scene::texture_limit::limit;

/// A scene, and what its author should know about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// Passed [`Scene::validate`].
    pub scene: Scene,
    /// What was left out or replaced (each with its file and, where there is one, its line), in the order of loading.
    pub warnings: Vec<String>,
    /// The cameras of the file, the scene's first; none where the scene's fits its surfaces.
    pub cameras: Vec<NamedCamera>,
}

impl Scene {
    /// Loads a scene file (`.toml`), or a model (`.gltf`, `.glb`, `.obj`) with a camera and light that suit it.
    ///
    /// Files that the scene names are looked for from the folder of the file that names them.
    ///
    /// # Errors
    /// [`SceneError`] for the first thing that is wrong, with file, line and entity.
    pub fn load(path: &Path) -> Result<Loaded, SceneError> {
        Self::load_with(path, &LoadOptions::default())
    }

    /// The same, with what to make of it.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn load_with(path: &Path, options: &LoadOptions) -> Result<Loaded, SceneError> {
        let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
        let name = path.display().to_string();
        match extension.as_ref().and_then(|extension| extension.to_str()) {
            Some("toml") => Self::from_toml_bytes(&read_file(path)?, &name, path.parent(), options),
            Some("gltf" | "glb") => Self::from_gltf_bytes(&read_file(path)?, &name, path.parent(), options),
            Some("obj") => Self::from_obj_bytes_with(&read_file(path)?, &name, path.parent(), options),
            _ => Err(SceneError::UnknownFileType { path: path.to_owned() }),
        }
    }

    /// Loads a scene file or a mesh that is in memory, whichever it is, as [`Scene::load`] does.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn from_bytes(bytes: &[u8], source_name: &str, base_dir: Option<&Path>) -> Result<Loaded, SceneError> {
        Self::from_bytes_with(bytes, source_name, base_dir, &LoadOptions::default())
    }

    /// The same, with what to make of it.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn from_bytes_with(
        bytes: &[u8],
        source_name: &str,
        base_dir: Option<&Path>,
        options: &LoadOptions,
    ) -> Result<Loaded, SceneError> {
        if is_glb(bytes) || bytes.trim_ascii_start().starts_with(b"{") {
            return Self::from_gltf_bytes(bytes, source_name, base_dir, options);
        }
        match is_toml(bytes) {
            true => Self::from_toml_bytes(bytes, source_name, base_dir, options),
            false => Self::from_obj_bytes_with(bytes, source_name, base_dir, options),
        }
    }

    fn from_gltf_bytes(
        bytes: &[u8],
        name: &str,
        base_dir: Option<&Path>,
        options: &LoadOptions,
    ) -> Result<Loaded, SceneError> {
        let mut warnings = Vec::new();
        let model = gltf::load(bytes, name, Files::new(base_dir, options.confine), options, &mut warnings)?;
        finish_model(model, name, options, warnings)
    }

    fn from_toml_bytes(
        bytes: &[u8],
        name: &str,
        base_dir: Option<&Path>,
        options: &LoadOptions,
    ) -> Result<Loaded, SceneError> {
        let text = std::str::from_utf8(bytes).map_err(|error| {
            let valid = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
            SceneError::NotUtf8 { at: Location::of_byte(name, &valid, valid.len()) }
        })?;
        Self::from_toml_str_with(text, name, base_dir, options)
    }

    /// Loads a scene file that is in memory. `source_name` stands for it in messages; `base_dir` is where its meshes
    /// are looked for (without it, naming one is an error).
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn from_toml_str(text: &str, source_name: &str, base_dir: Option<&Path>) -> Result<Loaded, SceneError> {
        Self::from_toml_str_with(text, source_name, base_dir, &LoadOptions::default())
    }

    fn from_toml_str_with(
        text: &str,
        name: &str,
        base_dir: Option<&Path>,
        options: &LoadOptions,
    ) -> Result<Loaded, SceneError> {
        let tables = parse(text, name)?;
        let source = Source { text, name, files: Files::new(base_dir, options.confine) };
        let mut warnings = Vec::new();
        let (scene, cameras) = build(&source, tables, options, &mut warnings)?;
        scene.check_values().map_err(|problem| source.error(problem))?;
        finish(scene, cameras, options, warnings, |entity, field| source.locate(entity, field))
    }

    /// Loads an OBJ file that is in memory, as [`Scene::load`] does. `source_name` stands for it in messages;
    /// `base_dir` is where its MTL files are looked for (without it, they count as missing).
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn from_obj_bytes(bytes: &[u8], source_name: &str, base_dir: Option<&Path>) -> Result<Loaded, SceneError> {
        Self::from_obj_bytes_with(bytes, source_name, base_dir, &LoadOptions::default())
    }

    fn from_obj_bytes_with(
        bytes: &[u8],
        name: &str,
        base_dir: Option<&Path>,
        options: &LoadOptions,
    ) -> Result<Loaded, SceneError> {
        let mut warnings = Vec::new();
        let model = obj::load(bytes, name, Files::new(base_dir, options.confine), &mut warnings)?;
        finish_model(model, name, options, warnings)
    }
}

/// Whether a text is a scene file: its first line that says something is a table or a key. (Lines of OBJ begin with a keyword.)
fn is_toml(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    let mut lines = text.split(['\n', '\r']).map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#')).unwrap_or_default();
    let is_key = |(key, _): (&str, &str)| !key.trim().is_empty() && !key.trim().contains(char::is_whitespace);
    first.starts_with('[') || first.split_once('=').is_some_and(is_key)
}

/// A scene of a model alone.
fn finish_model(model: Model, name: &str, options: &LoadOptions, warnings: Vec<String>) -> Result<Loaded, SceneError> {
    let (scene, cameras) = model.into_scene(name);
    // What a camera that fits nothing is like says less.
    scene.check_not_empty()?;
    scene.validate()?;
    finish(scene, cameras, options, warnings, |_, _| Location::file(name))
}

fn finish(
    mut scene: Scene,
    cameras: Vec<NamedCamera>,
    options: &LoadOptions,
    mut warnings: Vec<String>,
    locate: impl Fn(Entity, &str) -> Location,
) -> Result<Loaded, SceneError> {
    scene.check_not_empty()?;
    let images = std::mem::take(&mut scene.images);
    scene.images = limit(&scene.source, images, &scene.materials, options.texture_limit, &mut warnings)?;
    for (entity, field, problem) in lost(&scene) {
        warnings.push(format!("{}: {entity}: {problem}", locate(entity, field)));
    }
    for (entity, name) in looking_away(&scene) {
        let at = locate(entity, "material");
        warnings.push(format!(
            "{at}: {entity}: the emitter {name:?} shines away from the camera and from all that it could light: \
             its front is the side from which vertices run counter-clockwise, or the outside of a sphere that is not inward"
        ));
    }
    if !scene.has_light() {
        let source = &scene.source;
        warnings.push(format!("{source}: no light, no emitter in use and no background: the image will be black"));
    }
    // Meshes of the same MTL file have the same to tell.
    let mut told = HashSet::new();
    warnings.retain(|warning| told.insert(warning.clone()));
    Ok(Loaded { scene, warnings, cameras })
}
