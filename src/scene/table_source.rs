//! The text of a scene file while its tables are gone through: places of errors, files that it names.

use std::path::PathBuf;

use crate::scene::error::{Entity, Location, SceneError};
use crate::scene::locate::locate_value;
use crate::scene::materials::MaterialList;
use crate::scene::problem::Problem;
use crate::scene::read::Files;

/// The text that a scene is being built from.
pub(super) struct Source<'a> {
    pub text: &'a str,
    pub name: &'a str,
    /// Where the paths in the file start from.
    pub files: Files<'a>,
}

impl Source<'_> {
    pub fn locate(&self, entity: Entity, field: &str) -> Location {
        locate_value(self.text, self.name, entity, field)
    }

    pub fn error(&self, problem: Problem) -> SceneError {
        let at = self.locate(problem.entity, &problem.field);
        problem.at(at)
    }

    /// The file that an entity names.
    pub fn read(&self, entity: Entity, name: &str) -> Result<(PathBuf, Vec<u8>), SceneError> {
        self.files.read(name).map_err(|cause| self.cause(entity, cause))
    }

    /// What is wrong with the file of an entity.
    pub fn cause(&self, entity: Entity, cause: SceneError) -> SceneError {
        SceneError::File { at: self.locate(entity, "file"), entity, cause: Box::new(cause) }
    }
}

/// The index of a material of that name.
pub(super) fn find_material(materials: &MaterialList, entity: Entity, name: &str) -> Result<u32, Problem> {
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
