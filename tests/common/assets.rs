//! The scenes that are shipped.

use std::path::PathBuf;

/// Path of a shipped scene.
pub fn scene_path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets/scenes").join(name).with_extension("toml")
}
