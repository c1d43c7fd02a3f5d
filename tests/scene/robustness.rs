//! Whatever is loaded, the answer is a scene that validates or an error: never a panic.

use std::fs;
use std::path::Path;

use proptest::prelude::*;

use photolith::Scene;

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

/// With files: `a.obj` and `a.png` of a folder.
const FILES: &str = r#"version = 1
[camera]
position = [0, 0, 5]
target = [0, 0, 0]
horizontal_fov = 40
[[texture]]
name = "t"
file = "a.png"
wrap = ["repeat", "clamp"]
scale = 2
rotate = 30
[[material]]
name = "m"
type = "pbr"
base_color_texture = "t"
normal_texture = "t"
alpha = "mask"
opacity = 0.5
[[model]]
name = "a"
file = "a.obj"
material = "m"
scale = [1, -2, 3]
[[instance]]
of = "a"
matrix = [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7]]
"#;

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0 1\nv -0.5e1 1 .5\nvt 0 1\nvn 0 0 1\no a\nusemtl m\n\
    f 1/1/1 2/1/1 3/1/1\nf -4 -3 -2 -1 # c\nf 1//1 2/1 \\\n 3\nl 1 2\n";

const MTL: &str = "newmtl m\nKd 1 0.5 0\nKe 0 0 0\nillum 2\nNi 1.5\nd 0.5\nTf 1 1 1\nTr 0\nmap_Kd -s 2 2 2 a.png\nKs 1\n\
    Ns 10\nPr 0.5\nmap_Pm -imfchan b -mm 0 1 a.png\nbump -bm 2 a.png\nmap_d a.png\nmap_Ke a.png\nmap_Ns a.png\nPc 1\nmap_Pr b.png\n";

/// Images of 3 × 2 pixels, and 2 × 1, of 8 and of 16 bits.
fn images(folder: &Path) {
    image::RgbaImage::from_fn(3, 2, |x, y| image::Rgba([90 * x as u8, 99 * y as u8, 0, 200]))
        .save(folder.join("a.png"))
        .unwrap();
    image::ImageBuffer::from_fn(2, 1, |x, _| image::Luma([60_000 * x as u16])).save(folder.join("b.png")).unwrap();
}

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

/// A mesh with this MTL file beside it.
fn load_mtl(folder: &Path, bytes: &[u8]) {
    fs::write(folder.join("a.mtl"), bytes).unwrap();
    let loaded = Scene::from_obj_bytes(OBJ.as_bytes(), "a.obj", Some(folder)).unwrap();
    loaded.scene.validate().unwrap();
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
    let folder = tempfile::tempdir().unwrap();
    images(folder.path());
    fs::write(folder.path().join("a.obj"), OBJ).unwrap();
    let loaded = Scene::from_toml_str(FILES, "scene.toml", Some(folder.path())).unwrap();
    assert_eq!(loaded.scene.triangle_count(), 8, "{:?}", loaded.warnings);
    fs::write(folder.path().join("a.mtl"), MTL).unwrap();
    let loaded = Scene::from_obj_bytes(OBJ.as_bytes(), "a.obj", Some(folder.path())).unwrap();
    assert_eq!(loaded.scene.materials[0].textures.len(), 4, "{:?}", loaded.warnings);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        load_toml(&bytes);
        load_obj(&bytes);
        let folder = tempfile::tempdir().unwrap();
        load_mtl(folder.path(), &bytes);
    }

    #[test]
    fn mutations_of_a_scene_file(bytes in mutated(TOML)) {
        load_toml(&bytes);
    }

    #[test]
    fn mutations_of_an_obj_file(bytes in mutated(OBJ)) {
        load_obj(&bytes);
    }
}

proptest! {
    // Each writes and reads files.
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutations_of_an_mtl_file(bytes in mutated(MTL)) {
        let folder = tempfile::tempdir().unwrap();
        images(folder.path());
        load_mtl(folder.path(), &bytes);
    }

    #[test]
    fn mutations_of_a_scene_file_with_files(bytes in mutated(FILES)) {
        let folder = tempfile::tempdir().unwrap();
        images(folder.path());
        fs::write(folder.path().join("a.obj"), OBJ).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        match Scene::from_toml_str(&text, "scene.toml", Some(folder.path())) {
            Ok(loaded) => loaded.scene.validate().unwrap(),
            Err(error) => assert!(error.to_string().contains("scene.toml"), "{error}"),
        }
    }
}
