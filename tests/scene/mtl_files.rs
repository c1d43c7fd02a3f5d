//! MTL: what each statement makes of a material, and what is told of it.

use std::fs;
use std::path::Path;

use photolith::Scene;
use photolith::scene::{
    Bsdf, Coverage, Loaded, Material, MetallicRoughness, Surface, Texels, TextureImage, TextureSlot, Wrap,
};

const OBJ: &str =
    "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a b\nf 1/1 2/2 3/3 4/4\n";

/// A square in a folder, of a material of these statements.
fn load_in(folder: &Path, mtl: &str) -> Loaded {
    fs::write(folder.join("a.obj"), OBJ).unwrap();
    fs::write(folder.join("a.mtl"), format!("newmtl a b\n{mtl}\n")).unwrap();
    Scene::load(&folder.join("a.obj")).unwrap_or_else(|error| panic!("{error}\n{mtl}"))
}

/// What is told of its material.
fn told(loaded: &Loaded) -> Vec<String> {
    let of_material = |warning: &String| Some(warning.split_once("a.mtl:1: material \"a b\": ")?.1.to_owned());
    loaded.warnings.iter().filter_map(of_material).collect()
}

fn surface_of(mtl: &str) -> (Surface, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let loaded = load_in(folder.path(), mtl);
    assert_eq!(loaded.scene.materials[0].name, "a b");
    (loaded.scene.materials[0].surface, told(&loaded))
}

/// A surface with a gloss.
fn glossy(base_color: [f64; 3], roughness: f64) -> MetallicRoughness {
    MetallicRoughness { base_color, metallic: 0.0, roughness, ..MetallicRoughness::default() }
}

fn of(model: MetallicRoughness) -> Surface {
    Surface { bsdf: Bsdf::MetallicRoughness(model), ..Surface::diffuse([0.0; 3]) }
}

#[test]
fn mtl_materials_become_surfaces() {
    let diffuse = |r, g, b| Surface::diffuse([r, g, b]);
    let mirror = |r, g, b| Surface::mirror([r, g, b]);
    let glass = |ior| Surface::dielectric(ior);
    for (mtl, expected) in [
        ("Kd 0.1 0.2 0.3", diffuse(0.1, 0.2, 0.3)),
        ("Kd 0.5", diffuse(0.5, 0.5, 0.5)),
        ("kd 0.5\nMAP", diffuse(0.5, 0.5, 0.5)),
        ("Kd 0 0 0\nKe 3 0 1 # red", Surface::emitter([3.0, 0.0, 1.0])),
        ("Ke 3", Surface::emitter([3.0, 3.0, 3.0])),
        ("Kd 1 1 1\nKe 0 0 0", diffuse(1.0, 1.0, 1.0)),
        ("Kd 0 0 0\nKs 1 1 1", mirror(1.0, 1.0, 1.0)),
        ("Kd 1 1 1\nKs 1 1 1", of(glossy([1.0; 3], 0.5))),
        ("illum 3\nKs 0.9 0.8 0.7", mirror(0.9, 0.8, 0.7)),
        ("illum 3", mirror(1.0, 1.0, 1.0)),
        ("illum 8\nKs 0 0 0", mirror(1.0, 1.0, 1.0)),
        ("illum 7\nNi 2.5", glass(2.5)),
        ("illum 4\nd 0.2", glass(1.5)),
        ("illum 7\nKd 0 0 0", glass(1.5)),
        ("illum 6\nTf 0.5\nKd 1 1 1", glass(1.5)),
        ("d 0.1\nNi 1.3", glass(1.3)),
        ("d -halo 0.1\nNi 1.3", glass(1.3)),
        ("Tr 0.9\nNi 1.3", glass(1.3)),
        ("d 0.1\nTr 0.9\nNi 1.3", glass(1.3)),
        ("Tf 1 1 1\nNi 1.5\nd 1\nKd 0 0 1", diffuse(0.0, 0.0, 1.0)),
        ("d 1.0\nTr 0.0\nNi 1.5\nKd 0 0 1", diffuse(0.0, 0.0, 1.0)),
        ("d 0.9999\nNi 1.5\nKd 0 0 1", diffuse(0.0, 0.0, 1.0)),
        ("Tf 0.2 0.2 0.2\nNi 1.5\nKd 1 1 1", glass(1.5)),
        // Not used where the surface is opaque.
        ("Kd 0 0 1\nNi 0\nillum 2\nd 1", diffuse(0.0, 0.0, 1.0)),
        ("Kd 0 0 1\nNi 1e-50", diffuse(0.0, 0.0, 1.0)),
    ] {
        let (surface, warnings) = surface_of(mtl);
        assert_eq!(surface, expected, "{mtl}");
        assert!(warnings.is_empty(), "{mtl}: {warnings:?}");
    }
}

