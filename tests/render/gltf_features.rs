//! Every row of the tables of docs/gltf.md, rendered: what a file may have changes the picture, or leaves it, or is refused.

use base64::Engine as _;
use image::{ImageFormat, Rgba, RgbaImage};
use photolith::scene::LoadOptions;
use photolith::{RenderSettings, Scene};
use serde_json::{Value, json};

use crate::glb::{add, glb, load, triangle};
use crate::harness::{Watched, context, render};

/// What becomes of the picture.
enum Becomes {
    Another,
    TheSame,
    /// An error that says so.
    Refused(&'static str),
}

use Becomes::{Another, Refused, TheSame};

/// A file that changes.
struct File {
    json: Value,
    binary: Vec<u8>,
}

impl File {
    /// A triangle with normals that lean, and a picture on it.
    fn plain() -> Self {
        let (json, binary) = triangle();
        let mut file = Self { json, binary };
        let uv = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        let normal = file.floats("VEC3", &[0.0, 0.6, 0.8, 0.6, 0.0, 0.8, 0.0, 0.0, 1.0]);
        file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
        file.set_attribute("TEXCOORD_0", uv);
        file.set_attribute("NORMAL", normal);
        file.json["images"] = json!([{"uri": picture(ImageFormat::Png, 0)}]);
        file.json["textures"] = json!([{"source": 0}]);
        file.json["materials"] = json!([{"pbrMetallicRoughness":
            {"metallicFactor": 0, "roughnessFactor": 0.4, "baseColorTexture": {"index": 0}}}]);
        file
    }

    fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        let accessor = json!({"componentType": 5126, "count": numbers.len() / width, "type": kind});
        add(&mut self.json, &mut self.binary, &bytes, accessor)
    }

    fn set_attribute(&mut self, name: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    }

    fn set(&mut self, pointer: &str, key: &str, value: Value) {
        self.json.pointer_mut(pointer).unwrap()[key] = value;
    }

    fn material(&mut self, key: &str, value: Value) {
        self.set("/materials/0", key, value);
    }

    /// An extension of the material.
    fn extend(&mut self, name: &str, value: Value) {
        self.json["materials"][0]["extensions"][name] = value;
    }

    fn load(&self, options: &LoadOptions) -> Result<Scene, String> {
        let file = glb(&self.json, &self.binary);
        let loaded = Scene::from_bytes_with(&file, "test.glb", None, options).map_err(|error| error.to_string())?;
        let mut scene = loaded.scene;
        (scene.film.width, scene.film.height, scene.integrator.samples) = (24, 24, 2);
        scene.camera = match loaded.cameras.first() {
            Some(camera) => camera.for_image(24, 24).0,
            None => scene.fitting_camera(),
        };
        Ok(scene)
    }

    fn sums(&self, context: &Watched, options: &LoadOptions) -> Result<Vec<[f64; 3]>, String> {
        let scene = self.load(options)?;
        let film = render(context, &scene, &RenderSettings::of(&scene));
        let sums = film.sums();
        assert!(sums.iter().flatten().all(|x| x.is_finite()) && sums.iter().flatten().any(|x| *x > 0.0));
        Ok(sums.to_vec())
    }

    /// POSITION, by the attribute codec of EXT_meshopt_compression: one group of 16 plain bytes for each byte of an element.
    fn compress(&mut self, name: &str) {
        let bytes: Vec<u8> = self.binary[..36].to_vec();
        let mut coded = vec![0xa0];
        for plane in 0..12 {
            let mut group = [0u8; 16];
            let mut before = bytes[plane];
            for element in 0..3 {
                let delta = bytes[12 * element + plane].wrapping_sub(before).cast_signed();
                group[element] = ((delta << 1) ^ (delta >> 7)).cast_unsigned();
                before = bytes[12 * element + plane];
            }
            coded.push(3);
            coded.extend(group);
        }
        coded.extend([0; 20]);
        coded.extend(&bytes[..12]);
        let offset = self.binary.len();
        self.binary.extend(&coded);
        self.binary[..36].fill(0xff);
        self.json["buffers"][0]["byteLength"] = json!(self.binary.len());
        self.json["bufferViews"][0]["extensions"][name] = json!({"buffer": 0, "byteOffset": offset,
            "byteLength": coded.len(), "byteStride": 12, "count": 3, "mode": "ATTRIBUTES"});
        self.json["extensionsRequired"] = json!([name]);
    }
}

/// Four pixels, as a URI.
fn picture(format: ImageFormat, seed: u8) -> String {
    let pixel = |x: u32, y: u32| Rgba([200 ^ seed, 80 * x as u8, 120 * y as u8, if x == 0 { 255 } else { 60 }]);
    let mut bytes = std::io::Cursor::new(Vec::new());
    RgbaImage::from_fn(2, 2, pixel).write_to(&mut bytes, format).unwrap();
    data(&bytes.into_inner())
}

