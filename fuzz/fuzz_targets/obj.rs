//! Any bytes are either a mesh that validates or an error that names the file; what follows a zero byte is an MTL file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use photolith::Scene;
use photolith::scene::obj::parse_mtl;

fuzz_target!(|bytes: &[u8]| {
    let mut files = bytes.splitn(2, |&byte| byte == 0);
    let (obj, mtl) = (files.next().unwrap_or_default(), files.next().unwrap_or_default());
    match Scene::from_obj_bytes(obj, "a.obj", None) {
        Ok(loaded) => assert!(loaded.scene.validate().is_ok()),
        Err(error) => assert!(error.to_string().contains("a.obj")),
    }
    for material in parse_mtl(mtl, "a.mtl").0 {
        material.surface(|_| {});
    }
});