/// What is lost or replaced is told: no material becomes invisible, black or grey without a word.
#[test]
fn what_an_mtl_material_loses_is_told() {
    let diffuse = |r, g, b| Surface::diffuse([r, g, b]);
    let mirror = |r, g, b| Surface::mirror([r, g, b]);
    let glass = |ior| Surface::dielectric(ior);
    for (mtl, expected, words) in [
        ("", diffuse(0.8, 0.8, 0.8), &["no Kd"][..]),
        ("Kd 1.5 0.5 -1", diffuse(1.0, 0.5, 0.0), &["clamped"]),
        // Textures, one by one.
        (
            "Kd 1 0 0\nmap_Kd wood.png",
            diffuse(1.0, 0.0, 0.0),
            &["the texture \"map_Kd\" \"wood.png\" is left out: there is no such file"],
        ),
        (
            "Kd 1 0 0\nmap_Kd a.png\nmap_d -s 1 1 1 b c.png\nbump d.png\nmap_Ke e.png",
            diffuse(1.0, 0.0, 0.0),
            &["\"map_Kd\" \"a.png\"", "\"map_d\" \"b c.png\"", "\"map_Ke\"", "\"bump\" \"d.png\""],
        ),
        ("Kd 0 0 0\nmap_Kd a.png", diffuse(0.8, 0.8, 0.8), &["\"map_Kd\"", "Kd is 0 beside the texture"]),
        ("Kd 0 0 0\nKs 1 1 1\nmap_Kd a.png", of(glossy([0.8; 3], 0.5)), &["\"map_Kd\"", "Kd is 0 beside the texture"]),
        ("Kd 0 0 0\nKs 0.4 0.4 0.4\nillum 2", of(glossy([0.0; 3], 0.5)), &[]),
        ("Kd 0 0 0\nKs 0.4 0.4 0.4\nillum 1", diffuse(0.0, 0.0, 0.0), &["Ks [0.4, 0.4, 0.4] is not supported"]),
        (
            "Kd 1\nmap_Ka a.png\ndisp b.png\nmap_RMA c.png",
            diffuse(1.0, 1.0, 1.0),
            &["\"map_Ka\" \"a.png\" is not", "\"disp\"", "\"map_RMA\""],
        ),
        // What emits reflects as well.
        ("Kd 0.8\nKe 0.01", Surface { emission: [0.01; 3], ..diffuse(0.8, 0.8, 0.8) }, &[]),
        ("Ks 1\nillum 3\nKe 2", Surface { emission: [2.0; 3], ..mirror(1.0, 1.0, 1.0) }, &[]),
        ("Kd 0\nKe -1 0 5", Surface::emitter([0.0, 0.0, 5.0]), &["numbers below 0"]),
        ("Kd 0.8 0.6 0.2\nKs 0.5 0.5 0.5\nillum 3", mirror(0.5, 0.5, 0.5), &["Kd [0.8, 0.6, 0.2] is dropped"]),
        ("Kd 0.8 0.6 0.2\nKs 0 0 0\nillum 3", diffuse(0.8, 0.6, 0.2), &["without Ks"]),
        // Opaque materials of Maya, and their like of the other models of glass.
        ("illum 4\nKd 0.8 0.2 0.2\nKa 0 0 0\nTf 1 1 1\nNi 1.00", diffuse(0.8, 0.2, 0.2), &["illum 4 is glass, but"]),
        (
            "illum 4\nKd 0.8 0.2 0.2\nTf 1 1 1\nKs 0.5 0.5 0.5\nNi 1.86",
            of(MetallicRoughness { ior: 1.86, ..glossy([0.8, 0.2, 0.2], 0.5) }),
            &["illum 4 is glass"],
        ),
        ("illum 6\nKd 0.8\nNi 1", diffuse(0.8, 0.8, 0.8), &["illum 6 is glass, but"]),
        ("illum 7\nKd 0.8\nd 1", diffuse(0.8, 0.8, 0.8), &["illum 7 is glass, but"]),
        ("illum 9\nKd 0.8\nNi 1.0\nd 1.0", diffuse(0.8, 0.8, 0.8), &["illum 9 is glass, but"]),
        ("illum 4\nKd 0.8\nTf 0.2\nNi 1", diffuse(0.8, 0.8, 0.8), &["transparency without refraction"]),
        // Indices that no glass has.
        ("illum 7\nNi 0\nd 0.1", glass(1.5), &["Ni is 0, expected a number from 0.001 to 1000: 1.5 is used"]),
        ("illum 7\nNi 1e9\nd 0.1", glass(1.5), &["Ni is 1000000000, expected"]),
        ("d 0.5\nNi 1.5\nKd 0 0 1", glass(1.5), &["Kd [0.0, 0.0, 1.0] is dropped"]),
        ("Tf 0.2 0.9 0.2\nNi 1.5", glass(1.5), &["the colour of Tf [0.2, 0.9, 0.2] is dropped"]),
        // d against Tr.
        ("Kd 0.5\nd 1\nTr 1\nNi 1.5", diffuse(0.5, 0.5, 0.5), &["d 1 and Tr 1 differ, expected Tr = 1 - d"]),
        ("Kd 0.5\nTr 0\nd 0\nNi 1.5", diffuse(0.5, 0.5, 0.5), &["d 0 and Tr 0 differ"]),
        ("Kd 0.5\nTr 1.0\nNi 1.5", diffuse(0.5, 0.5, 0.5), &["Tr 1 without d is taken for opaque"]),
        ("Kd 0.5\nTr 100\nNi 1.5", diffuse(0.5, 0.5, 0.5), &["Tr is 100, expected a number from 0 to 1"]),
        ("Kd 0.5\nd -1\nNi 1.5", diffuse(0.5, 0.5, 0.5), &["d is -1, expected a number from 0 to 1"]),
        // What cannot be read.
        ("Kd 1 1", diffuse(0.8, 0.8, 0.8), &["\"Kd\" has 2 numbers, expected 1 or 3", "no Kd"]),
        ("Kd", diffuse(0.8, 0.8, 0.8), &["\"Kd\" has 0 numbers", "no Kd"]),
        ("Kd 0.5 nan 0.5", diffuse(0.8, 0.8, 0.8), &["\"Kd\" has \"nan\"", "no Kd"]),
        ("Kd spectral red.rfl 1", diffuse(0.8, 0.8, 0.8), &["\"Kd\" is given as \"spectral\", expected RGB", "no Kd"]),
        ("Kd 1\nTf xyz 0.9 0.9 0.9", diffuse(1.0, 1.0, 1.0), &["\"Tf\" is given as \"xyz\", expected RGB"]),
        ("Kd 1\nillum 2.5", diffuse(1.0, 1.0, 1.0), &["\"illum\" is 2.5, expected an integer from 0 to 10"]),
        ("Kd 1\nd x", diffuse(1.0, 1.0, 1.0), &["\"d\" has \"x\""]),
        ("Kd 1\nPr x", diffuse(1.0, 1.0, 1.0), &["\"Pr\" has \"x\""]),
        ("Kd 1\nd -halo", diffuse(1.0, 1.0, 1.0), &["\"d\" has 0 numbers"]),
    ] {
        let (surface, warnings) = surface_of(mtl);
        assert_eq!(surface, expected, "{mtl}");
        assert_eq!(warnings.len(), words.len(), "{mtl}: {warnings:?}");
        for (warning, words) in warnings.iter().zip(words) {
            assert!(warning.contains(words), "{mtl}: {warning} should have {words}");
        }
    }
}