fn data(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

type Change = fn(&mut File);

/// Rows of the first table, and what shows that they are true.
const FEATURES: &[(&str, Becomes, Change)] = &[
    ("buffers", TheSame, |f| {
        let uri = data(&f.binary);
        f.set("/buffers/0", "uri", json!(uri));
    }),
    ("absolute paths", Refused("https://example.org/a.bin"), |f| {
        f.set("/buffers/0", "uri", json!("https://example.org/a.bin"));
    }),
    ("accessors", Another, |f| {
        let index =
            add(&mut f.json, &mut f.binary, &[2, 0], json!({"componentType": 5123, "count": 1, "type": "SCALAR"}));
        let value = f.floats("VEC3", &[0.0, 2.0, 0.0]);
        f.json["accessors"][0]["sparse"] = json!({"count": 1,
            "indices": {"bufferView": index, "componentType": 5123}, "values": {"bufferView": value}});
    }),
    ("nodes", Another, |f| f.set("/nodes/0", "scale", json!([-1, 2, 1]))),
    ("scene", Another, |f| {
        f.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "rotation": [0, 0, 1, 0]}]);
        f.json["scenes"] = json!([{"nodes": [0]}, {"nodes": [1]}]);
        f.json["scene"] = json!(1);
    }),
    ("triangles", TheSame, |f| f.set("/meshes/0/primitives/0", "mode", json!(5))),
    ("triangles", TheSame, |f| f.set("/meshes/0/primitives/0", "mode", json!(6))),
    ("points", TheSame, |f| {
        let line = json!({"attributes": {"POSITION": 0}, "mode": 3});
        f.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(line);
    }),
    ("NORMAL", Another, |f| {
        f.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
    }),
    ("TANGENT", Another, |f| {
        let tangent = f.floats("VEC4", &[0.0, 1.0, 0.0, 1.0].repeat(3));
        f.set_attribute("TANGENT", tangent);
        f.material("normalTexture", json!({"index": 0}));
    }),
    ("TEXCOORD_0, TEXCOORD_1", Another, |f| {
        let uv = f.floats("VEC2", &[0.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
        f.set_attribute("TEXCOORD_1", uv);
        f.set("/materials/0/pbrMetallicRoughness/baseColorTexture", "texCoord", json!(1));
    }),
    ("COLOR_0", Another, |f| {
        let color = f.floats("VEC3", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        f.set_attribute("COLOR_0", color);
    }),
    ("skins", Another, |f| {
        let joints =
            add(&mut f.json, &mut f.binary, &[0; 12], json!({"componentType": 5121, "count": 3, "type": "VEC4"}));
        let weights = f.floats("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(3));
        f.set_attribute("JOINTS_0", joints);
        f.set_attribute("WEIGHTS_0", weights);
        f.json["nodes"] = json!([{"mesh": 0, "skin": 0}, {"scale": [1, 2, 1]}]);
        f.json["scenes"][0]["nodes"] = json!([0, 1]);
        f.json["skins"] = json!([{"joints": [1]}]);
    }),
    ("skins", Another, |f| {
        let target = f.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        f.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
        f.json["meshes"][0]["weights"] = json!([0.5]);
    }),
    ("animation", Another, |f| {
        let times = f.floats("SCALAR", &[0.0, 1.0]);
        let turns = f.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
        f.json["animations"] = json!([{"samplers": [{"input": times, "output": turns}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}]}]);
    }),
    ("cameras", Another, |f| {
        f.json["cameras"] =
            json!([{"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 9}}]);
        f.json["nodes"] = json!([{"mesh": 0}, {"camera": 0, "translation": [0, 0, 3]}]);
        f.json["scenes"][0]["nodes"] = json!([0, 1]);
    }),
    ("light", Another, |f| f.material("emissiveFactor", json!([1, 1, 1]))),
    ("base colour", Another, |f| f.set("/materials/0/pbrMetallicRoughness", "metallicFactor", json!(1))),
    ("base colour", Another, |f| {
        f.set("/materials/0/pbrMetallicRoughness", "metallicRoughnessTexture", json!({"index": 0}));
    }),
    ("base colour", Another, |f| f.material("normalTexture", json!({"index": 0}))),
    ("base colour", Another, |f| {
        f.material("emissiveFactor", json!([1, 1, 1]));
        f.material("emissiveTexture", json!({"index": 0}));
    }),
    ("occlusion", TheSame, |f| f.material("occlusionTexture", json!({"index": 0}))),
    ("alphaMode", Another, |f| f.material("alphaMode", json!("BLEND"))),
    ("alphaMode", Another, |f| {
        f.material("alphaMode", json!("MASK"));
        f.material("alphaCutoff", json!(0.9));
    }),
    ("doubleSided", Another, |f| {
        // Its back, which lets rays pass where the material is single-sided.
        f.set("/nodes/0", "rotation", json!([0, 1, 0, 0]));
        f.material("doubleSided", json!(true));
    }),
    ("images: PNG", TheSame, |f| f.json["images"][0]["uri"] = json!(picture(ImageFormat::WebP, 0))),
    ("images: PNG", TheSame, |f| f.json["images"][0]["uri"] = json!(picture(ImageFormat::Tga, 0))),
    ("images: PNG", TheSame, |f| f.json["images"][0]["uri"] = json!(picture(ImageFormat::Bmp, 0))),
    ("images: KTX2", Refused("KTX2"), |f| f.json["images"][0]["uri"] = json!(data(b"\xabKTX 20\xbb\r\n\x1a\n rest"))),
    ("samplers", Another, |f| {
        f.json["samplers"] = json!([{"magFilter": 9728, "wrapS": 33071}]);
        f.set("/textures/0", "sampler", json!(0));
    }),
];

/// Rows of the second table.
const EXTENSIONS: &[(&str, Becomes, Change)] = &[
    ("EXT_mesh_gpu_instancing", Another, |f| {
        f.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}});
    }),
    ("EXT_meshopt_compression", TheSame, |f| f.compress("EXT_meshopt_compression")),
    ("KHR_meshopt_compression", TheSame, |f| f.compress("KHR_meshopt_compression")),
    ("EXT_texture_webp", Another, |f| {
        f.json["images"].as_array_mut().unwrap().push(json!({"uri": picture(ImageFormat::WebP, 90)}));
        f.set("/textures/0", "extensions", json!({"EXT_texture_webp": {"source": 1}}));
    }),
    ("KHR_animation_pointer", TheSame, |f| f.json["extensionsUsed"] = json!(["KHR_animation_pointer"])),
    ("KHR_draco_mesh_compression", Refused("KHR_draco_mesh_compression"), |f| {
        f.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    }),
    ("KHR_lights_punctual", Another, |f| {
        f.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 3}]}});
        f.json["nodes"] =
            json!([{"mesh": 0}, {"translation": [0, 0, 1], "extensions": {"KHR_lights_punctual": {"light": 0}}}]);
        f.json["scenes"][0]["nodes"] = json!([0, 1]);
    }),
    ("KHR_materials_ior", Another, |f| f.extend("KHR_materials_ior", json!({"ior": 2.5}))),
    ("KHR_materials_specular", Another, |f| {
        f.extend("KHR_materials_specular", json!({"specularTexture": {"index": 0}}))
    }),
    ("KHR_materials_transmission", Another, |f| {
        f.extend("KHR_materials_transmission", json!({"transmissionFactor": 0.5}));
    }),
    ("KHR_materials_volume", Another, |f| {
        f.extend("KHR_materials_transmission", json!({"transmissionFactor": 1}));
        f.extend(
            "KHR_materials_volume",
            json!({"thicknessFactor": 1, "attenuationDistance": 1, "attenuationColor": [1, 0.5, 0.5]}),
        );
    }),
    ("KHR_materials_anisotropy", Another, |f| {
        f.extend("KHR_materials_anisotropy", json!({"anisotropyStrength": 1, "anisotropyRotation": 1}));
    }),
    ("KHR_materials_clearcoat", Another, |f| f.extend("KHR_materials_clearcoat", json!({"clearcoatFactor": 1}))),
    ("KHR_materials_sheen", Another, |f| {
        f.extend("KHR_materials_sheen", json!({"sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": 0.5}));
    }),
    ("KHR_materials_emissive_strength", Another, |f| {
        f.material("emissiveFactor", json!([1, 1, 1]));
        f.extend("KHR_materials_emissive_strength", json!({"emissiveStrength": 4}));
    }),
    ("KHR_materials_unlit", Another, |f| f.extend("KHR_materials_unlit", json!({}))),
    ("KHR_materials_pbrSpecularGlossiness", Another, |f| {
        f.json["materials"] = json!([{"extensions": {"KHR_materials_pbrSpecularGlossiness":
            {"diffuseFactor": [0.2, 0.3, 0.4, 1], "specularFactor": [1, 1, 1], "glossinessFactor": 0.5}}}]);
    }),
    ("KHR_materials_variants", Another, |f| {
        f.json["materials"].as_array_mut().unwrap().push(json!({"pbrMetallicRoughness": {"roughnessFactor": 0.9}}));
        f.json["extensions"] = json!({"KHR_materials_variants": {"variants": [{"name": "dull"}]}});
        let mappings = json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0]}]}});
        f.set("/meshes/0/primitives/0", "extensions", mappings);
    }),
    ("KHR_mesh_quantization", TheSame, |f| {
        let corners: [i16; 9] = [0, 0, 0, 1, 0, 0, 0, 1, 0];
        let bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
        let accessor = json!({"componentType": 5122, "count": 3, "type": "VEC3"});
        let positions = add(&mut f.json, &mut f.binary, &bytes, accessor);
        f.set_attribute("POSITION", positions);
        f.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    }),
    ("KHR_texture_transform", Another, |f| {
        let transform = json!({"KHR_texture_transform": {"rotation": 1, "scale": [2, 3]}});
        f.set("/materials/0/pbrMetallicRoughness/baseColorTexture", "extensions", transform);
    }),
    ("KHR_xmp", TheSame, |f| f.json["extensionsUsed"] = json!(["KHR_xmp"])),
    ("KHR_xmp_json_ld", TheSame, |f| f.json["extensionsUsed"] = json!(["KHR_xmp_json_ld"])),
    ("KHR_texture_basisu", TheSame, |f| {
        f.json["images"].as_array_mut().unwrap().push(json!({"uri": data(b"\xabKTX 20\xbb\r\n\x1a\n rest")}));
        f.set("/textures/0", "extensions", json!({"KHR_texture_basisu": {"source": 1}}));
    }),
    ("others", Refused("FOO_bar"), |f| f.json["extensionsRequired"] = json!(["FOO_bar"])),
    ("others", TheSame, |f| f.json["extensionsUsed"] = json!(["FOO_bar"])),
];

