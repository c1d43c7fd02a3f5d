//! Whatever is loaded, the answer is a scene that validates or an error: never a panic.

use proptest::prelude::*;

use photolith::Scene;
use photolith::scene::obj::parse_mtl;

const TOML: &str = r#"version = 1
film = { width = 3, height = 4, filter = "box", gamma = "srgb" }
background.radiance = [1, 2.5, 0]
[camera]
position = [0, 0, 5]
target = [0, 0, 0]
horizontal_fov = 40.5
[integrator]
max_depth = 2
russian_roulette = "off"
[[material]]
name = "ü"
type = "dielectric"
ior = 1.5
[[material]]
name = "e"
type = "emitter"
radiance = [4, 5, 6]
[[sphere]]
center = [1.5, -2, 3e2]
radius = 0.25
material = "ü"
inward = true
[[light]]
type = "point"
position = [0, 9, 0]
power = [1, 1, 1]
"#;

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0 1\nv -0.5e1 1 .5\nvt 0 1\nvn 0 0 1\no a\nusemtl m\n\
    f 1/1/1 2/1/1 3/1/1\nf -4 -3 -2 -1 # c\nf 1//1 2/1 \\\n 3\nl 1 2\n";

const MTL: &str = "newmtl m\nKd 1 0.5 0\nKe 0 0 0\nillum 7\nNi 1.5\nd 0.5\nTf 1 1 1\nTr 0\nmap_Kd a.png\nKs 1\n";

/// Tokens that are likely to matter where they are put.
const TOKENS: [&str; 24] = [
    "nan",
    "-inf",
    "1e308",
    "-1",
    "0",
    "18446744073709551616",
    "-9223372036854775808",
    "4294967295",
    "\"",
    "'''",
    "[",
    "]",
    "[[",
    "{",
    "}",
    "=",
    ".",
    "\n",
    "\r\n",
    "\\\n",
    "/",
    "#",
    "\u{feff}",
    "𝄞",
];

/// Makes some cuts, repeats and insertions in a text.
fn mutated(text: &'static str) -> impl Strategy<Value = Vec<u8>> {
    let edit = (any::<prop::sample::Index>(), 0..12_usize, prop::sample::select(&TOKENS[..]), any::<u8>(), 0..4_u8);
    prop::collection::vec(edit, 1..6).prop_map(move |edits| {
        let mut bytes = text.as_bytes().to_vec();
        for (index, length, token, byte, kind) in edits {
            let start = index.index(bytes.len() + 1);
            let end = (start + length).min(bytes.len());
            match kind {
                0 => drop(bytes.drain(start..end)),
                1 => drop(bytes.splice(start..end, token.bytes())),
                2 => bytes.insert(start, byte),
                _ => bytes.extend_from_within(start..end),
            }
        }
        bytes
    })
}

fn load_toml(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    match Scene::from_toml_str(&text, "scene.toml", None) {
        Ok(loaded) => loaded.scene.validate().unwrap(),
        Err(error) => assert!(error.to_string().contains("scene.toml"), "{error}"),
    }
}

fn load_obj(bytes: &[u8]) {
    match Scene::from_obj_bytes(bytes, "a.obj", None) {
        Ok(loaded) => loaded.scene.validate().unwrap(),
        Err(error) => assert!(error.to_string().contains("a.obj"), "{error}"),
    }
}

#[test]
fn the_texts_to_mutate_are_good() {
    assert_eq!(Scene::from_toml_str(TOML, "scene.toml", None).unwrap().scene.spheres.len(), 1);
    assert_eq!(Scene::from_obj_bytes(OBJ.as_bytes(), "a.obj", None).unwrap().scene.triangle_count(), 4);
    assert_eq!(parse_mtl(MTL.as_bytes(), "a.mtl").0.len(), 1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        load_toml(&bytes);
        load_obj(&bytes);
        let _ = parse_mtl(&bytes, "a.mtl");
    }

    #[test]
    fn mutations_of_a_scene_file(bytes in mutated(TOML)) {
        load_toml(&bytes);
    }

    #[test]
    fn mutations_of_an_obj_file(bytes in mutated(OBJ)) {
        load_obj(&bytes);
    }

    #[test]
    fn mutations_of_an_mtl_file(bytes in mutated(MTL)) {
        for material in parse_mtl(&bytes, "a.mtl").0 {
            material.surface(|_| {});
        }
    }
}
