//! Scene files: what is accepted and what it means, and the message for each kind of bad input.

use std::fs;
use std::path::Path;

use photolith::Scene;
use photolith::scene::{
    Bsdf, Conductor, Film, Integrator, Light, Loaded, MetallicRoughness, PixelFilter, Reflection, SceneError, Sphere,
    Surface, Transfer,
};

const CAMERA: &str = "[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\nhorizontal_fov = 40\n";
const WHITE: &str = "[[material]]\nname = \"white\"\ntype = \"diffuse\"\nreflectance = [0.8, 0.8, 0.8]\n";
const BALL: &str = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"white\"\n";
const LIGHT: &str = "[[light]]\ntype = \"point\"\nposition = [0, 9, 0]\npower = [1, 1, 1]\n";

/// A good scene, with `extra` after it.
fn good(extra: &str) -> String {
    format!("version = 1\n{CAMERA}{WHITE}{BALL}{LIGHT}{extra}")
}

fn load_text(text: &str) -> Result<Loaded, SceneError> {
    Scene::from_toml_str(text, "scene.toml", None)
}

/// Asserts that loading fails with a message that starts with the file and the line marked `#!`, and has the words.
fn assert_rejected(text: &str, words: &[&str]) {
    let marked = text.lines().position(|line| line.contains("#!")).map(|index| index + 1);
    let message = load_text(text).expect_err(text).to_string();
    let place = marked.map_or("scene.toml: ".to_owned(), |line| format!("scene.toml:{line}:"));
    assert!(message.starts_with(&place), "{message:?} should start with {place:?}\n{text}");
    for word in words {
        assert!(message.contains(word), "{message:?} should contain {word:?}\n{text}");
    }
    assert!(!message.contains('\n'), "{message:?} should be one line");
}