/// Statements that are outside of materials.
#[test]
fn statements_of_no_material_are_told() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.obj"), OBJ.replace("a b", "b")).unwrap();
    fs::write(folder.path().join("a.mtl"), "Kd 1 0 0\n# c\nfoo\nnewmtl\nmap_Kd a.png\nnewmtl b\nKd 1\n").unwrap();
    let Loaded { scene, warnings, .. } = Scene::load(&folder.path().join("a.obj")).unwrap();
    assert_eq!(scene.materials[0].surface, Surface::diffuse([1.0; 3]));
    let starts = ["a.mtl:1: \"Kd\" is ignored", "a.mtl:4: \"newmtl\" without a name", "a.mtl:5: \"map_Kd\" is ignored"];
    assert!(starts.iter().all(|start| warnings.iter().any(|warning| warning.contains(start))), "{warnings:?}");
}

/// Numbers of glossy, metallic and coated surfaces.
#[test]
fn numbers_of_surfaces() {
    let kd = [0.8, 0.6, 0.2];
    let rough = |exponent: f64| 1.0 - (exponent / 1000.0).sqrt();
    let metal = |base_color, roughness| MetallicRoughness { base_color, roughness, ..MetallicRoughness::default() };
    let base = glossy(kd, 0.5);
    for (mtl, expected) in [
        ("Ns 250\nKs .5 .5 .5", of(base)),
        ("Ns 250", of(base)),
        ("Ks .5\nillum 2", of(base)),
        ("Ns 96.078431\nKs .5\nillum 2\nNi 1.0", of(glossy(kd, rough(96.078431)))),
        ("Ns 1000\nKs 1 1 1\nNi 1.45", of(MetallicRoughness { ior: 1.45, ..glossy(kd, 0.0) })),
        ("Ns 1e6\nKs 1 1 1\nNi 0.5", of(glossy(kd, 0.0))),
        ("Ns -1\nKs 1 1 1", of(glossy(kd, 1.0))),
        ("Ns 250\nKs 0 0 0\nillum 2", Surface::diffuse(kd)),
        ("Ns 250\nKs 1 1 1\nillum 1", Surface::diffuse(kd)),
        ("illum 3\nKs .9 .8 .7\nNs 1000", Surface::mirror([0.9, 0.8, 0.7])),
        ("illum 3\nKs .9 .8 .7\nNs 250", of(metal([0.9, 0.8, 0.7], 0.5))),
        ("illum 3\nKs .5 .5 .5\nNs 250", of(metal(kd, 0.5))),
        ("Pr 0.3", of(glossy(kd, 0.3))),
        ("Pr 0.3\nPm 1\nillum 1\nKs 0 0 0", of(metal(kd, 0.3))),
        ("Pm 0.5\nNs 40", of(MetallicRoughness { metallic: 0.5, ..glossy(kd, rough(40.0)) })),
        ("Pr 0.3\nillum 3", of(metal(kd, 0.3))),
        ("Pr 7\nPm -1", of(glossy(kd, 1.0))),
        ("Pc 0.5\nPcr 0.1", of(MetallicRoughness { coat: 0.5, coat_roughness: 0.1, ..base })),
        ("Pc 0\nPcr 0.03\nPs 0\naniso 0\nanisor 0", Surface::diffuse(kd)),
        ("Ps 0.25", of(MetallicRoughness { sheen_color: [0.25; 3], sheen_roughness: 0.5, ..base })),
        (
            "aniso 0.5\nanisor 0.25",
            of(MetallicRoughness { anisotropy: 0.5, anisotropy_rotation: std::f64::consts::FRAC_PI_2, ..base }),
        ),
        (
            "illum 7\nPr 0.2\nNi 1.4\nd 0.5",
            of(MetallicRoughness { ior: 1.4, transmission: 1.0, has_volume: true, ..glossy([1.0; 3], 0.2) }),
        ),
        ("illum 7\nPr 0\nNi 1.4\nd 0.5", Surface::dielectric(1.4)),
        // The highlight of smooth glass.
        ("illum 7\nNs 200\nNi 2.5", Surface::dielectric(2.5)),
        ("Pr 0.2\nNi 1.4\nd 0.5", of(MetallicRoughness { ior: 1.4, ..glossy(kd, 0.2) })),
        ("illum 9\nPr 0.2\nNi 1.4\nd 0.5", of(MetallicRoughness { ior: 1.4, ..glossy(kd, 0.2) })),
    ] {
        let (found, _) = surface_of(&format!("Kd .8 .6 .2\n{mtl}"));
        assert_eq!(found, expected, "{mtl}");
    }
}

