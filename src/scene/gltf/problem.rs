//! What is wrong with a part of a glTF file.

use crate::scene::error::SceneError;

/// An error that names the file, the part of it, what was found and what was expected.
pub(super) fn problem(name: &str, at: impl ToString, found: impl ToString, expected: impl ToString) -> SceneError {
    SceneError::Model {
        file: name.to_owned(),
        at: at.to_string(),
        found: found.to_string(),
        expected: expected.to_string(),
    }
}