/// Replaces a part of the good scene, which must be there.
fn changed(from: &str, to: &str) -> String {
    let text = good("");
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

#[test]
fn syntax_and_structure() {
    assert_rejected(&changed("version = 1", "version = #!"), &["expected"]);
    assert_rejected(&changed("version = 1", "vers ion = 1 #!"), &["expected"]);
    assert_rejected(
        &changed("radius = 1", "radius = 1\nradius = 2 #!"),
        &["sphere 1: `radius` is there twice, expected once"],
    );
    assert_rejected(&changed("radius = 1", "radius = 1e #!"), &["sphere 1"]);
    assert_rejected(
        &changed("[0, 9, 0]\npower = [1, 1, 1]", "[0, 9, 0\npower = [1, 1, 1] #!"),
        &["light 1: ", "array"],
    );
    assert_rejected(&good("\"\\q\" = 1 #!"), &["escape"]);
    assert_rejected(&changed("radius = 1", "radus = 1 #!"), &["sphere 1", "radus", "expected", "radius"]);
    assert_rejected(&good("[[sfere]] #!\nradius = 1"), &["unknown field", "sfere", "sphere"]);
    assert_rejected(&good("[film]\nfocus = 3 #!"), &["film", "focus", "expected", "width"]);
    assert_rejected(&good("[sphere] #!"), &["`sphere` is there twice"]);
    assert_rejected(&changed("[camera]", "[[camera]] #!"), &["camera: ", "array", "expected one table: [camera]"]);
    assert_rejected(&changed("[[sphere]]", "[sphere] #!"), &["sphere: ", "table", "expected an array of tables"]);
    assert_rejected(&format!("sphere = [[0, 1]] #!\nversion = 1\n{CAMERA}"), &["sphere 1: ", "expected a table"]);
    assert_rejected(&changed("radius = 1\n", "").replace("[[sphere]]", "[[sphere]] #!"), &["sphere 1", "`radius`"]);
    assert_rejected(
        &changed("horizontal_fov = 40", "").replace("[camera]", "[camera] #!"),
        &["horizontal_fov is missing"],
    );
    assert_rejected(
        &format!("version = 1 #!\n{WHITE}{BALL}"),
        &["`camera` is missing, expected a table [camera] with position"],
    );
    assert_rejected("#!", &["`version` is missing"]);
}

#[test]
fn versions() {
    assert_rejected(&changed("version = 1", "#!"), &["`version` is missing, expected version = 1"]);
    assert_rejected(&changed("version = 1", "version = 2 #!"), &["version is 2, expected 1"]);
    // The version is blamed before keys that it may have brought.
    assert_rejected(&changed("version = 1", "version = 0x10 #!\nshutter = 1"), &["version is 16, expected 1"]);
    assert_rejected(&changed("version = 1", "version = \"1\" #!"), &["version", "string \"1\"", "expected"]);
}

#[test]
fn wrong_types() {
    assert_rejected(
        &changed("radius = 1", "radius = \"big\" #!"),
        &["sphere 1: radius", "string \"big\"", "expected a number"],
    );
    assert_rejected(&changed("[0, 0, 5]", "[0, 0] #!"), &["camera: position", "length 2", "three numbers"]);
    assert_rejected(&changed("[0, 0, 5]", "[0, 0, 5, 6] #!"), &["camera: position", "length 4", "three numbers"]);
    assert_rejected(&changed("[0, 9, 0]", "[0, true, 0] #!"), &["light 1: position", "boolean `true`"]);
    assert_rejected(&changed("\"point\"", "\"sun\" #!"), &["light 1: type", "sun", "expected one of `point`"]);
    assert_rejected(&changed("\"diffuse\"", "\"metal\" #!"), &["material 1: type", "metal", "expected", "`mirror`"]);
    assert_rejected(&good("[film]\nfilter = \"tent\" #!"), &["film: filter", "tent", "`gaussian` or `box`"]);
    assert_rejected(&good("[film]\ngamma = \"rgb\" #!"), &["film: gamma", "rgb", "a number > 0 or \"srgb\""]);
    assert_rejected(&good("[film]\nwidth = 5.5 #!"), &["film: width", "5.5"]);
    assert_rejected(&good("[film]\nwidth = 99999999999999999999 #!"), &["film: width"]);
    assert_rejected(&good("[integrator]\nrussian_roulette = \"on\" #!"), &["an integer >= 1 or \"off\""]);
    assert_rejected(&good("[integrator]\nindirect = 1 #!"), &["integrator: indirect", "boolean"]);
}

#[test]
fn camera_film_and_integrator_values() {
    assert_rejected(&changed("[0, 0, 5]", "[0, nan, 5] #!"), &["camera: position is [0, NaN, 5], expected", "finite"]);
    assert_rejected(&changed("[0, 0, 5]", "[0, 0, inf] #!"), &["camera: position", "finite"]);
    assert_rejected(&changed("[0, 0, 5]", "[0, 0, 2e30] #!"), &["camera: position is [0, 0, 2e30]", "<= 1e30"]);
    assert_rejected(
        &changed("target = [0, 0, 0]", "target = [0, 0, 5] #!"),
        &["camera: target", "apart from position"],
    );
    assert_rejected(&changed("target", "up = [0, 0, -3] #!\ntarget"), &["camera: up is [0, 0, -3]", "parallel"]);
    assert_rejected(&changed("target", "up = [0, 0, 0] #!\ntarget"), &["camera: up", "non-zero length"]);
    for fov in ["0", "180", "-10", "nan", "inf"] {
        let text = changed("horizontal_fov = 40", &format!("horizontal_fov = {fov} #!"));
        assert_rejected(&text, &["camera: horizontal_fov is", "between 0 and 180 degrees"]);
    }
    for (key, value, words) in [
        ("film", "width = 0", "width is 0, expected an integer from 1 to 65536"),
        ("film", "height = -4", "height is -4, expected an integer from 1 to 65536"),
        ("film", "height = 65537", "height is 65537, expected an integer from 1 to 65536"),
        ("film", "gamma = 0", "gamma is 0, expected a finite number > 0"),
        ("film", "gamma = nan", "gamma is NaN, expected a finite number > 0"),
        ("integrator", "max_depth = 0", "max_depth is 0, expected an integer from 1 to 65535"),
        ("integrator", "max_depth = 65536", "max_depth is 65536, expected an integer from 1 to 65535"),
        ("integrator", "samples = 536870913", "samples is 536870913, expected an integer from 1 to 536870912"),
        ("integrator", "samples = 0", "samples is 0, expected an integer from 1 to"),
        ("integrator", "samples = 4294967296", "samples is 4294967296, expected an integer from 1 to 536870912"),
        ("integrator", "russian_roulette = 0", "russian_roulette is 0, expected an integer from 1"),
        ("background", "radiance = [0, 0, -1]", "radiance is [0, 0, -1], expected three finite numbers >= 0"),
        ("background", "radiance = [inf, 0, 0]", "radiance is [inf, 0, 0], expected three finite numbers >= 0"),
    ] {
        assert_rejected(&good(&format!("[{key}]\n{value} #!")), &[&format!("{key}: {words}")]);
    }
}

#[test]
fn material_sphere_and_light_values() {
    for (from, to, words) in [
        ("radius = 1", "radius = -1", "sphere 1: radius is -1, expected a finite number > 0"),
        ("radius = 1", "radius = 0", "sphere 1: radius is 0, expected a finite number > 0"),
        ("radius = 1", "radius = nan", "sphere 1: radius is NaN, expected a finite number > 0"),
        ("radius = 1", "radius = 1e-31", "sphere 1: radius is 1e-31, expected a number of at least 1e-30"),
        ("radius = 1", "radius = 1e31", "sphere 1: radius is 1e31, expected a number <= 1e30"),
        ("center = [0, 0, 0]", "center = [0, -inf, 0]", "sphere 1: center is [0, -inf, 0]"),
        ("material = \"white\"", "material = \"whit\"", "sphere 1: material is \"whit\", expected the name of"),
        ("[0.8, 0.8, 0.8]", "[0.8, 1.1, 0.8]", "material 1: reflectance is [0.8, 1.1, 0.8], expected three numbers"),
        ("[0.8, 0.8, 0.8]", "[0.8, -0.1, 0.8]", "material 1: reflectance is [0.8, -0.1, 0.8], expected"),
        ("[0.8, 0.8, 0.8]", "[0.8, nan, 0.8]", "material 1: reflectance is [0.8, NaN, 0.8], expected"),
        ("[0, 9, 0]", "[0, 1e31, 0]", "light 1: position is [0, 1e31, 0]"),
        ("[1, 1, 1]", "[1, -1, 1]", "light 1: power is [1, -1, 1], expected three finite numbers >= 0"),
        ("[1, 1, 1]", "[1, nan, 1]", "light 1: power is [1, NaN, 1]"),
        ("[1, 1, 1]", "[1, 1e39, 1]", "light 1: power is [1, 1e39, 1]"),
    ] {
        assert_rejected(&changed(from, &format!("{to} #!")), &[words]);
    }
    let second = "[[material]]\nname = \"b\"\n";
    for (keys, words) in [
        ("type = \"dielectric\"\nior = 0 #!", "material 2: ior is 0, expected a number from 0.001 to 1000"),
        ("type = \"dielectric\"\nior = -1.5 #!", "material 2: ior is -1.5"),
        ("type = \"dielectric\"\nior = nan #!", "material 2: ior is NaN"),
        // Would be 0 in single precision.
        ("type = \"dielectric\"\nior = 1e-50 #!", "material 2: ior is 1e-50, expected a number from 0.001 to 1000"),
        ("type = \"dielectric\"\nior = 1000.1 #!", "material 2: ior is 1000.1"),
        ("type = \"dielectric\"\nior = 1.5\nroughness = 1.5 #!", "material 2: roughness is 1.5"),
        ("type = \"dielectric\"\nior = 1.5\nthin = true #!", "material 2: thin is given, expected none"),
        ("type = \"pbr\"\nthin = true #!", "material 2: thin is given, expected none"),
        ("type = \"pbr\"\ntransmission = 2 #!", "material 2: transmission is 2, expected a number from 0 to 1"),
        (
            "type = \"pbr\"\ntransmission = 1\nattenuation_distance = 0 #!\nattenuation_color = [1, 1, 1]",
            "material 2: attenuation_distance is 0, expected a number > 0",
        ),
        (
            "type = \"pbr\"\ntransmission = 1\nthin = true\nattenuation_distance = 1\nattenuation_color = [1, 1, 1] #!",
            "material 2: attenuation_color is given, expected none",
        ),
        ("type = \"mirror\"\ntransmission = 1 #!", "material 2: transmission is given, expected none"),
        ("type = \"emitter\"\nradiance = [1, -2, 1] #!", "material 2: radiance is [1, -2, 1]"),
        ("type = \"mirror\"\nreflectance = [2, 1, 1] #!", "material 2: reflectance is [2, 1, 1]"),
        ("type = \"mirror\"\nior = 1.5 #!", "material 2: ior is given, expected none"),
        ("type = \"diffuse\"\nreflectance = [0, 0, 0]\nradiance = [1, 1, 1] #!", "material 2: radiance is given"),
    ] {
        assert_rejected(&good(&format!("{second}{keys}")), &[words]);
    }
    let missing = good("[[material]] #!\nname = \"b\"\ntype = \"dielectric\"");
    assert_rejected(&missing, &["material 2: ior is missing"]);
    let half = format!("{missing}\nior = 1.5\nattenuation_distance = 2");
    assert_rejected(&half, &["material 2: attenuation_color is missing"]);
    let unnamed = good("[[material]]\nname = \"\" #!\ntype = \"mirror\"");
    assert_rejected(&unnamed, &["material 2: name is empty"]);
    let duplicate = good("[[material]]\nname = \"white\" #!\ntype = \"mirror\"");
    assert_rejected(&duplicate, &["material 2: name is \"white\"", "no earlier material"]);
    let third = format!("{BALL}{}", BALL.replace("radius = 1", "radius = -3 #!"));
    assert_rejected(&good(&third), &["sphere 3: radius is -3"]);
    // Also where all spheres are on one line.
    let inline = "sphere = [ { center = [0, 0, 0], radius = -1, material = \"white\" } ] #!\n";
    let text = format!("version = 1\n{inline}{CAMERA}{WHITE}");
    assert_rejected(&text, &["scene.toml:2:43: sphere 1: radius is -1"]);
}

#[test]
fn empty_scenes() {
    assert_rejected(&format!("version = 1\n{CAMERA}{WHITE}"), &["empty scene", "expected"]);
}

#[test]
fn mesh_tables() {
    let mesh = |keys: &str| good(&format!("[[mesh]]\n{keys}\n"));
    assert_rejected(&mesh("file = \"a.stl\" #!"), &["mesh 1: file is \"a.stl\"", "ends in .obj"]);
    assert_rejected(&mesh("file = \"a.obj\"\nscale = 0 #!"), &["mesh 1: scale is 0, expected a finite number > 0"]);
    assert_rejected(&mesh("file = \"a.obj\"\nscale = [1, 1, 1] #!"), &["mesh 1: scale", "array"]);
    assert_rejected(&mesh("file = \"a.obj\"\nrotate = [0, nan, 0] #!"), &["mesh 1: rotate is [0, NaN, 0]"]);
    assert_rejected(&mesh("file = \"a.obj\"\ntranslate = [1e99, 0, 0] #!"), &["mesh 1: translate is [1e99, 0, 0]"]);
    assert_rejected(&mesh("file = \"a.obj\"\nnormals = \"soft\" #!"), &["mesh 1: normals", "`flat` or `smooth`"]);
    assert_rejected(&mesh("file = \"a.obj\"\nmaterial = \"red\" #!"), &["mesh 1: material is \"red\"", "\"white\""]);
    assert_rejected(&mesh("file = \"a.obj\" #!"), &["mesh 1: a.obj: cannot be read"]);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let line_of_mesh = good("").lines().count() + 1;
    // Line of the message counted from the mesh's, and what follows it.
    let message = |obj: Option<&str>, keys: &str, line: usize| {
        if let Some(text) = obj {
            fs::write(folder.path().join("a.obj"), text).unwrap();
        }
        fs::write(&path, mesh(&format!("file = \"a.obj\"\n{keys}"))).unwrap();
        let message = Scene::load(&path).unwrap_err().to_string();
        assert!(message.starts_with(&format!("{}:{}:", path.display(), line_of_mesh + line)), "{message}");
        message
    };
    let missing = message(None, "", 1);
    assert!(missing.contains("mesh 1: ") && missing.contains("a.obj: cannot be read: "), "{missing}");
    let bad_index = message(Some("v 0 0 0\nv 1 0 0\nf 1 2 3\n"), "", 1);
    assert!(bad_index.contains("a.obj:3: vertex 3 of a face, expected at most 2"), "{bad_index}");
    let empty = message(Some("v 0 0 0\n"), "", 1);
    assert!(empty.contains("a.obj: empty mesh: 0 faces"), "{empty}");
    let too_large = message(Some("v 0 0 0\nv 1e20 0 0\nv 0 1e20 0\nf 1 2 3\n"), "scale = 1e20", 0);
    assert!(too_large.contains("mesh 1: vertex 2 is [1e40, 0, 0], expected three finite numbers"), "{too_large}");
}

#[test]
fn files_that_cannot_be_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let message = |name: &str| {
        let path = folder.path().join(name);
        let message = Scene::load(&path).unwrap_err().to_string();
        assert!(message.starts_with(&path.display().to_string()), "{message}");
        message
    };
    assert!(message("none.toml").contains("cannot be read: "));
    assert!(message("none.obj").contains("cannot be read: "));
    fs::create_dir(folder.path().join("folder.toml")).unwrap();
    assert!(message("folder.toml").contains("folder, expected a file"));
    assert!(message("image.png").contains("expected a name that ends in .toml (scene), .gltf, .glb or .obj (model)"));
    assert!(message("noextension").contains("expected a name that ends in .toml"));
    fs::write(folder.path().join("latin.toml"), b"version = 1\n# caf\xe9\n").unwrap();
    assert!(message("latin.toml").contains("latin.toml:2:6: not UTF-8"));
    fs::write(folder.path().join("empty.toml"), b"").unwrap();
    assert!(message("empty.toml").contains("`version` is missing"));
    fs::write(folder.path().join("empty.obj"), b"").unwrap();
    assert!(message("empty.obj").contains("empty mesh"));
}

