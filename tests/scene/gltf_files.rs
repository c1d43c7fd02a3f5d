//! glTF: what is made of what a file says.

use glam::DVec3;
use photolith::scene::{Bsdf, Coverage, Exposure, Light, Loaded, Normals, Texels, TextureSlot, Tone};
use serde_json::{Value, json};

use crate::glb::{add, load, triangle};

#[test]
fn a_triangle_without_normals_is_flat() {
    let (json, binary) = triangle();
    let loaded = load(&json, &binary).unwrap();
    let mesh = &loaded.scene.meshes[0];
    assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(mesh.normals, Normals::Flat);
    assert!(loaded.warnings.is_empty() && loaded.scene.environment.is_some(), "{:?}", loaded.warnings);
    assert!(loaded.scene.materials[0].culls_back, "single-sided is the default");
}

#[test]
fn a_mirrored_node_keeps_its_front_outside() {
    let (mut json, binary) = triangle();
    json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    let mesh = load(&json, &binary).unwrap().scene.meshes.remove(0);
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    assert!((b - a).cross(c - a).z > 0.0, "the mirror image of a front is seen from the same side");
}

#[test]
fn transforms_of_parents_come_after_those_of_children() {
    let (mut json, binary) = triangle();
    json["nodes"] = json!([
        {"children": [1], "translation": [10, 0, 0], "scale": [2, 2, 2]},
        {"mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 1,0,0,1]},
    ]);
    let scene = load(&json, &binary).unwrap().scene;
    assert_eq!(scene.meshes[0].positions[0], DVec3::new(12.0, 0.0, 0.0));
    assert_eq!(scene.meshes[0].positions[1], DVec3::new(14.0, 0.0, 0.0));
}

#[test]
fn strides_and_normalised_integers() {
    let (mut json, mut binary) = triangle();
    let bytes: Vec<u8> = [[0, 0], [255, 51], [0, 255]].iter().flat_map(|&[u, v]| [u, v, 9, 9]).collect();
    let uv = add(
        &mut json,
        &mut binary,
        &bytes,
        json!({"componentType": 5121, "normalized": true, "count": 3, "type": "VEC2"}),
    );
    json["bufferViews"][1]["byteStride"] = json!(4);
    json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    let scene = load(&json, &binary).unwrap().scene;
    assert_eq!(scene.meshes[0].uvs[0], [[0.0, 0.0], [1.0, 0.2], [0.0, 1.0]]);
}

#[test]
fn sparse_values_replace_zeros() {
    let (mut json, mut binary) = triangle();
    add(&mut json, &mut binary, &[1, 0, 2, 0], json!({"componentType": 5123, "count": 2, "type": "SCALAR"}));
    json["accessors"][0] = json!({"componentType": 5126, "count": 3, "type": "VEC3", "sparse": {
        "count": 2,
        "indices": {"bufferView": 1, "componentType": 5123},
        "values": {"bufferView": 0, "byteOffset": 12},
    }});
    let scene = load(&json, &binary).unwrap().scene;
    assert_eq!(scene.meshes[0].positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
}

#[test]
fn strips_and_fans_have_one_front() {
    for mode in [5, 6] {
        let (mut json, mut binary) = triangle();
        let order: [u8; 4] = if mode == 5 { [0, 1, 2, 3] } else { [0, 1, 3, 2] };
        let corners: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
        let bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
        let positions = add(&mut json, &mut binary, &bytes, json!({"componentType": 5126, "count": 4, "type": "VEC3"}));
        let indices = add(&mut json, &mut binary, &order, json!({"componentType": 5121, "count": 4, "type": "SCALAR"}));
        json["meshes"][0]["primitives"][0] =
            json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": mode});
        let mesh = load(&json, &binary).unwrap().scene.meshes.remove(0);
        assert_eq!(mesh.triangles.len(), 2, "mode {mode}");
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            assert!((b - a).cross(c - a).z > 0.0, "mode {mode}: {triangle:?}");
        }
    }
}

#[test]
fn points_and_lines_are_counted() {
    let (mut json, binary) = triangle();
    let line = json!({"attributes": {"POSITION": 0}, "mode": 3});
    json["meshes"][0]["primitives"].as_array_mut().unwrap().push(line);
    let loaded = load(&json, &binary).unwrap();
    assert!(loaded.warnings.iter().any(|w| w.contains("1 primitives of points or lines")), "{:?}", loaded.warnings);
}

#[test]
fn a_texture_transform_turns_as_its_worked_example_does() {
    let (mut json, binary) = triangle();
    let png = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==";
    json["images"] = json!([{"uri": png}]);
    json["textures"] = json!([{"source": 0}]);
    json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {
        "KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 0.5, "scale": [2, 3]}}}}}]);
    json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let scene = load(&json, &binary).unwrap().scene;
    let (sin, cos) = 0.5f64.sin_cos();
    let texture = scene.materials[0].textures[&TextureSlot::BaseColor];
    assert_eq!(texture.transform, [[2.0 * cos, 3.0 * sin, 0.5], [-2.0 * sin, 3.0 * cos, 0.25]]);
    assert!(texture.srgb);
    assert_eq!((scene.images[0].width, scene.images[0].height), (1, 1));
}

#[test]
fn materials_with_their_extensions() {
    let (mut json, binary) = triangle();
    json["materials"] = json!([{
        "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true, "emissiveFactor": [1, 0.5, 0],
        "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.3},
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 4},
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_transmission": {"transmissionFactor": 0.9},
            "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 0},
        },
    }]);
    json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let material = load(&json, &binary).unwrap().scene.materials.remove(0);
    let Bsdf::MetallicRoughness(model) = material.surface.bsdf else { panic!("{:?}", material.surface.bsdf) };
    assert_eq!(material.coverage, Coverage::Mask(0.25));
    assert_eq!(material.surface.emission, [4.0, 2.0, 0.0]);
    assert!(material.surface.two_sided && !material.culls_back);
    assert_eq!((model.ior, model.transmission, model.has_volume), (1.33, 0.9, true));
    assert_eq!(model.attenuation_distance, f64::INFINITY, "0 absorbs nothing");
}

