//! glTF: files that are broken, or made to do harm, are refused in words.

use photolith::Scene;
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::glb::{add, glb, load, triangle};

/// The message for a file that was changed.
fn refused(change: impl FnOnce(&mut Value)) -> String {
    let (mut json, binary) = triangle();
    change(&mut json);
    load(&json, &binary).expect_err("refused").to_string()
}

#[test]
fn messages_name_the_part() {
    let cases: [(&str, Value, &str); 8] = [
        ("/accessors/0/count", json!(4_000_000_000u64), "mesh 0, primitive 0, POSITION, accessor 0"),
        ("/accessors/0/bufferView", json!(7), "bufferView 7"),
        ("/bufferViews/0/byteLength", json!(1_000_000), "bufferView 0"),
        ("/buffers/0/byteLength", json!(1_000_000), "buffer 0"),
        ("/nodes/0/mesh", json!(3), "mesh 3"),
        ("/scenes/0/nodes", json!([0, 0]), "node 0"),
        ("/scenes/0/nodes", json!([9]), "node 9"),
        ("/asset/version", json!("3.0"), "version"),
    ];
    for (pointer, value, part) in cases {
        let message = refused(|json| *json.pointer_mut(pointer).unwrap() = value);
        assert!(message.starts_with("test.glb: ") && message.contains(part), "{pointer}: {message}");
    }
}

#[test]
fn a_node_below_itself_is_refused() {
    let message = refused(|json| json["nodes"][0]["children"] = json!([0]));
    assert!(message.contains("node 0"), "{message}");
}

#[test]
fn zeros_without_a_view_are_not_many() {
    let message = refused(|json| {
        json["accessors"][0] = json!({"componentType": 5126, "count": 1u64 << 40, "type": "VEC3"});
    });
    assert!(message.contains("without a bufferView"), "{message}");
}

#[test]
fn copies_are_not_many() {
    let message = refused(|json| {
        let zeros = json!({"componentType": 5126, "count": 1 << 22, "type": "VEC3"});
        json["accessors"].as_array_mut().unwrap().push(zeros);
        json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}});
    });
    assert!(message.contains("4194304 copies"), "{message}");
}

#[test]
fn required_extensions_are_named() {
    let message = refused(|json| json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]));
    assert!(message.contains("KHR_draco_mesh_compression"), "{message}");
}

#[test]
fn draco_without_plain_vertices_is_named() {
    let message = refused(|json| {
        json["accessors"][0] = json!({"componentType": 5126, "count": 3, "type": "VEC3"});
        json["meshes"][0]["primitives"][0]["extensions"] =
            json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}});
    });
    assert!(message.contains("mesh 0, primitive 0: KHR_draco_mesh_compression"), "{message}");
}

#[test]
#[cfg(unix)]
fn confined_files_stay_in_their_folder() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("inside");
    std::fs::create_dir(&inside).unwrap();
    let (mut json, binary) = triangle();
    std::fs::write(folder.path().join("out.bin"), &binary).unwrap();
    std::fs::write(inside.join("a b.bin"), &binary).unwrap();
    std::os::unix::fs::symlink("../out.bin", inside.join("link.bin")).unwrap();
    for (uri, is_inside) in [("a%20b.bin", true), ("../out.bin", false), ("link.bin", false)] {
        json["buffers"][0]["uri"] = json!(uri);
        let file = inside.join("model.gltf");
        std::fs::write(&file, json.to_string()).unwrap();
        assert!(Scene::load(&file).is_ok(), "{uri}");
        let options = photolith::scene::LoadOptions { confine: true, ..Default::default() };
        assert_eq!(Scene::load_with(&file, &options).is_ok(), is_inside, "{uri}");
    }
}

#[test]
fn uris_stay_on_this_machine() {
    for uri in ["https://example.org/a.bin", "/etc/passwd", "file:///etc/passwd", "C:/a.bin"] {
        let message = refused(|json| json["buffers"][0]["uri"] = json!(uri));
        assert!(message.contains(uri) && message.contains("buffer 0"), "{message}");
    }
}

/// Errors name the file, and what of it is meant.
#[test]
fn files_that_cannot_be_read_are_named_with_who_names_them() {
    let message = refused(|json| json["buffers"][0]["uri"] = json!("gone.bin"));
    assert!(message.starts_with("test.glb: buffer 0: \"gone.bin\", which cannot be read"), "{message}");
    let folder = tempfile::tempdir().unwrap();
    let (mut json, _) = triangle();
    json["buffers"][0]["uri"] = json!(".");
    let file = folder.path().join("model.gltf");
    std::fs::write(&file, json.to_string()).unwrap();
    let message = Scene::load(&file).unwrap_err().to_string();
    assert!(message.contains("model.gltf: buffer 0") && message.contains("a folder"), "{message}");
}

/// What no camera fits is an error of its own.
#[test]
fn nothing_to_see_is_told() {
    for scale in [json!([0, 0, 0]), json!([1e-30, 1e-30, 1e-30])] {
        let message = refused(|json| json["nodes"][0]["scale"] = scale);
        assert!(!message.contains("camera"), "{message}");
    }
    let message = refused(|json| json["meshes"][0]["primitives"][0]["attributes"] = json!({}));
    assert!(!message.contains("camera"), "{message}");
}

/// As deep as a file can be.
#[test]
fn a_long_chain_of_nodes_is_followed() {
    let (mut json, binary) = triangle();
    let chain = (0..50_000).map(|i| json!({"children": [i + 1]}));
    json["nodes"] = chain.chain([json!({"mesh": 0})]).collect();
    assert_eq!(load(&json, &binary).unwrap().scene.triangle_count(), 1);
}

/// Values of an animation that are too few for what they move.
#[test]
fn an_animation_of_too_few_numbers_is_refused() {
    let (mut json, mut binary) = triangle();
    let times: Vec<u8> = [0.0f32, 1.0, 2.0].iter().flat_map(|t| t.to_le_bytes()).collect();
    let times = add(&mut json, &mut binary, &times, json!({"componentType": 5126, "count": 3, "type": "SCALAR"}));
    let value = add(&mut json, &mut binary, &[0; 12], json!({"componentType": 5126, "count": 1, "type": "VEC3"}));
    json["animations"] = json!([{
        "samplers": [{"input": times, "output": value}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
    }]);
    let options = photolith::scene::LoadOptions { time: Some(0.5), ..Default::default() };
    let loaded = Scene::from_bytes_with(&glb(&json, &binary), "test.glb", None, &options);
    let message = loaded.expect_err("refused").to_string();
    assert!(message.contains("animation 0, channel 0"), "{message}");
}

#[test]
fn a_truncated_file_is_refused() {
    let (json, binary) = triangle();
    let file = glb(&json, &binary);
    for length in 4..file.len() {
        assert!(Scene::from_bytes(&file[..length], "test.glb", None).is_err(), "{length} bytes");
    }
}

proptest! {
    #[test]
    fn changed_bytes_make_an_error_or_a_scene(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let (json, binary) = triangle();
        let mut file = glb(&json, &binary);
        for (at, byte) in changes {
            let at = at.index(file.len());
            file[at] = byte;
        }
        match Scene::from_bytes(&file, "test.glb", None) {
            Ok(loaded) => prop_assert!(loaded.scene.triangle_count() > 0),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}