#[test]
fn defaults() {
    let Loaded { scene, warnings, .. } = load_text(&good("")).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(scene.camera.up.to_array(), [0.0, 1.0, 0.0]);
    let film = Film {
        width: 512,
        height: 512,
        filter: PixelFilter::Gaussian,
        transfer: Transfer::Gamma(2.2),
        ..Film::default()
    };
    assert_eq!(scene.film, film);
    let integrator = Integrator { max_depth: 8, samples: 64, russian_roulette: Some(4), indirect: true };
    assert_eq!(scene.integrator, integrator);
    assert_eq!(scene.background, [0.0; 3]);
    assert!(!scene.spheres[0].inward);
    assert_eq!(scene.source, "scene.toml");
}

#[test]
fn all_keys() {
    let extra = "[film]\nwidth = 3\nheight = 4\nfilter = \"box\"\ngamma = \"srgb\"\n\
        [integrator]\nmax_depth = 2\nsamples = 7\nrussian_roulette = \"off\"\nindirect = false\n\
        [background]\nradiance = [1, 2.5, 0]\n\
        [[material]]\nname = \"m\"\ntype = \"mirror\"\n\
        [[material]]\nname = \"g\"\ntype = \"dielectric\"\nior = 1.5\n\
        [[material]]\nname = \"e\"\ntype = \"emitter\"\nradiance = [4, 5, 6]\n\
        [[sphere]]\ncenter = [1.5, -2, 3e2]\nradius = 0.25\nmaterial = \"g\"\ninward = true\n";
    let loaded = load_text(&good(extra)).unwrap();
    let scene = &loaded.scene;
    let film = Film { width: 3, height: 4, filter: PixelFilter::Box, transfer: Transfer::Srgb, ..Film::default() };
    assert_eq!(scene.film, film);
    let integrator = Integrator { max_depth: 2, samples: 7, russian_roulette: None, indirect: false };
    assert_eq!(scene.integrator, integrator);
    assert_eq!(scene.background, [1.0, 2.5, 0.0]);
    assert_eq!(scene.materials[0].name, "white");
    assert_eq!(scene.materials[0].surface, Surface::diffuse([0.8; 3]));
    assert_eq!(scene.materials[1].surface, Surface::mirror([1.0; 3]));
    assert_eq!(scene.materials[2].surface, Surface::dielectric(1.5));
    assert_eq!(scene.materials[3].surface, Surface::emitter([4.0, 5.0, 6.0]));
    let glass = Sphere { center: [1.5, -2.0, 300.0].into(), radius: 0.25, material: 2, inward: true };
    assert_eq!(scene.spheres[1], glass);
    assert_eq!(scene.lights, [Light::Point { position: [0.0, 9.0, 0.0].into(), power: [1.0; 3] }]);
    assert_eq!(load_text(&good(extra).replace('\n', "\r\n")).unwrap(), loaded);
}

