//! What can be wrong with a scene, said so that a person finds the place.

use std::borrow::Cow;
use std::fmt;
use std::io;
use std::path::PathBuf;

/// A place in an input file, shown as `file`, `file:line` or `file:line:column`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    /// The file as it was named by whoever asked for it.
    pub file: String,
    /// Counted from 1; `None` if the scene was not read from text, or the matter has no line of its own.
    pub line: Option<u32>,
    /// Counted from 1, in characters.
    pub column: Option<u32>,
}

impl Location {
    /// The whole file.
    pub fn file(file: impl Into<String>) -> Self {
        Self { file: file.into(), line: None, column: None }
    }

    /// A line of the file, counted from 1.
    pub fn line(file: impl Into<String>, line: u32) -> Self {
        Self { file: file.into(), line: Some(line), column: None }
    }

    /// The place of a byte offset in `text`; offsets past the end mean the end.
    pub fn of_byte(file: impl Into<String>, text: &str, offset: usize) -> Self {
        let before = &text.as_bytes()[..offset.min(text.len())];
        let line_start = before.iter().rposition(|&b| b == b'\n').map_or(0, |newline| newline + 1);
        let line = before.iter().filter(|&&b| b == b'\n').count() + 1;
        // Continuation bytes of UTF-8 do not start a character.
        let column = before[line_start..].iter().filter(|&&b| b & 0xc0 != 0x80).count() + 1;
        Self { file: file.into(), line: u32::try_from(line).ok(), column: u32::try_from(column).ok() }
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(column) = self.column {
            write!(f, ":{column}")?;
        }
        Ok(())
    }
}

/// A part of a scene. Indices count from 0 here and from 1 when displayed (`sphere 3` is the third `[[sphere]]`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Entity {
    /// The scene as a whole.
    Scene,
    /// The camera.
    Camera,
    /// The film.
    Film,
    /// The integrator.
    Integrator,
    /// The background.
    Background,
    /// An element of [`Scene::materials`](crate::Scene::materials).
    Material(usize),
    /// The environment.
    Environment,
    /// An element of [`Scene::images`](crate::Scene::images).
    Image(usize),
    /// A texture of a scene file.
    Texture(usize),
    /// An element of [`Scene::spheres`](crate::Scene::spheres).
    Sphere(usize),
    /// An element of [`Scene::meshes`](crate::Scene::meshes).
    Mesh(usize),
    /// A model of a scene file.
    Model(usize),
    /// A copy in a scene file.
    Instance(usize),
    /// An element of [`Scene::lights`](crate::Scene::lights).
    Light(usize),
}

impl Entity {
    /// The key of the entity's table in a scene file, and its index if there can be several.
    pub(super) fn key(self) -> (&'static str, Option<usize>) {
        match self {
            Self::Scene => ("scene", None),
            Self::Camera => ("camera", None),
            Self::Film => ("film", None),
            Self::Integrator => ("integrator", None),
            Self::Environment => ("environment", None),
            Self::Background => ("background", None),
            Self::Material(index) => ("material", Some(index)),
            Self::Image(index) => ("image", Some(index)),
            Self::Texture(index) => ("texture", Some(index)),
            Self::Sphere(index) => ("sphere", Some(index)),
            Self::Mesh(index) => ("mesh", Some(index)),
            Self::Model(index) => ("model", Some(index)),
            Self::Instance(index) => ("instance", Some(index)),
            Self::Light(index) => ("light", Some(index)),
        }
    }
}

impl fmt::Display for Entity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.key() {
            (name, None) => f.write_str(name),
            (name, Some(index)) => write!(f, "{name} {}", index + 1),
        }
    }
}

/// Why a scene cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file is missing, unreadable, or not a regular file.
    #[error("{}: cannot be read: {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        reason: io::Error,
    },

    /// The extension says neither scene file nor mesh.
    #[error("{}: unknown type of file, expected a name that ends in .toml (scene), .gltf, .glb or .obj (model)", path.display())]
    UnknownFileType {
        /// The file.
        path: PathBuf,
    },

    /// A scene file is not text.
    #[error("{at}: not UTF-8 text, expected a scene file in TOML")]
    NotUtf8 {
        /// The first bad byte.
        at: Location,
    },

    /// Not TOML, an unknown key, a missing key, or a value of the wrong type.
    #[error("{at}: {context}{message}")]
    Format {
        /// Where.
        at: Location,
        /// The entity and key, each followed by a colon and a space; may be empty.
        context: String,
        /// What was found and what was expected.
        message: String,
    },

    /// The scene file is of a version that this program does not know.
    #[error("{at}: version is {found}, expected {expected}", expected = crate::scene::format::VERSION)]
    Version {
        /// Where.
        at: Location,
        /// What is there instead.
        found: String,
    },

    /// A value has the right type but makes no sense.
    #[error("{at}: {entity}: {field} is {found}, expected {expected}")]
    Value {
        /// Where; without a line for a scene that was built in code.
        at: Location,
        /// Whose value.
        entity: Entity,
        /// Which value.
        field: Cow<'static, str>,
        /// What it is.
        found: Box<str>,
        /// What it may be.
        expected: Cow<'static, str>,
    },

    /// A file that a scene file names cannot be loaded.
    #[error("{at}: {entity}: {cause}")]
    File {
        /// Where the scene file names it.
        at: Location,
        /// Whose file it is.
        entity: Entity,
        /// What is wrong with it.
        cause: Box<SceneError>,
    },

    /// A part of a glTF file is wrong.
    #[error("{file}: {at}: {found}, expected {expected}")]
    Model {
        /// The file.
        file: String,
        /// Which part of it.
        at: String,
        /// What is there.
        found: String,
        /// What should be.
        expected: String,
    },

    /// A line of an OBJ or MTL file is wrong.
    #[error("{at}: {found}, expected {expected}")]
    Statement {
        /// The line.
        at: Location,
        /// What is there.
        found: String,
        /// What should be.
        expected: Cow<'static, str>,
    },

    /// A mesh has nothing to render.
    #[error(
        "{file}: empty mesh: {faces} faces, {degenerate} of them without area{placed}, expected at least one face with an area"
    )]
    EmptyMesh {
        /// The mesh's file.
        file: String,
        /// Faces in the file.
        faces: usize,
        /// Faces that have no area.
        degenerate: usize,
        /// What may have taken it from them.
        placed: &'static str,
    },

    /// Nothing to render.
    #[error("{file}: empty scene: no sphere and no mesh, expected at least one")]
    EmptyScene {
        /// Where the scene came from.
        file: String,
    },
}