/// Numbers that no file means make no file unreadable.
#[test]
fn any_numbers_are_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let d = folder.path();
    picture(d, "a.png", 2, 1, |_, _| RED);
    for number in ["1e30", "-1e30", "1e-30", "nan", "inf", "1e400", "0"] {
        let statements =
            ["Kd", "Ks", "Ke", "Ns", "Ni", "d", "Tr", "Pr", "Pm", "Pc", "Pcr", "Ps", "aniso", "anisor", "illum"];
        let mut mtl: String = statements.iter().map(|keyword| format!("{keyword} {number}\n")).collect();
        for keyword in ["map_Kd", "map_Ke", "map_d", "map_Pr", "map_Ns", "map_Pm", "map_Pc", "map_Ps", "bump"] {
            mtl += &format!(
                "{keyword} -s {number} {number} -o {number} {number} -mm {number} {number} -bm {number} a.png\n"
            );
        }
        for mtl in [mtl.clone(), mtl.replace("illum", "illum 2\n#"), mtl.replace("Pr ", "# ").replace("Pm ", "# ")] {
            load_in(d, &mtl).scene.validate().unwrap();
        }
    }
}

/// Writes an image of the kind that its name says.
fn picture(folder: &Path, name: &str, width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; 4]) {
    let image = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba(pixel(x, y)));
    match name.rsplit('.').next().unwrap() {
        "jpg" => image::DynamicImage::from(image).into_rgb8().save(folder.join(name)).unwrap(),
        _ => image.save(folder.join(name)).unwrap(),
    }
}

fn texels(image: &TextureImage) -> Vec<[u8; 4]> {
    match &image.texels {
        Texels::Rgba8(texels) => texels.clone(),
        Texels::Rgba16(texels) => texels.iter().map(|t| t.map(|x| ((f64::from(x) / 257.0).round()) as u8)).collect(),
        Texels::Rgba32F(_) => panic!("floats"),
    }
}

/// A material, and the pixels of its texture of some use.
fn with_texture(folder: &Path, mtl: &str, slot: TextureSlot) -> (Material, Vec<[u8; 4]>, Vec<String>) {
    let loaded = load_in(folder, mtl);
    let material = loaded.scene.materials[0].clone();
    let texture = material.textures.get(&slot).unwrap_or_else(|| panic!("{mtl}: {:?}", loaded.warnings));
    let pixels = texels(&loaded.scene.images[texture.image as usize]);
    let told = told(&loaded);
    (material, pixels, told)
}

const RED: [u8; 4] = [200, 10, 20, 255];
const LEAF: [u8; 4] = [10, 200, 20, 0];