#[test]
fn glass_that_is_rough_or_absorbs_light() {
    let extra = "[[material]]\nname = \"smooth\"\ntype = \"dielectric\"\nior = 1.3\nroughness = 0\n\
        [[material]]\nname = \"rough\"\ntype = \"dielectric\"\nior = 0.8\nroughness = 0.5\n\
        [[material]]\nname = \"amber\"\ntype = \"dielectric\"\nior = 1.5\n\
        attenuation_color = [0.9, 0.5, 0]\nattenuation_distance = 2\n\
        [[material]]\nname = \"wall\"\ntype = \"pbr\"\ntransmission = 0.5\nthin = true\nroughness = 0.25\n\
        [[material]]\nname = \"body\"\ntype = \"pbr\"\ntransmission = 1\nattenuation_color = [1, 0.5, 1]\nattenuation_distance = 3\n";
    let scene = load_text(&good(extra)).unwrap().scene;
    assert_eq!(scene.materials[1].surface, Surface::dielectric(1.3));
    let models: Vec<_> = scene.materials[2..]
        .iter()
        .map(|material| match material.surface.bsdf {
            Bsdf::MetallicRoughness(model) => model,
            other => panic!("{other:?}"),
        })
        .collect();
    let clear =
        MetallicRoughness { metallic: 0.0, transmission: 1.0, has_volume: true, ..MetallicRoughness::default() };
    assert_eq!(models[0], MetallicRoughness { ior: 0.8, roughness: 0.5, ..clear });
    let (attenuation_color, attenuation_distance) = ([0.9, 0.5, 0.0], 2.0);
    assert_eq!(models[1], MetallicRoughness { roughness: 0.0, attenuation_color, attenuation_distance, ..clear });
    let [red, green, blue] = models[1].absorption();
    assert!((red + 0.9f64.ln() / 2.0).abs() < 1e-12 && (green + 0.5f64.ln() / 2.0).abs() < 1e-12);
    assert!(blue > 40.0 && blue.is_finite(), "nothing is left of it");
    assert_eq!(models[2], MetallicRoughness { transmission: 0.5, has_volume: false, roughness: 0.25, ..clear });
    assert!(models[3].has_volume && models[3].attenuation_distance == 3.0);
}

