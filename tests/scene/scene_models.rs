//! `[[model]]` and `[[instance]]`.

use std::fs;
use std::path::Path;

use glam::DVec3;
use photolith::Scene;
use photolith::scene::{Bsdf, Light, Loaded, Mesh, Normals, SceneError, Surface};
use serde_json::json;

use crate::glb::{glb, triangle};

const HEAD: &str = "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\nhorizontal_fov = 40\n\
    [background]\nradiance = [1, 1, 1]\n[[material]]\nname = \"m\"\ntype = \"mirror\"\n";

/// A folder with `a.obj`, a square of two materials with normals, and `a.glb`, a triangle of a red material with a lamp and a camera.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 .6 .8\nusemtl m\nf 1//1 2//1 3//1\nusemtl n\nf 1//1 3//1 4//1\n";
    fs::write(folder.path().join("a.obj"), obj).unwrap();
    fs::write(folder.path().join("a.mtl"), "newmtl m\nKd .1 .1 .1\nnewmtl n\nKd .2 .2 .2\n").unwrap();
    let (mut json, binary) = triangle();
    let color = |rgba: [f64; 4]| json!({"pbrMetallicRoughness": {"baseColorFactor": rgba}, "doubleSided": true});
    json["materials"] = json!([color([1.0, 0.0, 0.0, 1.0]), color([0.0, 1.0, 0.0, 1.0])]);
    let primitive = &mut json["meshes"][0]["primitives"][0];
    primitive["material"] = json!(0);
    primitive["extensions"] = json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [0]}]}});
    json["nodes"] = json!([
        {"mesh": 0},
        {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 0, 2]},
        {"camera": 0, "translation": [0, 0, 3]},
    ]);
    json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    json["cameras"] = json!([{"type": "perspective", "name": "eye", "perspective": {"yfov": 1.0, "znear": 0.1}}]);
    json["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_materials_variants"]);
    json["extensions"] = json!({
        "KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 3.0}]},
        "KHR_materials_variants": {"variants": [{"name": "green"}]},
    });
    fs::write(folder.path().join("a.glb"), glb(&json, &binary)).unwrap();
    folder
}

fn load_in(folder: &Path, tables: &str) -> Result<Loaded, SceneError> {
    Scene::from_toml_str(&format!("{HEAD}{tables}\n"), "scene.toml", Some(folder))
}