/// A triangle with a material of these extensions, and two images.
fn with_extensions(extensions: &serde_json::Value) -> Loaded {
    let (mut json, mut binary) = triangle();
    let uvs: Vec<u8> =
        [[0f32, 0.0], [1.0, 0.0], [0.0, 1.0]].as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let uv = add(&mut json, &mut binary, &uvs, json!({"componentType": 5126, "count": 3, "type": "VEC2"}));
    let normals: Vec<u8> = [[0f32, 0.0, 1.0]; 3].as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let normal = add(&mut json, &mut binary, &normals, json!({"componentType": 5126, "count": 3, "type": "VEC3"}));
    let png = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==";
    json["images"] = json!([{"uri": png}]);
    json["textures"] = json!([{"source": 0}]);
    json["materials"] = json!([{"extensions": extensions}]);
    json["meshes"][0]["primitives"][0]["material"] = json!(0);
    json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normal);
    load(&json, &binary).unwrap()
}

fn left_out(loaded: &Loaded) -> Vec<&String> {
    loaded.warnings.iter().filter(|warning| warning.contains("left out")).collect()
}

#[test]
fn coats_and_sheen_with_their_textures() {
    let loaded = with_extensions(&json!({
        "KHR_materials_clearcoat": {
            "clearcoatFactor": 0.7, "clearcoatTexture": {"index": 0},
            "clearcoatRoughnessFactor": 0.4, "clearcoatRoughnessTexture": {"index": 0},
            "clearcoatNormalTexture": {"index": 0, "scale": 0.5},
        },
        "KHR_materials_sheen": {
            "sheenColorFactor": [0.9, 0.5, 0.1], "sheenColorTexture": {"index": 0},
            "sheenRoughnessFactor": 0.3, "sheenRoughnessTexture": {"index": 0},
        },
    }));
    let material = &loaded.scene.materials[0];
    let Bsdf::MetallicRoughness(model) = material.surface.bsdf else { panic!("{:?}", material.surface.bsdf) };
    assert_eq!((model.coat, model.coat_roughness, material.coat_normal_scale), (0.7, 0.4, 0.5));
    assert_eq!((model.sheen_color, model.sheen_roughness), ([0.9, 0.5, 0.1], 0.3));
    let is_srgb = |slot| material.textures[&slot].srgb;
    for slot in [TextureSlot::Coat, TextureSlot::CoatRoughness, TextureSlot::CoatNormal, TextureSlot::SheenRoughness] {
        assert!(!is_srgb(slot), "{slot:?}");
    }
    assert!(is_srgb(TextureSlot::SheenColor));
    assert_eq!(loaded.scene.meshes[0].tangents.len(), 3, "the coat's normals need them");
    assert!(left_out(&loaded).is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn anisotropy_gets_tangents() {
    let loaded = with_extensions(&json!({
        "KHR_materials_anisotropy":
            {"anisotropyStrength": 0.6, "anisotropyRotation": 1.5, "anisotropyTexture": {"index": 0}},
    }));
    let material = &loaded.scene.materials[0];
    let Bsdf::MetallicRoughness(model) = material.surface.bsdf else { panic!("{:?}", material.surface.bsdf) };
    assert_eq!((model.anisotropy, model.anisotropy_rotation), (0.6, 1.5));
    assert!(!material.textures[&TextureSlot::Anisotropy].srgb);
    let [tangent, bitangent] = loaded.scene.meshes[0].tangents[0];
    assert_eq!(tangent, [1.0, 0.0, 0.0]);
    // v runs down.
    assert_eq!(bitangent, [0.0, -1.0, 0.0]);
    assert!(left_out(&loaded).is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn specular_reflection_has_textures() {
    let loaded = with_extensions(&json!({
        "KHR_materials_specular": {
            "specularFactor": 0.5, "specularTexture": {"index": 0},
            "specularColorFactor": [2, 1, 0.5], "specularColorTexture": {"index": 0},
        },
    }));
    let material = &loaded.scene.materials[0];
    let Bsdf::MetallicRoughness(model) = material.surface.bsdf else { panic!("{:?}", material.surface.bsdf) };
    assert_eq!((model.specular, model.specular_color), (0.5, [2.0, 1.0, 0.5]));
    let is_srgb = |slot| material.textures[&slot].srgb;
    assert!(!is_srgb(TextureSlot::Specular) && is_srgb(TextureSlot::SpecularColor));
    assert!(left_out(&loaded).is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn glass_is_a_body_or_a_thin_wall() {
    let (mut json, binary) = triangle();
    let png = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==";
    json["images"] = json!([{"uri": png}]);
    json["textures"] = json!([{"source": 0}]);
    let transmission = json!({"transmissionFactor": 1, "transmissionTexture": {"index": 0}});
    json["materials"] = json!([
        {"extensions": {
            "KHR_materials_transmission": transmission,
            "KHR_materials_volume": {"thicknessFactor": 0.1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0.25]},
        }},
        {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {}}},
    ]);
    for (index, is_body) in [(0, true), (1, false)] {
        json["meshes"][0]["primitives"][0]["material"] = json!(index);
        let loaded = load(&json, &binary).unwrap();
        let material = &loaded.scene.materials[0];
        let Bsdf::MetallicRoughness(model) = material.surface.bsdf else { panic!("{:?}", material.surface.bsdf) };
        assert_eq!(model.has_volume, is_body);
        assert!(!material.culls_back, "light that has entered leaves by the back");
        assert!(!loaded.warnings.iter().any(|w| w.contains("transmission")), "{:?}", loaded.warnings);
        let texture = material.textures.get(&TextureSlot::Transmission);
        assert_eq!(texture.map(|texture| texture.srgb), is_body.then_some(false));
        if is_body {
            let absorption = model.absorption();
            assert!(absorption[0] == 0.0 && (absorption[1] - 2f64.ln() / 2.0).abs() < 1e-12, "{absorption:?}");
        } else {
            assert_eq!(model.absorption(), [0.0; 3]);
        }
    }
}

/// 8-bit pictures of what has light of its own are exposed by what they show; the studio is known.
#[test]
fn pictures_of_bare_files_suit_their_light() {
    let (mut json, binary) = triangle();
    let film = |json: &Value| load(json, &binary).unwrap().scene.film;
    let studio = film(&json);
    assert!(matches!(studio.exposure, Exposure::Stops(stops) if stops < 0.0) && studio.tone == Tone::Neutral);
    json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 100_000}]}});
    json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
    assert_eq!(film(&json).exposure, Exposure::Auto);
}

