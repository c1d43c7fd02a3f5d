//! `[[texture]]`, the keys of materials that name one, alpha, and `[environment]`.

use std::fs;
use std::path::Path;

use photolith::Scene;
use photolith::scene::{Coverage, LoadOptions, Loaded, Material, SceneError, Surface, Texture, TextureSlot, Wrap};

const HEAD: &str = "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\nhorizontal_fov = 40\n";

/// A folder with an image of 2 × 1 pixels of each kind, and a square with coordinates.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let pixel = |x: u32| image::Rgba([100 * x as u8, 10, 20, 255]);
    image::RgbaImage::from_fn(2, 1, |x, _| pixel(x)).save(folder.path().join("a b.png")).unwrap();
    image::Rgb32FImage::from_fn(2, 1, |x, _| image::Rgb([x as f32, 0.5, 2.0]))
        .save(folder.path().join("a.hdr"))
        .unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    fs::write(folder.path().join("a.obj"), obj).unwrap();
    folder
}

fn load_in(folder: &Path, text: &str) -> Result<Loaded, SceneError> {
    Scene::from_toml_str(text, "scene.toml", Some(folder))
}

/// A scene of the square, of the material `m`.
fn square(tables: &str) -> String {
    format!("{HEAD}{tables}\n[[mesh]]\nfile = \"a.obj\"\nmaterial = \"m\"\n[background]\nradiance = [1, 1, 1]\n")
}