#[test]
fn kinds_of_images() {
    let folder = tempfile::tempdir().unwrap();
    let d = folder.path();
    for name in ["a.png", "a.bmp", "a.tga", "a.webp", "a.jpg"] {
        picture(d, name, 4, 4, |_, _| RED);
        let (material, pixels, told) = with_texture(d, &format!("Kd .5 .5 .5\nmap_Kd {name}"), TextureSlot::BaseColor);
        assert_eq!(told, [""; 0], "{name}");
        assert!(material.textures[&TextureSlot::BaseColor].srgb);
        assert_eq!(material.surface, Surface::diffuse([0.5; 3]));
        let close = |p: &[u8; 4]| p.iter().zip(RED).all(|(a, b)| a.abs_diff(b) <= 3);
        assert!(pixels.len() == 16 && pixels.iter().all(close), "{name}: {pixels:?}");
    }
    let values = |x: usize, y: usize| (x as f32, 0.5f32, -(y as f32));
    exr::prelude::write_rgb_file(d.join("a.exr"), 2, 2, values).unwrap();
    let floats = image::Rgb32FImage::from_fn(2, 2, |x, _| image::Rgb([x as f32, 0.5, 0.0]));
    floats.save(d.join("a.hdr")).unwrap();
    for name in ["a.exr", "a.hdr"] {
        let loaded = load_in(d, &format!("Kd 1\nKe 1\nmap_Ke {name}"));
        let texture = loaded.scene.materials[0].textures[&TextureSlot::Emission];
        assert!(!texture.srgb, "radiance is linear");
        let Texels::Rgba32F(pixels) = &loaded.scene.images[0].texels else { panic!("{name}") };
        assert_eq!(pixels[3], [1.0, 0.5, 0.0, 1.0], "{name}: below 0 counts as 0");
    }
}

#[test]
fn files_of_textures_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let d = folder.path();
    fs::create_dir(d.join("Textures")).unwrap();
    picture(d, "my wood.png", 1, 1, |_, _| RED);
    picture(d, "Textures/oak.PNG.png", 1, 1, |_, _| RED);
    fs::rename(d.join("Textures/oak.PNG.png"), d.join("Textures/Oak.PNG")).unwrap();
    for name in [
        "my wood.png",
        "\"my wood.png\"",
        "-s 1 1 1 -o 0 0 0 MY WOOD.png",
        "C:\\art\\my wood.png",
        "textures\\oak.png",
        "textures/oak.png # of the table",
        ".\\Textures\\\\Oak.PNG",
        "/home/me/textures/oak.png",
    ] {
        let (_, pixels, told) = with_texture(d, &format!("Kd 1\nmap_Kd {name}"), TextureSlot::BaseColor);
        assert_eq!((pixels, told), (vec![RED], Vec::new()), "{name}");
    }
    fs::write(d.join("bad.png"), "no image").unwrap();
    for (name, reason) in
        [("gone.png", "there is no such file"), ("bad.png", "no image of a kind that is known"), ("", "")]
    {
        let loaded = load_in(d, &format!("Kd .3 .3 .3\nmap_Kd {name}"));
        assert_eq!(loaded.scene.materials[0], Material::new("a b", Surface::diffuse([0.3; 3])));
        let [told] = &told(&loaded)[..] else { panic!("{:?}", loaded.warnings) };
        assert!(told.contains(&format!("\"map_Kd\" \"{name}\" is left out")) && told.contains(reason), "{told}");
        assert!(loaded.scene.images.is_empty() && loaded.scene.meshes[0].uvs[0].is_empty());
    }
}

/// Where a texture lies: (0, 0) of OBJ is the lower left corner of the image.
#[test]
fn coordinates_and_options() {
    let folder = tempfile::tempdir().unwrap();
    picture(folder.path(), "a.png", 2, 2, |x, y| [100 * x as u8, 100 * y as u8, 0, 255]);
    let loaded = load_in(folder.path(), "Kd 1\nmap_Kd -clamp on -s 2 4 -o .25 .5 a.png");
    let mesh = &loaded.scene.meshes[0];
    let corners: Vec<_> = mesh.positions.iter().zip(&mesh.uvs[0]).map(|(p, uv)| (p.x, p.y, *uv)).collect();
    let expected = [(0.0, 0.0, [0.0, 1.0]), (1.0, 0.0, [1.0, 1.0]), (1.0, 1.0, [1.0, 0.0]), (0.0, 1.0, [0.0, 0.0])];
    assert_eq!(corners, expected);
    let texture = loaded.scene.materials[0].textures[&TextureSlot::BaseColor];
    assert_eq!(texture.wrap, [Wrap::Clamp; 2]);
    // Twice and four times; what is at the lower edge goes up by a half of the image.
    assert_eq!(texture.transform, [[2.0, 0.0, 0.25], [0.0, 4.0, 1.0 - 4.0 - 0.5]]);
    // No texture, no coordinates.
    assert!(load_in(folder.path(), "Kd 1").scene.meshes[0].uvs[0].is_empty());
    // Coordinates that are missing.
    fs::write(folder.path().join("a.obj"), OBJ.replace("1/1 2/2 3/3 4/4", "1 2 3 4")).unwrap();
    let bare = Scene::load(&folder.path().join("a.obj")).unwrap();
    fs::write(folder.path().join("a.mtl"), "newmtl a b\nKd 1\nmap_Kd a.png\n").unwrap();
    let textured = Scene::load(&folder.path().join("a.obj")).unwrap();
    assert_eq!(bare.scene.meshes[0].positions, textured.scene.meshes[0].positions);
    assert!(textured.warnings.iter().any(|w| w.contains("no face has texture coordinates")), "{:?}", textured.warnings);
}

