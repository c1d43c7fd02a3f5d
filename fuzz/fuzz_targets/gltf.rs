//! Any bytes are either a scene that validates or an error that names the file: of a `.glb`, or of the JSON of a `.gltf`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use photolith::Scene;

fuzz_target!(|bytes: &[u8]| {
    if !bytes.starts_with(b"glTF") && !bytes.trim_ascii_start().starts_with(b"{") {
        return;
    }
    match Scene::from_bytes(bytes, "a.glb", None) {
        Ok(loaded) => assert!(loaded.scene.validate().is_ok()),
        Err(error) => assert!(error.to_string().contains("a.glb")),
    }
});
