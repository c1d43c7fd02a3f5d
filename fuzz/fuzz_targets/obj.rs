//! Any bytes are either a mesh that validates or an error that names the file; what follows a zero byte is an MTL file, and what follows
//! another one an image `a.png`.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use photolith::Scene;

static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a folder"));

fuzz_target!(|bytes: &[u8]| {
    let mut files = bytes.splitn(3, |&byte| byte == 0);
    let mut next = || files.next().unwrap_or_default();
    let (obj, mtl, image) = (next(), next(), next());
    std::fs::write(FOLDER.path().join("a.mtl"), mtl).expect("writable");
    std::fs::write(FOLDER.path().join("a.png"), image).expect("writable");
    match Scene::from_obj_bytes(&[b"mtllib a.mtl\n", obj].concat(), "a.obj", Some(FOLDER.path())) {
        Ok(loaded) => assert!(loaded.scene.validate().is_ok()),
        Err(error) => assert!(error.to_string().contains("a.obj")),
    }
});