#[test]
fn colours_and_emission() {
    let folder = tempfile::tempdir().unwrap();
    let d = folder.path();
    picture(d, "a.png", 1, 1, |_, _| RED);
    for (mtl, reflectance, words) in [
        ("Kd .5 1 1\nmap_Kd a.png", [0.5, 1.0, 1.0], &[][..]),
        ("Kd 0 0 0\nmap_Kd a.png", [1.0; 3], &["Kd is 0 beside the texture map_Kd, which is used alone"]),
        ("map_Kd a.png", [1.0; 3], &[]),
        ("Kd 1\nmap_Ka a.png\nmap_Kd a.png", [1.0; 3], &[]),
    ] {
        let (material, pixels, told) = with_texture(d, mtl, TextureSlot::BaseColor);
        assert_eq!((material.surface, pixels), (Surface::diffuse(reflectance), vec![RED]), "{mtl}");
        assert_eq!(told, words, "{mtl}");
    }
    let (_, pixels, _) = with_texture(d, "Kd 1\nmap_Kd -mm 0.5 0.25 a.png", TextureSlot::BaseColor);
    assert_eq!(pixels, [[178, 130, 133, 255]], "codes / 4 + 127.5");
    for (mtl, emission, words) in [
        ("Kd 1\nKe 2 1 1\nmap_Ke a.png", [2.0, 1.0, 1.0], &[][..]),
        ("Kd 1\nmap_Ke a.png", [1.0; 3], &[]),
        ("Kd 1\nKe 0 0 0\nmap_Ke a.png", [1.0; 3], &["Ke is 0 beside the texture map_Ke, which is used alone"]),
    ] {
        let (material, pixels, told) = with_texture(d, mtl, TextureSlot::Emission);
        assert_eq!((material.surface.emission, pixels), (emission, vec![RED]), "{mtl}");
        assert_eq!(told, words, "{mtl}");
        assert!(material.textures[&TextureSlot::Emission].srgb);
    }
    let (lamp, _, _) = with_texture(d, "Ke 3\nmap_Ke a.png", TextureSlot::Emission);
    assert_eq!(lamp.surface, Surface::emitter([3.0; 3]));
    // The reflection of mirrors and of gloss.
    let (mirror, pixels, _) = with_texture(d, "illum 3\nKs 1\nmap_Ks a.png", TextureSlot::BaseColor);
    assert_eq!((mirror.surface, pixels), (Surface::mirror([1.0; 3]), vec![RED]));
    let (gloss, pixels, _) = with_texture(d, "Kd 1\nKs 0\nmap_Ks a.png", TextureSlot::SpecularColor);
    assert_eq!((gloss.surface, pixels), (of(glossy([1.0; 3], 0.5)), vec![RED]));
    for (mtl, keyword) in
        [("illum 7\nNi 1.5\nKe 1\nmap_Ke a.png", "map_Ke"), ("Kd 1\nKs 1\nillum 1\nmap_Ks a.png", "map_Ks")]
    {
        let told = told(&load_in(d, mtl));
        assert!(matches!(&told[..], [t] if t.contains(keyword) && t.contains("changes nothing")), "{told:?}");
    }
}

#[test]
fn alpha_cuts_out_and_blends() {
    let folder = tempfile::tempdir().unwrap();
    let d = folder.path();
    let half = |x: u32| if x == 0 { 255 } else { 0 };
    picture(d, "leaf.png", 2, 1, |x, _| if x == 0 { RED } else { LEAF });
    picture(d, "opaque.png", 2, 1, |_, _| RED);
    picture(d, "cut.png", 2, 1, |x, _| [half(x), half(x), half(x), 255]);
    picture(d, "soft.png", 2, 1, |x, _| [90 + half(x) / 2; 4].map(|c| c.min(200)));
    picture(d, "grey.png", 2, 1, |x, _| [if x == 0 { 200 } else { 100 }, 0, 0, 255]);
    let blend = |alpha| (Coverage::Blend, alpha);
    let mask = (Coverage::Mask(0.5), 1.0);
    let cut = vec![[200, 10, 20, 255], [200, 10, 20, 0]];
    for (mtl, coverage, pixels) in [
        ("map_Kd leaf.png\nmap_d leaf.png", mask, vec![RED, LEAF]),
        ("map_Kd opaque.png\nmap_d cut.png", mask, cut.clone()),
        ("map_Kd opaque.png\nmap_d leaf.png", mask, cut.clone()),
        ("map_Kd opaque.png\nmap_d cut.png\nd 0.5", blend(0.5), cut.clone()),
        ("map_Kd opaque.png\nmap_d cut.png\nd 0", mask, cut.clone()),
        ("map_Kd opaque.png\nmap_d soft.png", blend(1.0), vec![[200, 10, 20, 200], [200, 10, 20, 90]]),
        ("map_Kd opaque.png\nmap_d -imfchan r grey.png", blend(1.0), vec![[200, 10, 20, 200], [200, 10, 20, 100]]),
        ("map_Kd opaque.png\nmap_d -mm 0 0.5 cut.png", blend(1.0), vec![[200, 10, 20, 128], [200, 10, 20, 0]]),
        ("map_d cut.png", mask, vec![[255; 4], [255, 255, 255, 0]]),
        // Alpha that nothing says is coverage is left out.
        ("map_Kd leaf.png\nd 0.5", blend(0.5), vec![RED, [10, 200, 20, 255]]),
    ] {
        let (material, found, told) = with_texture(d, &format!("Kd .5\n{mtl}"), TextureSlot::BaseColor);
        assert_eq!((material.coverage, material.alpha), coverage, "{mtl}: {told:?}");
        assert_eq!(found, pixels, "{mtl}");
    }
    let loaded = load_in(d, "Kd 1\nmap_Kd leaf.png");
    assert_eq!(loaded.scene.materials[0].coverage, Coverage::Opaque);
    assert!(matches!(&told(&loaded)[..], [t] if t.contains("the alpha of \"map_Kd\" \"leaf.png\" is not used")));
    for (mtl, alpha) in
        [("d 0.25", 0.25), ("Tr 0.25", 0.75), ("d 0.5\nillum 2\nNs 10", 0.5), ("d 0.5\nPr 1\nNi 1.5", 0.5)]
    {
        let material = load_in(d, &format!("Kd 1\n{mtl}")).scene.materials[0].clone();
        assert_eq!((material.coverage, material.alpha), blend(alpha), "{mtl}");
    }
    // Textured glass is a pane with alpha, unless illum says that light is refracted.
    let pane = load_in(d, "Kd 1\nd 0.5\nNi 1.5\nmap_Kd opaque.png").scene.materials[0].clone();
    assert_eq!((pane.coverage, pane.surface), (Coverage::Blend, Surface::diffuse([1.0; 3])));
}