#[test]
fn darkness_is_a_warning() {
    let dark = load_text(&good("").replace("[1, 1, 1]", "[0, 0, 0]")).unwrap();
    assert!(
        matches!(&dark.warnings[..], [w] if w.contains("scene.toml") && w.contains("black")),
        "{:?}",
        dark.warnings
    );
    let emitter = "[[material]]\nname = \"emitter\"\ntype = \"emitter\"\nradiance = [1, 1, 1]\n";
    let text = format!("version = 1\n{CAMERA}{WHITE}{BALL}{emitter}");
    assert_eq!(load_text(&text).unwrap().warnings.len(), 1, "an emitter that nothing is made of");
    assert!(load_text(&text.replace("material = \"white\"", "material = \"emitter\"")).unwrap().warnings.is_empty());
    assert!(load_text(&format!("{text}[background]\nradiance = [0, 0, 0.1]")).unwrap().warnings.is_empty());
}

#[test]
fn shipped_scenes_load_as_the_report_has_them() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let Loaded { scene, warnings, .. } = Scene::load(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(warnings.is_empty(), "{warnings:?}");
        count += 1;
        if path.ends_with("cornell.toml") {
            continue;
        }
        assert_eq!(scene.camera.position.to_array(), [0.0, 0.0, 55.0]);
        assert_eq!(scene.camera.horizontal_fov, 60.0);
        assert_eq!(scene.integrator.russian_roulette, None);
        assert_eq!(scene.integrator.indirect, !path.ends_with("direct.toml"));
        assert_eq!(scene.lights, [Light::Point { position: [-10.0, 20.0, 40.0].into(), power: [30000.0; 3] }]);
        // Every body stands on the floor, which is at y = -10 under the origin.
        for sphere in &scene.spheres[6..] {
            assert!(sphere.center.y - sphere.radius >= -10.0, "{path:?}");
        }
        for mesh in &scene.meshes {
            let lowest = mesh.positions.iter().fold(f64::INFINITY, |lowest, p| lowest.min(p.y));
            assert!((lowest + 10.0).abs() < 0.1, "{path:?}: {lowest}");
        }
    }
    assert_eq!(count, 8);
}

fn warnings_of(text: &str) -> Vec<String> {
    Scene::from_toml_str(text, "scene.toml", None).unwrap_or_else(|error| panic!("{error}\n{text}")).warnings
}

