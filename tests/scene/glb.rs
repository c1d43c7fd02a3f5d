//! Small `.glb` files, written by the tests.

use photolith::scene::{Loaded, Scene, SceneError};
use serde_json::{Value, json};

/// A file of one triangle (0,0,0) (1,0,0) (0,1,0): accessor 0 is POSITION, bufferView 0 all of the buffer.
pub fn triangle() -> (Value, Vec<u8>) {
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
    let json = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
    });
    (json, bytes)
}

/// Both chunks.
pub fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let padded = |mut bytes: Vec<u8>, with: u8| {
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let (json, binary) = (padded(json.to_string().into_bytes(), b' '), padded(binary.to_vec(), 0));
    let mut file = b"glTF".to_vec();
    let word = |n: usize| (n as u32).to_le_bytes();
    file.extend(word(2));
    file.extend(word(12 + 8 + json.len() + 8 + binary.len()));
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", binary)] {
        file.extend(word(chunk.len()));
        file.extend(kind);
        file.extend(chunk);
    }
    file
}

/// Loads it.
pub fn load(json: &Value, binary: &[u8]) -> Result<Loaded, SceneError> {
    Scene::from_bytes(&glb(json, binary), "test.glb", None)
}

/// Adds numbers as a view and an accessor; gives the accessor's number.
pub fn add(json: &mut Value, binary: &mut Vec<u8>, bytes: &[u8], mut accessor: Value) -> usize {
    let list = |json: &mut Value, name: &str, value: Value| {
        let all = json[name].as_array_mut().unwrap();
        all.push(value);
        all.len() - 1
    };
    let view = json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len()});
    binary.extend(bytes);
    json["buffers"][0]["byteLength"] = json!(binary.len());
    accessor["bufferView"] = json!(list(json, "bufferViews", view));
    list(json, "accessors", accessor)
}