#[test]
fn roughness_and_metalness() {
    let folder = tempfile::tempdir().unwrap();
    let d = folder.path();
    picture(d, "r.png", 1, 1, |_, _| [50, 50, 50, 255]);
    picture(d, "m.png", 1, 1, |_, _| [250, 250, 250, 255]);
    picture(d, "orm.png", 1, 1, |_, _| [10, 60, 240, 255]);
    // 0.25: an exponent of 250.
    picture(d, "ns.png", 1, 1, |_, _| [51, 51, 51, 255]);
    let ns = |ns: f64| ((1.0 - (ns * 0.2 / 1000.0).sqrt()) * 255.0).round() as u8;
    for (mtl, roughness, metallic, pixel) in [
        ("Pr .3\nmap_Pr r.png", 1.0, 0.0, [255, 50, 255, 255]),
        ("map_Pr r.png\nPm 0.5", 1.0, 0.5, [255, 50, 255, 255]),
        ("Pr .3\nPm 0\nmap_Pm m.png", 0.3, 1.0, [255, 255, 250, 255]),
        ("map_Pr r.png\nmap_Pm m.png", 1.0, 1.0, [255, 50, 250, 255]),
        ("map_Pr -imfchan g orm.png\nmap_Pm -imfchan b orm.png", 1.0, 1.0, [255, 60, 240, 255]),
        ("map_Pr -mm 0.1 0.5 r.png", 1.0, 0.0, [255, 51, 255, 255]),
        ("Ks 1\nNs 500\nmap_Ns ns.png", 1.0, 0.0, [255, ns(500.0), 255, 255]),
        ("map_Ns ns.png", 1.0, 0.0, [255, ns(1000.0), 255, 255]),
    ] {
        let (material, pixels, told) = with_texture(d, &format!("Kd 1\n{mtl}"), TextureSlot::MetallicRoughness);
        assert_eq!(material.surface, of(MetallicRoughness { metallic, ..glossy([1.0; 3], roughness) }), "{mtl}");
        assert_eq!((pixels, told), (vec![pixel], Vec::new()), "{mtl}");
        assert!(!material.textures[&TextureSlot::MetallicRoughness].srgb);
    }
    for (mtl, slot) in [
        ("Pc .5\nmap_Pc r.png", TextureSlot::Coat),
        ("Pc .5\nmap_Pcr r.png", TextureSlot::CoatRoughness),
        ("map_Ps r.png", TextureSlot::SheenColor),
    ] {
        let (_, pixels, _) = with_texture(d, &format!("Kd 1\n{mtl}"), slot);
        assert_eq!(pixels, [[50; 4]], "{mtl}");
    }
}