fn good(folder: &Path, tables: &str) -> Scene {
    let loaded = load_in(folder, tables).unwrap_or_else(|error| panic!("{error}\n{tables}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

fn corners(mesh: &Mesh) -> Vec<DVec3> {
    mesh.triangles.iter().flatten().map(|&vertex| mesh.positions[vertex as usize]).collect()
}

fn base_color(scene: &Scene, mesh: usize) -> [f64; 3] {
    match scene.materials[scene.meshes[mesh].triangle_materials[0] as usize].surface.bsdf {
        Bsdf::MetallicRoughness(model) => model.base_color,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_model_has_its_materials_lights_and_cameras() {
    let folder = folder();
    let obj = good(folder.path(), "[[model]]\nfile = \"a.obj\"");
    assert_eq!(obj.meshes[0].normals, Normals::Smooth, "those of the file");
    // Its `m` is not that of the scene file.
    let names: Vec<_> = obj.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["m", "m (2)", "n"]);
    assert_eq!(obj.meshes[0].triangle_materials, [1, 2]);
    let glb = "[[model]]\nfile = \"a.glb\"\n";
    let loaded = load_in(folder.path(), glb).unwrap();
    assert_eq!(base_color(&loaded.scene, 0), [1.0, 0.0, 0.0]);
    assert!(loaded.scene.environment.is_none(), "the scene's light, no studio");
    let cameras: Vec<_> = loaded.cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(cameras, ["camera", "eye"]);
    let [Light::Directional { direction, irradiance }] = loaded.scene.lights[..] else {
        panic!("{:?}", loaded.scene.lights)
    };
    assert_eq!((direction, irradiance), (DVec3::NEG_Z, [3.0; 3]));
    assert!(good(folder.path(), &format!("{glb}lights = false")).lights.is_empty());
    assert_eq!(base_color(&good(folder.path(), &format!("{glb}variant = \"green\"")), 0), [0.0, 1.0, 0.0]);
    assert_eq!(base_color(&good(folder.path(), &format!("{glb}time = 0.5")), 0), [1.0, 0.0, 0.0]);
    let mirror = good(folder.path(), "[[model]]\nfile = \"a.obj\"\nmaterial = \"m\"");
    assert_eq!(mirror.meshes[0].triangle_materials, [0, 0]);
    assert_eq!(mirror.materials[0].surface, Surface::mirror([1.0; 3]));
}

#[test]
fn a_model_is_placed() {
    let folder = folder();
    let of = |place: &str| good(folder.path(), &format!("[[model]]\nfile = \"a.obj\"\n{place}")).meshes.remove(0);
    let plain = corners(&of(""));
    let map = |place: &str, f: &dyn Fn(DVec3) -> DVec3| {
        let mesh = of(place);
        let expected: Vec<_> = plain.iter().map(|&p| f(p)).collect();
        let found = corners(&mesh);
        assert!(found.iter().zip(&expected).all(|(a, b)| a.abs_diff_eq(*b, 1e-12)), "{place}: {found:?}");
        mesh
    };
    map("scale = 2\ntranslate = [1, 2, 3]", &|p| 2.0 * p + DVec3::new(1.0, 2.0, 3.0));
    let stretched = map("scale = [1, 2, 1]\nrotate = [0, 0, 90]", &|p| DVec3::new(-2.0 * p.y, p.x, p.z));
    // The inverse transpose: (0, 0.3, 0.8), turned.
    let normal = DVec3::new(-0.3, 0.0, 0.8).normalize();
    assert!(stretched.vertex_normals.iter().all(|n| n.abs_diff_eq(normal, 1e-12)), "{:?}", stretched.vertex_normals);
    map("matrix = [[0, 1, 0, 5], [0, 0, 1, 6], [1, 0, 0, 7]]", &|p| DVec3::new(p.y + 5.0, p.z + 6.0, p.x + 7.0));
    // Mirrored: corners in another order, so that the front stays outside.
    let mirrored = of("scale = [-1, 1, 1]");
    let [a, b, c] = mirrored.triangles[0].map(|vertex| mirrored.positions[vertex as usize]);
    assert!((b - a).cross(c - a).z > 0.0 && a.min(b).min(c).x == -1.0);
    assert!(mirrored.vertex_normals.iter().all(|n| n.abs_diff_eq(DVec3::new(0.0, 0.6, 0.8), 1e-12)));
    // Light goes along, a camera too.
    let loaded =
        load_in(folder.path(), "[[model]]\nfile = \"a.glb\"\nrotate = [0, 90, 0]\ntranslate = [1, 0, 0]").unwrap();
    let Light::Directional { direction, .. } = loaded.scene.lights[0] else { panic!() };
    assert!(direction.abs_diff_eq(DVec3::NEG_X, 1e-12));
    assert!(loaded.cameras[1].camera.position.abs_diff_eq(DVec3::new(4.0, 0.0, 0.0), 1e-12));
}

#[test]
fn instances_are_copies() {
    let folder = folder();
    let scene = good(
        folder.path(),
        "[[mesh]]\nname = \"square\"\nfile = \"a.obj\"\nscale = 2\n[[model]]\nname = \"lamp\"\nfile = \"a.glb\"\n\
         [[instance]]\nof = \"square\"\ntranslate = [10, 0, 0]\n[[instance]]\nof = \"lamp\"\nscale = 3\n\
         [[instance]]\nof = \"square\"\nmatrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4]]\n",
    );
    assert_eq!((scene.meshes.len(), scene.lights.len()), (5, 2));
    let [square, lamp, moved, large, behind] = &scene.meshes[..] else { panic!() };
    let pairs = |a: &Mesh, b: &Mesh| corners(a).into_iter().zip(corners(b)).collect::<Vec<_>>();
    // From where the original is.
    assert!(pairs(square, moved).iter().all(|(a, b)| *a + 10.0 * DVec3::X == *b));
    assert!(pairs(square, behind).iter().all(|(a, b)| *a + 4.0 * DVec3::Z == *b));
    assert!(pairs(lamp, large).iter().all(|(a, b)| *a * 3.0 == *b));
    assert_eq!(square.triangle_materials, moved.triangle_materials);
    assert_eq!(corners(square)[1], DVec3::new(2.0, 0.0, 0.0));
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let folder = folder();
    let model = "[[model]]\nfile = \"a.obj\"\n";
    let named = "[[mesh]]\nname = \"a\"\nfile = \"a.obj\"\n";
    fs::write(folder.path().join("bad.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
    for (tables, words) in [
        ("[[model]]\nfile = \"gone.glb\" #!".to_owned(), "model 1: "),
        (
            "[[model]]\nfile = \"a.mtl\" #!".to_owned(),
            "model 1: file is \"a.mtl\", expected a file whose name ends in .gltf, .glb or .obj",
        ),
        ("[[model]]\nfile = \"bad.obj\" #!".to_owned(), "bad.obj:2: vertex 2 of a face"),
        ("[[model]] #!\nscale = 2".to_owned(), "model 1: `file` is missing"),
        (
            format!("{model}material = \"x\" #!"),
            "model 1: material is \"x\", expected the name of a [[material]]: \"m\"",
        ),
        (format!("{model}variant = \"x\" #!"), "model 1: variant is given, expected none for an OBJ file"),
        (format!("{model}time = 1 #!"), "model 1: time is given"),
        ("[[model]]\nvariant = \"x\"\nfile = \"a.glb\" #!".to_owned(), "variant: \"x\", expected one of [\"green\"]"),
        (format!("{model}scale = 0 #!"), "model 1: scale is of determinant 0"),
        (format!("{model}scale = 1e-60 #!"), "model 1: scale is one that leaves no triangle an area"),
        (format!("{model}scale = [1, 2] #!"), "a number or an array of three"),
        (format!("{model}scale = \"big\" #!"), "model 1: scale: "),
        (format!("{model}rotate = [0, nan, 0] #!"), "model 1: rotate is [0, NaN, 0]"),
        (format!("{model}matrix = [[1, 0, 0, 0]] #!"), "an array of three rows of four numbers"),
        (format!("{model}matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]] #!"), "a row of four numbers"),
        (
            format!("{model}matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]] #!"),
            "model 1: matrix is of determinant 0",
        ),
        (
            format!("{model}matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\nscale = 2 #!"),
            "scale is given, expected none beside matrix",
        ),
        (format!("{model}lights = 1 #!"), "model 1: lights"),
        (
            format!("{named}[[model]]\nname = \"a\" #!\nfile = \"a.obj\""),
            "model 1: name is \"a\", expected a name that no earlier mesh or model has",
        ),
        (
            format!("{named}[[instance]]\nof = \"b\" #!"),
            "instance 1: of is \"b\", expected the name of a [[mesh]] or [[model]]: \"a\"",
        ),
        (format!("{model}[[instance]]\nof = \"a\" #!"), "of which none has a name"),
        (format!("{named}[[instance]] #!\nscale = 2"), "instance 1: `of` is missing"),
        (format!("{named}[[instance]]\nof = \"a\"\ncount = 2 #!"), "instance 1: unknown field `count`"),
    ] {
        let text = format!("{HEAD}{tables}\n");
        let line = text.lines().position(|line| line.contains("#!")).unwrap() + 1;
        let message = load_in(folder.path(), &tables).expect_err(&tables).to_string();
        assert!(
            message.starts_with(&format!("scene.toml:{line}:")) && message.contains(words),
            "{message}: {words}\n{tables}"
        );
    }
    let far =
        load_in(folder.path(), &format!("{model}scale = 1e20\ntranslate = [1e30, 0, 0]")).unwrap_err().to_string();
    assert!(far.contains("model 1: a vertex is ") && far.contains("<= 1e30"), "{far}");
}