/// What would not be seen as it is described is told of with its line.
#[test]
fn what_single_precision_cannot_carry_is_told() {
    let line_of = |text: &str, key: &str| text.lines().position(|line| line.starts_with(key)).unwrap() + 1;
    assert_eq!(warnings_of(&good("")), [""; 0]);
    // A floor of any radius, and a wall around everything, are rendered well.
    for radius in [1e4, 8e7, 1e15] {
        let center = -radius - 1.0;
        let floor = format!("[[sphere]]\ncenter = [0, {center}, 0]\nradius = {radius}\nmaterial = \"white\"\n");
        assert_eq!(warnings_of(&good(&floor)), [""; 0], "{radius}");
    }
    for (sphere, words) in [
        ("center = [0, 0, -1e9]\nradius = 1", "sphere 2: radius is 1, at a distance of 1.0e9 from the camera"),
        (
            "center = [1e30, 0, 0]\nradius = 1e-30",
            "sphere 2: radius is 1e-30, too small beside the extent of the scene",
        ),
    ] {
        let text = good(&format!("[[sphere]]\nmaterial = \"white\"\n{sphere}\n"));
        let warnings = warnings_of(&text);
        assert!(warnings.iter().any(|warning| warning.contains(words)), "{warnings:?}");
    }
    // A sky so large that the ball in it is lost.
    let sky = good("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1e25\ninward = true\nmaterial = \"white\"\n");
    let at = line_of(&sky, "radius = 1");
    let warnings = warnings_of(&sky);
    assert!(warnings[0].starts_with(&format!("scene.toml:{at}:")), "{warnings:?}");
    assert!(
        warnings[0].contains("sphere 1: radius is 1, too small beside the extent of the scene, 1e25"),
        "{warnings:?}"
    );
    // A light just above a surface that is far away.
    let near = changed("[0, 9, 0]", "[0, 1.0000001, -1e4]").replace("center = [0, 0, 0]", "center = [0, 0, -1e4]");
    assert!(
        warnings_of(&near).iter().any(|warning| warning.contains("light 1: its distance from the nearest surface"))
    );
}

#[test]
fn emitters_that_shine_away_from_everything_are_told() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("emitter.obj"), "v -1 3 -1\nv 1 3 -1\nv 1 3 1\nv -1 3 1\nf 1 2 3 4\n").unwrap();
    let emitter = "[[material]]\nname = \"emitter\"\ntype = \"emitter\"\nradiance = [1, 1, 1]\n\
                [[mesh]]\nfile = \"emitter.obj\"\nmaterial = \"emitter\"\n";
    let warnings = |text: &str| Scene::from_toml_str(text, "scene.toml", Some(folder.path())).unwrap().warnings;
    assert_eq!(warnings(&good(emitter)), [""; 0], "it shines down");
    let turned = good(&format!("{emitter}rotate = [180, 0, 0]\ntranslate = [0, 6, 0]\n"));
    let found = warnings(&turned);
    assert!(
        matches!(&found[..], [w] if w.contains("mesh 1: the emitter \"emitter\" shines away from the camera")),
        "{found:?}"
    );
    // A ceiling that it lies in gets no light either; one that is well above it does.
    let ceiling = "v -4 3.001 -4\nv 4 3.001 -4\nv 4 3.001 4\nv -4 3.001 4\nf 1 2 3 4\n";
    for (height, count) in [("3.001", 1), ("4", 0)] {
        fs::write(folder.path().join("ceiling.obj"), ceiling.replace("3.001", height)).unwrap();
        let text = format!("{turned}[[mesh]]\nfile = \"ceiling.obj\"\nmaterial = \"white\"\n");
        assert_eq!(warnings(&text).len(), count, "{height}");
    }
    let sphere = |keys: &str| good(&format!("{emitter}[[sphere]]\nmaterial = \"emitter\"\n{keys}\n"));
    assert_eq!(warnings(&sphere("center = [0, 20, 0]\nradius = 1")), [""; 0]);
    assert!(warnings(&sphere("center = [0, 20, 0]\nradius = 1\ninward = true"))[0].contains("sphere 2: the emitter"));
    assert!(warnings(&sphere("center = [0, 0, 0]\nradius = 100"))[0].contains("sphere 2: the emitter"));
    assert_eq!(warnings(&sphere("center = [0, 0, 0]\nradius = 100\ninward = true")), [""; 0]);
}

/// Every message says what is there and what should be.
#[test]
fn messages_of_the_parser_name_what_is_there() {
    for (line, words) in [
        ("[film]\nwidth 5 #!", "found `5`: key with no value, expected `=`"),
        ("[film]\nwidth = #!", "found the end of the line, expected a number"),
        ("[film]\nwidth = 012 #!", "found `012`: unexpected leading zero, expected a number"),
        ("[film]\nwidth = 1__0 #!", "found `1__0`: "),
        ("[film]\nwidth = 99999999999999999999 #!", "integer `99999999999999999999`, expected an integer of 64 bits"),
        ("[film]\ngamma = 1e999 #!", "found the number `1e999`, expected one of magnitude <= 1e30"),
        ("[film]\ngamma = wide #!", "found `wide`, expected a number, true, false, an array or a string"),
        ("[integrator]\nindirect = yes #!", "found `yes`, expected a number, true, false"),
        ("[[sphere]] #!\nradius = 1", "sphere 2: `center` is missing, expected three numbers"),
        ("[[material]] #!\nname = \"b\"", "material 2: `type` is missing, expected a type"),
        ("[background]\nradiance = 2020-01-01 #!", "table or date, expected an array of three numbers"),
    ] {
        assert_rejected(&good(line), &[words]);
    }
}

