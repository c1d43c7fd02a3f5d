//! Any text is either a scene that validates or an error that names the file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use photolith::Scene;

fuzz_target!(|text: &str| {
    match Scene::from_toml_str(text, "scene.toml", None) {
        Ok(loaded) => assert!(loaded.scene.validate().is_ok()),
        Err(error) => assert!(error.to_string().contains("scene.toml")),
    }
});