/// Relative, over all pixels and channels.
fn difference(sums: &[[f64; 3]], plain: &[[f64; 3]]) -> f64 {
    let pairs = || sums.as_flattened().iter().zip(plain.as_flattened());
    pairs().map(|(a, b)| (a - b).abs()).sum::<f64>() / pairs().map(|(_, b)| b.abs()).sum::<f64>()
}

#[test]
fn every_row_is_rendered() {
    let context = context();
    let none = LoadOptions::default();
    let half = LoadOptions { time: Some(0.5), ..none.clone() };
    let first = LoadOptions { variant: Some("0".to_owned()), ..none.clone() };
    let plain = File::plain().sums(&context, &none).unwrap();
    for (row, becomes, change) in FEATURES.iter().chain(EXTENSIONS) {
        let mut file = File::plain();
        change(&mut file);
        let options = match *row {
            "animation" => &half,
            "KHR_materials_variants" => &first,
            _ => &none,
        };
        match (becomes, file.sums(&context, options)) {
            (Another, Ok(sums)) => assert!(difference(&sums, &plain) > 1e-3, "{row} changes nothing"),
            (TheSame, Ok(sums)) => assert!(difference(&sums, &plain) < 1e-5, "{row} changes the picture"),
            (Refused(said), Err(message)) => assert!(message.contains(said), "{row}: {message}"),
            (_, Err(message)) => panic!("{row}: {message}"),
            (Refused(_), Ok(_)) => panic!("{row} is not refused"),
        }
    }
}