#[test]
fn a_text_tells_which_kind_of_scene_it_is() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for text in [good(""), format!("\u{feff}\n# c\n{}", good("")), format!("# v 1 2 3\n\n{}", good(""))] {
        assert_eq!(Scene::from_bytes(text.as_bytes(), "stdin", None).unwrap().scene.spheres.len(), 1);
    }
    for text in [obj.to_owned(), format!("# a = b\r\no a = b\r\n{obj}"), format!("mtllib a=b.mtl\n{obj}")] {
        assert_eq!(Scene::from_bytes(text.as_bytes(), "stdin", None).unwrap().scene.triangle_count(), 1, "{text}");
    }
    assert!(Scene::from_bytes(b"", "stdin", None).unwrap_err().to_string().contains("is it an OBJ file?"));
}

#[test]
fn cameras_with_lenses_and_parallel_rays() {
    let of = |camera: &str| load_text(&changed("horizontal_fov = 40", camera)).unwrap().scene.camera;
    let plain = of("horizontal_fov = 40");
    assert!(plain.is_pinhole() && plain.orthographic_width.is_none());
    let parallel = of("type = \"orthographic\"\nwidth = 3");
    assert_eq!(parallel.orthographic_width, Some(3.0));
    let lens = of("horizontal_fov = 40\nlens_radius = 0.1").lens.unwrap();
    assert_eq!((lens.radius, lens.focus), (0.1, 5.0));
    let lens = of("horizontal_fov = 40\nf_number = 2\nfocal_length_mm = 50\nfocus = 3").lens.unwrap();
    assert!((lens.radius - 0.0125).abs() < 1e-15 && lens.focus == 3.0);
    // 18 mm over the tangent of half the angle.
    let lens = of("horizontal_fov = 90\nf_number = 2\nfocus = \"target\"").lens.unwrap();
    assert!((lens.radius - 0.0045).abs() < 1e-15);
    assert!(of("horizontal_fov = 40\nlens_radius = 0").is_pinhole());
    for (camera, said) in [
        ("width = 3 #!", ["horizontal_fov is missing", "a perspective camera"]),
        ("type = \"orthographic\" #!", ["width is missing", "an orthographic camera"]),
        ("type = \"orthographic\"\nwidth = -1 #!", ["width is -1", "> 0"]),
        ("type = \"orthographic\"\nwidth = 1\nhorizontal_fov = 40 #!", ["horizontal_fov is 40", "width instead"]),
        ("horizontal_fov = 40\nlens_radius = 1\nf_number = 2 #!", ["f_number is 2", "lens_radius"]),
        ("horizontal_fov = 40\nlens_radius = 1\nfocus = 0 #!", ["focus is 0", "> 0"]),
        ("horizontal_fov = 40\nfocus = 1 #!", ["focus", "lens_radius or f_number"]),
    ] {
        let text = changed("horizontal_fov = 40", camera);
        let error = load_text(&text).unwrap_err().to_string();
        assert!(said.iter().all(|part| error.contains(part)), "{camera}: {error}");
    }
}

#[test]
fn exposure_and_tone_of_the_film() {
    use photolith::scene::{Exposure, Tone};
    let of = |film: &str| load_text(&good(&format!("[film]\n{film}\n")));
    let film = of("exposure = \"auto\"\ntone = \"agx\"\ntransparent = true").unwrap().scene.film;
    assert_eq!((film.exposure, film.tone, film.transparent), (Exposure::Auto, Tone::Agx, true));
    assert_eq!(of("exposure = -1").unwrap().scene.film.exposure, Exposure::Stops(-1.0));
    for (film, said) in
        [("exposure = \"bright\"", "or \"auto\""), ("exposure = 65", "-64 to 64"), ("tone = \"x\"", "neutral")]
    {
        let error = of(film).unwrap_err().to_string();
        assert!(error.contains(said), "{film}: {error}");
    }
}