#[test]
fn relief() {
    let folder = tempfile::tempdir().unwrap();
    let d = folder.path();
    picture(d, "n.png", 2, 2, |_, _| [150, 120, 240, 255]);
    picture(d, "h.png", 8, 1, |x, _| [32 * x as u8; 4]);
    for mtl in ["norm -bm 2 n.png", "map_Kn -bm 2 n.png", "norm -bm 2 n.png\nbump h.png"] {
        let (material, pixels, told) = with_texture(d, &format!("Kd 1\n{mtl}"), TextureSlot::Normal);
        assert_eq!((material.normal_scale, pixels[0], told.len()), (2.0, [150, 120, 240, 255], 0), "{mtl}");
    }
    let (material, pixels, told) = with_texture(d, "Kd 1\nmap_Bump -bm .5 n.png", TextureSlot::Normal);
    assert_eq!((material.normal_scale, pixels[0]), (0.5, [150, 120, 240, 255]));
    assert!(matches!(&told[..], [t] if t.contains("\"map_Bump\" \"n.png\" has normals")), "{told:?}");
    for keyword in ["bump", "map_Bump", "map_bump"] {
        let (material, pixels, told) = with_texture(d, &format!("Kd 1\n{keyword} -bm 3 h.png"), TextureSlot::Normal);
        assert_eq!((material.normal_scale, told.len()), (3.0, 0));
        // Rises by 32/255 a pixel, where white is as high as 0.08 pixels: normals lean to the left.
        let slope = 0.08 * 32.0 / 255.0;
        let code = |x: f64| ((0.5 * x + 0.5) * 255.0).round() as u8;
        assert_eq!(pixels[3], [code(-slope), 128, code(1.0), 255], "{keyword}");
    }
    // Tangents along u and up; vertices are shared where these are.
    let mesh = load_in(d, "Kd 1\nnorm n.png").scene.meshes.remove(0);
    assert_eq!((mesh.positions.len(), mesh.tangents.len()), (4, 4));
    for frame in &mesh.tangents {
        assert_eq!(*frame, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    }
    assert!(load_in(d, "Kd 1").scene.meshes[0].tangents.is_empty());
}

#[test]
fn colours_of_vertices() {
    let load = |text: &str| Scene::from_obj_bytes(text.as_bytes(), "a.obj", None).unwrap();
    let Loaded { scene, warnings, .. } = load("v 0 0 0 1 .5 0\nv 1 0 0\nv 0 1 0 1 2 0.25 1\nv 9 9 9\nf 1 2 3\n");
    let decoded = |code: f64| (((code + 0.055) / 1.055).powf(2.4)) as f32;
    assert_eq!(scene.meshes[0].colors, [[1.0, decoded(0.5), 0.0, 1.0], [1.0; 4], [1.0, 1.0, decoded(0.25), 1.0]]);
    assert!(warnings.iter().any(|w| w.starts_with("a.obj: 1 vertices have a colour that is not")), "{warnings:?}");
    // A weight, and what is no number, are no colours.
    for vertex in ["v 0 0 0 1", "v 0 0 0 1 .5", "v 0 0 0 1 x 0"] {
        assert!(load(&format!("{vertex}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")).scene.meshes[0].colors.is_empty(), "{vertex}");
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.obj"), "v 0 0 0 1 .5 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let text = |keys: &str| {
        format!(
            "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\nhorizontal_fov = 40\n\
             [[mesh]]\nfile = \"a.obj\"\n{keys}\n"
        )
    };
    let colors = |keys: &str| {
        Scene::from_toml_str(&text(keys), "s.toml", Some(folder.path())).map(|loaded| loaded.scene.meshes[0].colors[0])
    };
    assert_eq!(colors("vertex_colors = \"linear\"").unwrap(), [1.0, 0.5, 0.0, 1.0]);
    assert_eq!(colors("vertex_colors = \"srgb\"").unwrap(), [1.0, decoded(0.5), 0.0, 1.0]);
    let message = colors("vertex_colors = \"rgb\"").unwrap_err().to_string();
    assert!(message.contains("s.toml:8:") && message.contains("`srgb` or `linear`"), "{message}");
}

/// Files that are named have to be in the folder of the OBJ file.
#[test]
fn confined_files_stay_in_their_folder() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("inside");
    fs::create_dir(&inside).unwrap();
    picture(folder.path(), "out.png", 1, 1, |_, _| RED);
    picture(&inside, "in.png", 1, 1, |_, _| RED);
    fs::write(folder.path().join("out.mtl"), "newmtl a b\nKd .1 .1 .1\n").unwrap();
    let confined = photolith::scene::LoadOptions { confine: true, ..Default::default() };
    let absolute = folder.path().join("out.png").display().to_string();
    for (name, is_inside) in [("in.png", true), ("../out.png", false), (absolute.as_str(), false)] {
        load_in(&inside, &format!("Kd 1\nmap_Kd {name}"));
        for (options, expected) in [(&confined, is_inside), (&Default::default(), true)] {
            let loaded = Scene::load_with(&inside.join("a.obj"), options).unwrap();
            assert_eq!(loaded.scene.images.len(), usize::from(expected), "{name}: {:?}", loaded.warnings);
        }
    }
    fs::write(inside.join("a.obj"), OBJ.replace("a.mtl", "../out.mtl")).unwrap();
    let Loaded { scene, warnings, .. } = Scene::load_with(&inside.join("a.obj"), &confined).unwrap();
    assert_eq!(scene.materials[0].surface, Surface::diffuse([0.8; 3]));
    assert!(warnings.iter().any(|w| w.contains("out.mtl") && w.contains("confined")), "{warnings:?}");
    assert_eq!(Scene::load(&inside.join("a.obj")).unwrap().scene.materials[0].surface, Surface::diffuse([0.1; 3]));
}