fn texture_of(folder: &Path, keys: &str) -> Texture {
    let text = square(&format!(
        "[[texture]]\nname = \"t\"\nfile = \"a b.png\"\n{keys}\n[[material]]\nname = \"m\"\ntype = \"diffuse\"\nreflectance = [1, 1, 1]\n\
         texture = \"t\"\n"
    ));
    let loaded = load_in(folder, &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    assert_eq!(loaded.scene.meshes[0].uvs[0].len(), 4);
    loaded.scene.materials[0].textures[&TextureSlot::BaseColor]
}

#[test]
fn keys_of_textures() {
    let folder = folder();
    let of = |keys: &str| texture_of(folder.path(), keys);
    let plain = Texture::new(0, true);
    assert_eq!(of(""), plain);
    assert_eq!(of("color = \"auto\"\nwrap = \"repeat\"\nfilter = \"linear\"\nuv = 0\nscale = 1\nrotate = 0"), plain);
    assert_eq!(of("color = \"linear\""), Texture::new(0, false));
    assert_eq!(of("wrap = \"clamp\"").wrap, [Wrap::Clamp; 2]);
    assert_eq!(of("wrap = [\"repeat\", \"mirror\"]").wrap, [Wrap::Repeat, Wrap::Mirror]);
    assert!(of("filter = \"nearest\"").nearest);
    assert_eq!(of("uv = 1").uv_set, 1);
    assert_eq!(of("scale = [2, 3]\noffset = [0.5, 0.25]").transform, [[2.0, 0.0, 0.5], [0.0, 3.0, 0.25]]);
    assert_eq!(of("scale = 4").transform, [[4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
    // As KHR_texture_transform has it: u' = cos·u + sin·v, v' = −sin·u + cos·v.
    let [[a, b, _], [c, d, _]] = of("rotate = 90\nscale = [2, 3]").transform;
    assert!(a.abs() < 1e-15 && (b - 3.0).abs() < 1e-15 && (c + 2.0).abs() < 1e-15 && d.abs() < 1e-15);
}

/// Slots, and what `color = "auto"` means for them.
#[test]
fn materials_name_textures() {
    let folder = folder();
    let textures = "[[texture]]\nname = \"t\"\nfile = \"a b.png\"\n[[texture]]\nname = \"hdr\"\nfile = \"a.hdr\"\n";
    let material = |keys: &str| -> Material {
        let text = square(&format!("{textures}[[material]]\nname = \"m\"\n{keys}\n"));
        let loaded = load_in(folder.path(), &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        loaded.scene.materials[0].clone()
    };
    for (keys, slot, srgb) in [
        ("type = \"diffuse\"\nreflectance = [1, 1, 1]\ntexture = \"t\"", TextureSlot::BaseColor, true),
        ("type = \"mirror\"\ntexture = \"t\"", TextureSlot::BaseColor, true),
        ("type = \"emitter\"\nradiance = [1, 1, 1]\ntexture = \"t\"", TextureSlot::Emission, true),
        ("type = \"emitter\"\nradiance = [1, 1, 1]\ntexture = \"hdr\"", TextureSlot::Emission, false),
        ("type = \"pbr\"\nbase_color_texture = \"t\"", TextureSlot::BaseColor, true),
        ("type = \"pbr\"\nmetallic_roughness_texture = \"t\"", TextureSlot::MetallicRoughness, false),
        ("type = \"pbr\"\nnormal_texture = \"t\"\nnormal_scale = 2", TextureSlot::Normal, false),
        ("type = \"pbr\"\nemission = [1, 1, 1]\nemission_texture = \"t\"", TextureSlot::Emission, true),
        (
            "type = \"diffuse\"\nreflectance = [1, 1, 1]\nemission = [1, 1, 1]\nemission_texture = \"t\"",
            TextureSlot::Emission,
            true,
        ),
    ] {
        let material = material(keys);
        let found: Vec<_> = material.textures.iter().map(|(slot, texture)| (*slot, texture.srgb)).collect();
        assert_eq!(found, [(slot, srgb)], "{keys}");
        assert_eq!(material.normal_scale, if keys.contains("normal_scale") { 2.0 } else { 1.0 });
    }
    let normal = "type = \"diffuse\"\nreflectance = [1, 1, 1]\nnormal_texture = \"t\"";
    let text = square(&format!("{textures}[[material]]\nname = \"m\"\n{normal}\n"));
    assert_eq!(load_in(folder.path(), &text).unwrap().scene.meshes[0].tangents.len(), 4);
    for (keys, coverage, alpha, culls_back) in [
        ("", Coverage::Opaque, 1.0, false),
        ("alpha = \"opaque\"\ndouble_sided = true", Coverage::Opaque, 1.0, false),
        ("alpha = \"mask\"", Coverage::Mask(0.5), 1.0, false),
        ("alpha = \"mask\"\nalpha_cutoff = 0.25\nopacity = 0.75", Coverage::Mask(0.25), 0.75, false),
        ("alpha = \"blend\"\nopacity = 0.5\ndouble_sided = false", Coverage::Blend, 0.5, true),
    ] {
        let material = material(&format!("type = \"pbr\"\n{keys}"));
        assert_eq!((material.coverage, material.alpha, material.culls_back), (coverage, alpha, culls_back), "{keys}");
    }
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let folder = folder();
    let texture = "[[texture]]\nname = \"t\"\nfile = \"a b.png\"\n";
    let material = "[[material]]\nname = \"m\"\n";
    let diffuse = format!("{material}type = \"diffuse\"\nreflectance = [1, 1, 1]\n");
    fs::write(folder.path().join("text.png"), "no image").unwrap();
    for (tables, words) in [
        ("[[texture]]\nname = \"t\"\nfile = \"gone.png\" #!".to_owned(), "texture 1: "),
        (
            "[[texture]]\nname = \"t\"\nfile = \"text.png\" #!".to_owned(),
            "file is \"text.png\": no image of a kind that is known, expected an image of type PNG",
        ),
        (
            format!("{texture}[[texture]]\nname = \"t\" #!\nfile = \"a b.png\""),
            "texture 2: name is \"t\", expected a name that no earlier texture has",
        ),
        (format!("{texture}wrap = \"tile\" #!"), "texture 1: wrap: "),
        (format!("{texture}wrap = [\"clamp\"] #!"), "texture 1: wrap: invalid length 1, expected \"repeat\""),
        (format!("{texture}filter = \"cubic\" #!"), "`linear` or `nearest`"),
        (format!("{texture}color = \"rgb\" #!"), "`auto`, `srgb`"),
        (format!("{texture}uv = 2 #!"), "texture 1: uv is 2, expected 0 or 1"),
        (format!("{texture}scale = [1, 2, 3] #!"), "a number or an array of two"),
        (format!("{texture}offset = [nan, 0] #!"), "texture 1: offset is NaN"),
        (format!("{texture}size = 3 #!"), "unknown field `size`"),
        ("[[texture]] #!\nname = \"t\"".to_owned(), "texture 1: `file` is missing"),
        (
            format!("{diffuse}texture = \"t\" #!"),
            "material 1: texture is \"t\", expected the name of a [[texture]], of which there are none",
        ),
        (format!("{texture}{diffuse}texture = \"u\" #!"), "expected the name of a [[texture]]: \"t\""),
        (format!("{texture}{diffuse}base_color_texture = \"t\" #!"), "base_color_texture is given, expected none"),
        (format!("{texture}{material}type = \"pbr\"\ntexture = \"t\" #!"), "texture is given, expected none"),
        (
            format!("{texture}{material}type = \"dielectric\"\nior = 1.5\nnormal_texture = \"t\" #!"),
            "normal_texture is given, expected none",
        ),
        (format!("{diffuse}normal_scale = 2 #!"), "normal_scale is given, expected a normal_texture"),
        (format!("{texture}{diffuse}emission_texture = \"t\" #!"), "emission_texture is given, expected an emission"),
        (format!("{diffuse}alpha_cutoff = 0.5 #!"), "alpha_cutoff is given, expected alpha = \"mask\""),
        (format!("{diffuse}opacity = 0.5 #!"), "opacity is given, expected alpha beside it"),
        (
            format!("{diffuse}alpha = \"blend\"\nopacity = 2 #!"),
            "material 1: opacity is 2, expected a number from 0 to 1",
        ),
        (format!("{diffuse}alpha = \"cut\" #!"), "`opaque`"),
        (format!("{material}type = \"dielectric\"\nior = 1.5\nalpha = \"blend\" #!"), "alpha is given, expected none"),
        (
            format!("{material}type = \"dielectric\"\nior = 1.5\ndouble_sided = false #!"),
            "double_sided is false, expected true",
        ),
    ] {
        let text = square(&tables);
        let line = text.lines().position(|line| line.contains("#!")).unwrap() + 1;
        let message = load_in(folder.path(), &text).expect_err(&text).to_string();
        let is_placed = message.starts_with(&format!("scene.toml:{line}:"));
        assert!(is_placed && message.contains(words), "{message}: {words}\n{text}");
    }
    let sphere = format!(
        "{HEAD}{texture}{diffuse}texture = \"t\"\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"m\"\n"
    );
    let warnings = load_in(folder.path(), &sphere).unwrap().warnings;
    assert!(
        warnings.iter().any(|w| w.contains("sphere 1: textures, alpha and double_sided of \"m\" are of meshes only")),
        "{warnings:?}"
    );
}

#[test]
fn an_environment() {
    let folder = folder();
    let ball =
        "[[material]]\nname = \"m\"\ntype = \"mirror\"\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"m\"\n";
    let of = |keys: &str| load_in(folder.path(), &format!("{HEAD}{ball}[environment]\n{keys}\n"));
    let Loaded { scene, warnings, .. } = of("file = \"a.hdr\"").unwrap();
    let map = scene.environment.unwrap();
    assert!(warnings.is_empty() && map.name.ends_with("a.hdr"), "{warnings:?}");
    assert_eq!((map.width, map.height, map.rotation, map.scale, map.visible), (2, 1, 0.0, 1.0, true));
    assert_eq!(map.texels[..], [[0.0, 0.5, 2.0], [1.0, 0.5, 2.0]]);
    let turned =
        of("file = \"a.hdr\"\nrotation = -30\nscale = 2.5\nvisible = false").unwrap().scene.environment.unwrap();
    assert_eq!((turned.rotation, turned.scale, turned.visible), (-30.0, 2.5, false));
    let picture = of("file = \"a b.png\"").unwrap();
    assert!(matches!(&picture.warnings[..], [w] if w.contains("no high dynamic range")), "{:?}", picture.warnings);
    fs::write(folder.path().join("a.txt"), "no image").unwrap();
    let line = HEAD.lines().count() + ball.lines().count() + 2;
    for (keys, at, words) in [
        ("file = \"gone.hdr\"", line, "environment: "),
        (
            "file = \"a.txt\"",
            line,
            "environment: file is \"a.txt\": no image of a kind that is known, expected an environment map",
        ),
        ("file = \"a.hdr\"\nscale = -1", line + 1, "environment: scale is -1, expected a finite number >= 0"),
        ("file = \"a.hdr\"\nrotation = nan", line + 1, "environment: rotation is NaN"),
        ("file = \"a.hdr\"\nheight = 1", line + 1, "unknown field `height`"),
        ("rotation = 3", line - 1, "`file` is missing"),
        ("file = \"a.hdr\"\n[background]\nradiance = [1, 1, 1]", line + 2, "expected none beside an [environment]"),
    ] {
        let message = of(keys).unwrap_err().to_string();
        assert!(message.starts_with(&format!("scene.toml:{at}:")) && message.contains(words), "{keys}: {message}");
    }
}

#[test]
fn confined_files_stay_in_their_folder() {
    let folder = folder();
    let inside = folder.path().join("inside");
    fs::create_dir(&inside).unwrap();
    for name in ["a b.png", "a.obj", "a.hdr"] {
        fs::copy(folder.path().join(name), inside.join(name)).unwrap();
    }
    let confined = LoadOptions { confine: true, ..LoadOptions::default() };
    let diffuse = "[[material]]\nname = \"m\"\ntype = \"diffuse\"\nreflectance = [1, 1, 1]\n";
    for (tables, name) in [
        (square(&format!("{diffuse}[[texture]]\nname = \"t\"\nfile = \"@a b.png\"")), "a b.png"),
        (square(diffuse).replace("\"a.obj\"", "\"@a.obj\""), "a.obj"),
        (format!("{HEAD}[[model]]\nfile = \"@a.obj\"\n"), "a.obj"),
        (square(diffuse).replace("[background]\nradiance = [1, 1, 1]", "[environment]\nfile = \"@a.hdr\""), "a.hdr"),
    ] {
        for (prefix, is_inside) in [("", true), ("../", false), ("../inside/", true)] {
            let path = inside.join("scene.toml");
            fs::write(&path, tables.replace('@', prefix)).unwrap();
            assert!(Scene::load(&path).is_ok(), "{name}");
            match Scene::load_with(&path, &confined) {
                Ok(_) => assert!(is_inside, "{prefix}{name}"),
                Err(error) => assert!(!is_inside && error.to_string().contains("confined"), "{prefix}{name}: {error}"),
            }
        }
    }
    let small = LoadOptions { texture_limit: Some(1), ..LoadOptions::default() };
    let textured = format!("[[texture]]\nname = \"t\"\nfile = \"a b.png\"\n{diffuse}texture = \"t\"\n");
    fs::write(inside.join("scene.toml"), square(&textured)).unwrap();
    let Loaded { scene, warnings, .. } = Scene::load_with(&inside.join("scene.toml"), &small).unwrap();
    assert_eq!((scene.images[0].width, warnings.len()), (1, 1), "{warnings:?}");
    assert_eq!(scene.materials[0].surface, Surface::diffuse([1.0; 3]));
}