#[test]
fn spots_and_parallel_light() {
    let of = |keys: &str| load_text(&good(&format!("[[light]]\n{keys}")));
    let light = |keys: &str| of(keys).unwrap_or_else(|error| panic!("{error}\n{keys}")).scene.lights.remove(1);
    let spot = "type = \"spot\"\nposition = [1, 2, 3]\ndirection = [0, -1, 0]\nintensity = [4, 5, 6]\n";
    let plain = Light::Spot {
        position: [1.0, 2.0, 3.0].into(),
        direction: [0.0, -1.0, 0.0].into(),
        intensity: [4.0, 5.0, 6.0],
        inner: 0.0,
        outer: 45.0,
        range: f64::INFINITY,
    };
    assert_eq!(light(spot), plain);
    let Light::Spot { inner, outer, range, .. } = light(&format!("{spot}inner = 10\nouter = 30.5\nrange = 7")) else {
        panic!()
    };
    assert_eq!((inner, outer, range), (10.0, 30.5, 7.0));
    let sun = "type = \"directional\"\ndirection = [0, -1, 1]\nirradiance = [3, 2, 1]\n";
    assert_eq!(light(sun), Light::Directional { direction: [0.0, -1.0, 1.0].into(), irradiance: [3.0, 2.0, 1.0] });
    for (keys, words) in [
        (format!("{spot}inner = 50 #!"), "light 2: inner is 50, expected an angle from 0 to outer (45 degrees)"),
        (format!("{spot}outer = 181 #!"), "light 2: outer is 181, expected an angle from 0 to 180 degrees"),
        (format!("{spot}range = 0 #!"), "light 2: range is 0, expected a number > 0, or inf"),
        (
            spot.replace("[0, -1, 0]", "[0, 0, 0] #!"),
            "light 2: direction is [0, 0, 0], expected a vector of non-zero length",
        ),
        (spot.replace("[4, 5, 6]", "[4, -5, 6] #!"), "light 2: intensity is [4, -5, 6]"),
        (format!("{spot}power = [1, 1, 1] #!"), "light 2: power is given, expected none for a light of this type"),
        (format!("{sun}position = [0, 0, 0] #!"), "light 2: position is given"),
        (sun.replace("[3, 2, 1]", "[3, 2, nan] #!"), "light 2: irradiance is [3, 2, NaN]"),
    ] {
        assert_rejected(&good(&format!("[[light]]\n{keys}")), &[words]);
    }
    for (keys, words) in [
        ("type = \"spot\"\nposition = [0, 0, 0]\nintensity = [1, 1, 1]", "light 2: direction is missing"),
        ("type = \"directional\"\ndirection = [0, 0, 1]", "light 2: irradiance is missing"),
        ("type = \"point\"\nposition = [0, 0, 0]", "light 2: power is missing"),
    ] {
        assert_rejected(&good(&format!("[[light]] #!\n{keys}")), &[words]);
    }
}

/// The BSDF of a material of these lines.
fn bsdf_of(lines: &str) -> Bsdf {
    let text = good(&format!("[[material]]\nname = \"other\"\n{lines}"));
    load_text(&text).unwrap().scene.materials[1].surface.bsdf
}

fn rejected_material(lines: &str, words: &[&str]) {
    assert_rejected(&good(&format!("[[material]]\nname = \"other\"\n{lines}")), words);
}

#[test]
fn conductors_have_an_index_or_a_name() {
    let Bsdf::Conductor(own) =
        bsdf_of("type = \"conductor\"\neta = [0.2, 0.9, 1.1]\nk = [3.9, 2.5, 2.1]\nroughness = 0.3")
    else {
        panic!()
    };
    assert_eq!(own.reflection, Reflection::Index { eta: [0.2, 0.9, 1.1], k: [3.9, 2.5, 2.1] });
    assert_eq!(own.roughness, 0.3);
    let Bsdf::Conductor(gold) = bsdf_of("type = \"conductor\"\npreset = \"gold\"") else { panic!() };
    let Reflection::Index { eta, k } = gold.reflection else { panic!("{gold:?}") };
    assert!(eta[0] < 0.2 && k[0] > 3.9, "red is reflected most");
    assert_rejected(
        &good("[[material]] #!\nname = \"other\"\ntype = \"conductor\"\nk = [1, 1, 1]"),
        &["material 2: eta is missing"],
    );
    rejected_material("type = \"conductor\"\npreset = \"gold\"\nk = [1, 1, 1] #!", &["k is given", "beside preset"]);
    rejected_material("type = \"conductor\"\npreset = \"lead\" #!", &["lead", "gold"]);
    rejected_material("type = \"conductor\"\neta = [1, 0, 1] #!\nk = [1, 1, 1]", &["eta is [1, 0, 1]", "0.001"]);
    rejected_material("type = \"mirror\"\neta = [1, 1, 1] #!", &["eta is given", "mirror"]);
}

#[test]
fn mirrors_may_be_rough() {
    assert_eq!(bsdf_of("type = \"mirror\"\nroughness = 0"), Surface::mirror([1.0; 3]).bsdf);
    let Bsdf::Conductor(rough) = bsdf_of("type = \"mirror\"\nreflectance = [0.5, 0.6, 0.7]\nroughness = 0.2") else {
        panic!()
    };
    assert_eq!(rough, Conductor { reflection: Reflection::Constant([0.5, 0.6, 0.7]), roughness: 0.2 });
    rejected_material("type = \"mirror\"\nroughness = 2 #!", &["roughness is 2", "from 0 to 1"]);
}

#[test]
fn layers_of_pbr() {
    let Bsdf::MetallicRoughness(model) = bsdf_of(
        "type = \"pbr\"\nclearcoat = 0.5\nclearcoat_roughness = 0.1\nsheen_color = [1, 0.5, 0]\nsheen_roughness = 0.4\n\
         anisotropy = 0.7\nanisotropy_rotation = 90",
    ) else {
        panic!()
    };
    assert_eq!((model.coat, model.coat_roughness), (0.5, 0.1));
    assert_eq!((model.sheen_color, model.sheen_roughness), ([1.0, 0.5, 0.0], 0.4));
    assert_eq!((model.anisotropy, model.anisotropy_rotation), (0.7, std::f64::consts::FRAC_PI_2));
    rejected_material("type = \"pbr\"\nclearcoat = 1.5 #!", &["clearcoat is 1.5"]);
    rejected_material("type = \"mirror\"\nsheen_color = [1, 1, 1] #!", &["sheen_color is given"]);
}