#[test]
fn candelas_become_power() {
    let (mut json, binary) = triangle();
    json["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 2, "color": [1, 0.5, 0]}]}});
    json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
    let scene = load(&json, &binary).unwrap().scene;
    let Light::Point { power, .. } = &scene.lights[0] else { panic!("{:?}", scene.lights) };
    assert!((power[0] - 8.0 * std::f64::consts::PI).abs() < 1e-9 && power[2] == 0.0, "{power:?}");
}

#[test]
fn an_instanced_mesh_is_there_several_times() {
    let (mut json, binary) = triangle();
    json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}});
    assert_eq!(load(&json, &binary).unwrap().scene.meshes.len(), 3);
}

/// KHR_materials_pbrSpecularGlossiness where there is nothing else: reflectance at normal incidence and 1 − glossiness.
#[test]
fn specular_and_glossiness() {
    let of = |material: Value| {
        let (mut json, binary) = triangle();
        // One pixel of (100, 20, 40, 51).
        let png = image::RgbaImage::from_pixel(1, 1, image::Rgba([100, 20, 40, 51]));
        let mut bytes = std::io::Cursor::new(Vec::new());
        png.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        let data = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, bytes.into_inner());
        json["images"] = json!([{"uri": format!("data:image/png;base64,{data}")}]);
        json["textures"] = json!([{"source": 0}]);
        json["materials"] = json!([material]);
        json["meshes"][0]["primitives"][0]["material"] = json!(0);
        load(&json, &binary).unwrap().scene
    };
    let given = json!({
        "diffuseFactor": [0.1, 0.2, 0.3, 0.5], "specularFactor": [0.04, 0.5, 1.0], "glossinessFactor": 0.75,
        "specularGlossinessTexture": {"index": 0}, "diffuseTexture": {"index": 0},
    });
    let mut plain = given.clone();
    plain.as_object_mut().unwrap().retain(|key, _| !key.ends_with("Texture"));
    let extension = |given: &Value| json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": given}});
    let scene = of(extension(&plain));
    let Bsdf::MetallicRoughness(m) = scene.materials[0].surface.bsdf else { panic!() };
    assert_eq!((m.base_color, m.metallic, m.roughness, scene.materials[0].alpha), ([0.1, 0.2, 0.3], 0.0, 0.25, 0.5));
    let f0 = m.specular_color.map(|color| color * 0.04);
    assert!((0..3).all(|i| (f0[i] - [0.04, 0.5, 1.0][i]).abs() < 1e-12), "{f0:?}");
    let scene = of(extension(&given));
    let Bsdf::MetallicRoughness(m) = scene.materials[0].surface.bsdf else { panic!() };
    assert_eq!(m.roughness, 1.0);
    let image = |slot| &scene.images[scene.materials[0].textures[&slot].image as usize].texels;
    assert_eq!(*image(TextureSlot::SpecularColor), Texels::Rgba8(vec![[100, 20, 40, 51]]));
    assert_eq!(image(TextureSlot::SpecularColor), image(TextureSlot::BaseColor));
    let Texels::Rgba16(roughness) = image(TextureSlot::MetallicRoughness) else { panic!() };
    assert_eq!(roughness[0][1], (65535.0_f64 * (1.0 - 0.75 * 0.2)).round() as u16);
    // A fallback that the file gives counts.
    let mut both = extension(&plain);
    both["pbrMetallicRoughness"] = json!({"roughnessFactor": 0.5});
    let Bsdf::MetallicRoughness(m) = of(both).materials[0].surface.bsdf else { panic!() };
    assert_eq!((m.metallic, m.roughness), (1.0, 0.5));
}