#[test]
fn extensions_that_are_left_out_are_warned_of() {
    let mut file = File::plain();
    file.json["extensionsUsed"] = json!(["FOO_bar"]);
    let warnings = load(&file.json, &file.binary).unwrap().warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("FOO_bar"), "{warnings:?}");
}

/// The rows are those of the document.
#[test]
fn every_row_has_a_picture() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/gltf.md")).unwrap();
    let rows = |table: usize| -> Vec<String> {
        let tables = text.split("\n\n").filter(|part| part.contains("|---|---|"));
        let lines = tables.map(|part| part.lines().skip_while(|line| !line.starts_with("|---")).skip(1)).nth(table);
        let cells = lines.expect("a table").filter_map(|line| line.split('|').nth(1));
        cells.map(|cell| cell.trim().to_owned()).collect()
    };
    for row in rows(0) {
        assert!(FEATURES.iter().any(|(of, ..)| row.starts_with(of)), "{row}");
    }
    assert!(FEATURES.iter().all(|(of, ..)| rows(0).iter().any(|row| row.starts_with(of))));
    // Names that begin with an underscore go on as the one before them in their row.
    let full = |name: &str| if name.starts_with('_') { format!("KHR_materials{name}") } else { name.to_owned() };
    let named: Vec<String> = rows(1).iter().flat_map(|row| row.split(", ").map(full).collect::<Vec<_>>()).collect();
    for name in &named {
        assert!(EXTENSIONS.iter().any(|(of, ..)| of == name), "{name}");
    }
    assert!(EXTENSIONS.iter().all(|(of, ..)| named.iter().any(|name| name == of)));
}
