//! OBJ and MTL files: every feature by hand-counted examples, and the message for bad lines.

use std::fs;

use glam::DVec3;
use photolith::Scene;
use photolith::scene::obj::parse_obj;
use photolith::scene::{Environment, Loaded, Mesh, Normals, Surface};

/// Loads an OBJ from memory, without its MTL.
fn load(text: &str) -> Loaded {
    Scene::from_obj_bytes(text.as_bytes(), "a.obj", None).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn error(text: &[u8]) -> String {
    Scene::from_obj_bytes(text, "a.obj", None).expect_err(&String::from_utf8_lossy(text)).to_string()
}

/// The corners of all triangles.
fn soup(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|vertex| mesh.positions[vertex as usize])).collect()
}

fn triangle(corners: [[f64; 3]; 3]) -> [DVec3; 3] {
    corners.map(DVec3::from)
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
const LOWER: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
const UPPER: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn ways_to_write_a_square() {
    for faces in [
        "f 1 2 3 4",
        "f -4 -3 -2 -1",
        "f 1 2 3\nf 1 3 4",
        "f 1/ 2/ 3/ 4/",
        "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1",
        "vn 0 0 1\nf 1//1 2//-1 3//1 4//1",
        "f 1 2 \\\n 3 4",
        "f 1 2 3 4 # comment",
        "\t f  1\t2 3 4  ",
        "s off\ng a b\nl 1 2 3\np 1\nl 1 2\nf 1 2 3 4\nend",
        "o one\nf 1 2 3\no two\nf 1 3 4",
        "f 1 2 3 \\ \t\n 4",
        "f 1 2 3 4 \\",
        "f 1 2 3 4 # not continued \\",
        "f\x0c1 2 3 4",
    ] {
        let text = format!("{SQUARE}{faces}\n");
        let cr_only = text.replace('\n', "\r");
        for text in
            [text.clone(), text.replace('\n', "\r\n"), cr_only, text.trim_end().to_owned(), format!("\u{feff}{text}")]
        {
            let mesh = &load(&text).scene.meshes[0];
            assert_eq!(soup(mesh), [triangle(LOWER), triangle(UPPER)], "{text:?}");
            assert_eq!(mesh.positions.len(), 4, "{text:?}");
        }
    }
    // UTF-16, as Windows' tools write it.
    let utf16: Vec<u8> = format!("\u{feff}{SQUARE}f 1 2 3 4\n").encode_utf16().flat_map(u16::to_le_bytes).collect();
    let wide = Scene::from_obj_bytes(&utf16, "a.obj", None).unwrap();
    assert_eq!(soup(&wide.scene.meshes[0]), [triangle(LOWER), triangle(UPPER)]);
    // Faces before their vertices.
    let early = load(&format!("f 1 2 3 4\n{SQUARE}"));
    assert_eq!(soup(&early.scene.meshes[0]), [triangle(LOWER), triangle(UPPER)]);
}

#[test]
fn numbers_and_ignored_parts() {
    let mesh = load("v +1e0 .5 -2. 1.0\nv 3 0 0 1 0 0\n# c\\\nv 0 3 1e-2\nv 9 9 9\nf 1 2 3\n").scene.meshes.remove(0);
    assert_eq!(soup(&mesh), [triangle([[1.0, 0.5, -2.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.01]])]);
    assert_eq!(mesh.positions.len(), 3, "a vertex that no face uses is dropped");
    assert_eq!(mesh.name, "a.obj");
}

#[test]
fn convex_polygons_become_fans() {
    let text = "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 2 0\nv -1 1 0\nf 1 2 3 4 5\n";
    let mesh = &load(text).scene.meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
}

/// What is not convex is covered once, whatever its first corner and however it lies in space.
#[test]
fn concave_polygons_are_covered_once() {
    let arrow = [[0.0, -0.5], [1.0, -1.0], [0.0, 1.0], [-1.0, -1.0]];
    let u = [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [2.0, 3.0], [2.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
    let star: Vec<[f64; 2]> = (0..100)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 100.0).sin_cos();
            let radius = if i % 2 == 0 { 1.0 } else { 0.25 };
            [radius * cos, radius * sin]
        })
        .collect();
    for (outline, covered) in
        [(&arrow[..], 1.5), (&u, 7.0), (&star, 50.0 * 0.25 * (std::f64::consts::TAU / 100.0).sin())]
    {
        let (x, y) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.48, 0.8, -0.36));
        for turned in 0..outline.len().min(8) {
            for reversed in [false, true] {
                let vertices: String = outline
                    .iter()
                    .map(|[a, b]| 1e-3 * (*a * x + *b * y) + 1.0)
                    .map(|p| format!("v {:?} {:?} {:?}\n", p.x, p.y, p.z))
                    .collect();
                let n = outline.len();
                let mut corners: Vec<String> = (0..n).map(|i| ((i + turned) % n + 1).to_string()).collect();
                if reversed {
                    corners.reverse();
                }
                // A triangle before and after it stay what they are.
                let text = format!("{vertices}f 1 2 3\nf {}\nf 2 3 4\n", corners.join(" "));
                let obj = parse_obj(text.as_bytes(), "a.obj").unwrap();
                assert_eq!(obj.faces.iter().map(|f| f.triangles as usize).collect::<Vec<_>>(), [1, n - 2, 1]);
                let ends = [0, n - 1].map(|i| obj.triangles[i].map(|c| c.position));
                assert_eq!(ends, [[0, 1, 2], [1, 2, 3]]);
                let area = |t: &[photolith::scene::obj::Corner; 3]| {
                    let [a, b, c] = t.map(|corner| obj.positions[corner.position as usize]);
                    (b - a).cross(c - a).dot(x.cross(y)) / 2e-6
                };
                let areas: Vec<f64> = obj.triangles[1..n - 1].iter().map(area).collect();
                let side = if reversed { -1.0 } else { 1.0 };
                assert!(areas.iter().all(|a| side * a > 0.0), "{areas:?}");
                assert!((side * areas.iter().sum::<f64>() - covered).abs() < 1e-6, "{areas:?}: {covered}");
            }
        }
    }
}

#[test]
fn degenerate_faces_are_dropped_and_counted() {
    let faces = "f 1 2 3\nf 1 1 2\nf 1 2 2\nf 5 6 7\nf 1 2 3\nf 8 9 10\nf 1 2 2 3\n";
    let rest = "v 0 0 0\nv .1 .1 .1\nv .3 .3 .3\nv 0 0 0\nv 1e-25 0 0\nv 0 1e-25 0\n";
    let loaded = load(&format!("{SQUARE}{rest}{faces}"));
    let mesh = &loaded.scene.meshes[0];
    // The duplicate is kept, and the half of the quad that has an area.
    assert_eq!(soup(mesh), [triangle(LOWER), triangle(LOWER), triangle(LOWER)]);
    assert_eq!(mesh.degenerate_dropped, 4);
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(warning.contains("a.obj: 4 of 7 faces have no area"), "{warning}");
}

#[test]
fn bad_lines_are_named() {
    for (line, words) in [
        ("v 0 0", "\"v\" has 2 numbers, expected at least 3"),
        ("v 0 x 0", "\"v\" has \"x\", expected a finite number"),
        ("v 0 nan 0", "\"v\" has \"nan\", expected a finite number"),
        ("v 0 inf 0", "\"v\" has \"inf\", expected a finite number"),
        ("v 0 1e308 0", "\"v\" has \"1e308\", expected a finite number of magnitude <= 1e30"),
        ("v 0 1e999 0", "\"v\" has \"1e999\""),
        ("f 1 2", "a face with 2 corners, expected at least 3"),
        ("f", "a face with 0 corners, expected at least 3"),
        ("f 1 2 0", "corner 3 is \"0\", expected"),
        ("f 1 2 5", "vertex 5 of a face, expected at most 4"),
        ("f 1 -5 2", "corner 2 is \"-5\", expected"),
        ("f 1 2 three", "corner 3 is \"three\""),
        ("f 1/1/1/1 2 3", "corner 1 is \"1/1/1/1\""),
        ("f 1.5 2 3", "corner 1 is \"1.5\""),
        ("f 4294967296 2 3", "corner 1 is \"4294967296\""),
        ("f 99999999999999999999 2 3", "corner 1 is"),
        ("f -9223372036854775808 2 3", "corner 1 is"),
    ] {
        // A vertex is wrong where a face has it.
        let face = if line.starts_with('v') { "f 1 2 5" } else { "f 1 2 3" };
        let message = error(format!("{SQUARE}{line}\n{face}\n").as_bytes());
        assert!(message.starts_with("a.obj:5: ") && message.contains(words), "{line}: {message}");
    }
    // Lines are counted through continuations and comments.
    let message = error(b"# one\nv 0 0 0 \\\n\n\nv 1 0 0\r\nv 1 1 0\nf 1 2 4\n");
    assert!(message.starts_with("a.obj:7: "), "{message}");
    assert_eq!(error(b"\x89PNG\r\n\x1a\n\0\0"), error(b""));
    assert!(error(b"").contains("a.obj: empty mesh: 0 faces"));
    assert!(error(format!("{SQUARE}f 1 1 2\n").as_bytes()).contains("empty mesh: 1 faces, 1 of them without area"));
}

/// What no face needs, or no shading, cannot refuse a mesh; where it is needed, it is replaced and counted.
#[test]
fn what_is_not_used_may_be_anything() {
    let bad =
        "v nan 0 0\nv 0 0\nv 1e999 0 0\nvt nan\nvt\nvn nan nan -nan(ind)\nvn 0 1.#QNAN 0\nvn inf 0 0\nvn x\nvn 0 0 1\n";
    for corner in ["", "/9", "/x/9", "//1", "//2", "//3", "//4", "//77", "//-99", "//0", "//z", "/1/5"] {
        let face = |corner: &str| format!("f 1{corner} 2{corner} 3{corner} 4{corner}\n");
        let flat = smooth(&format!("{SQUARE}{bad}{}", face(corner)), "flat");
        assert_eq!((flat.triangles.len(), flat.normals), (2, Normals::Flat), "{corner}");
        let Loaded { scene, warnings, .. } = load(&format!("{SQUARE}{bad}{}", face(corner)));
        let mesh = &scene.meshes[0];
        assert!(mesh.vertex_normals.iter().all(|normal| *normal == DVec3::Z), "{corner}");
        let is_bad = corner.starts_with('/') && !matches!(corner, "/9" | "/1/5");
        match &warnings[..] {
            [] => assert!(!is_bad, "{corner}"),
            [warning] => assert!(is_bad && warning.contains("a.obj: 4 of 4 vertices have a normal"), "{warning}"),
            _ => panic!("{warnings:?}"),
        }
    }
}

/// Two triangles of areas 1 and 4 that share the edge from vertex 1 to 2, at a right angle.
const FOLD: &str = "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 4\n";

fn smooth(obj: &str, normals: &str) -> Mesh {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.obj"), obj).unwrap();
    let text = format!(
        "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\nhorizontal_fov = 40\n\
         [[mesh]]\nfile = \"a.obj\"\nnormals = \"{normals}\"\nrotate = [0, 0, 90]\nscale = 2\ntranslate = [1, 0, 0]\n"
    );
    Scene::from_toml_str(&text, "scene.toml", Some(folder.path())).unwrap().scene.meshes.remove(0)
}

#[test]
fn missing_normals_are_weighted_by_area() {
    // Normals +z (area 1) and +y (area 4), across a change of material; then turned about z: y becomes -x.
    let mesh = smooth(&format!("{FOLD}usemtl a\nf 1 2 3\nusemtl b\nf 1 4 2\n"), "smooth");
    assert_eq!(mesh.normals, Normals::Smooth);
    assert_eq!(mesh.positions[..2], [DVec3::new(1.0, 0.0, 0.0), DVec3::new(1.0, 4.0, 0.0)]);
    let shared = DVec3::new(-4.0, 0.0, 1.0).normalize();
    let expected = [shared, shared, DVec3::Z, DVec3::NEG_X];
    assert_eq!(mesh.vertex_normals.len(), 4);
    for (normal, expected) in mesh.vertex_normals.iter().zip(expected) {
        assert!(normal.abs_diff_eq(expected, 1e-15), "{normal} {expected}");
    }
    let flat = smooth(&format!("{FOLD}vn 1 0 0\nf 1//1 2//1 3//1\n"), "flat");
    assert_eq!((flat.normals, flat.vertex_normals.len()), (Normals::Flat, 0));
}

#[test]
fn normals_of_the_file_are_used_and_split_vertices() {
    let text = format!("{FOLD}vn 0 0 3\nvn 0 5 0\nvn 0 0 0\nf 1//1 2//1 3//1\nf 1//2 4 2//3\n");
    let mesh = smooth(&text, "smooth");
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(mesh.vertex_normals[..5], [DVec3::Z, DVec3::Z, DVec3::Z, DVec3::NEG_X, DVec3::NEG_X]);
    // A normal of length zero is as good as none.
    assert!(mesh.vertex_normals[5].abs_diff_eq(DVec3::new(-4.0, 0.0, 1.0).normalize(), 1e-15));
}

#[test]
fn normals_that_cancel_fall_back_to_a_face() {
    let mesh = smooth("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n", "smooth");
    assert!(mesh.vertex_normals.iter().all(|normal| *normal == DVec3::Z || *normal == DVec3::NEG_Z));
}

/// A cube whose faces have four corners of the texture each: at every vertex three seams meet.
#[test]
fn texture_coordinates_split_no_vertices() {
    let mut corners = String::new();
    for vertex in 0..8 {
        corners.push_str(&format!("v {} {} {}\n", vertex & 1, vertex >> 1 & 1, vertex >> 2));
    }
    let faces = [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]];
    let cube = |corner: &dyn Fn(i32, usize) -> String| {
        let face = |f: &[i32; 4]| format!("f {}\n", [0, 1, 2, 3].map(|i| corner(f[i], i + 1)).join(" "));
        format!("{corners}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n{}", faces.iter().map(face).collect::<String>())
    };
    let plain = cube(&|vertex, _| vertex.to_string());
    let textured = cube(&|vertex, place| format!("{vertex}/{place}"));
    for normals in ["flat", "smooth"] {
        let (plain, textured) = (smooth(&plain, normals), smooth(&textured, normals));
        assert_eq!((plain.positions.len(), plain.triangles.len()), (8, 12));
        assert_eq!(textured, Mesh { name: textured.name.clone(), ..plain }, "{normals}");
    }
}

/// Names of files and of materials as exporters of other systems write them.
#[test]
fn names_are_found_in_other_spellings() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("My Plate.mtl"), "newmtl Red # of the front\nKd 1 0 0\nnewmtl \"blue\"\nKd 0 0 1\n")
        .unwrap();
    fs::write(folder.path().join("b.mtl"), "newmtl Material #1\nKd 0 1 0\nnewmtl twin\nKd 0\nnewmtl TWIN\nKd 0\n")
        .unwrap();
    let surfaces = |libraries: &str, material: &str| {
        let path = folder.path().join("a.obj");
        fs::write(&path, format!("{libraries}\n{SQUARE}usemtl {material}\nf 1 2 3\n")).unwrap();
        let Loaded { scene, warnings, .. } = Scene::load(&path).unwrap();
        (scene.materials[0].surface, warnings)
    };
    let diffuse = |r, g, b| Surface::diffuse([r, g, b]);
    for library in [
        "My Plate.mtl",
        "\"My Plate.mtl\"",
        "'my plate.MTL'",
        "my\\ plate.mtl # red",
        "My%20Plate.mtl",
        "C:\\models\\My Plate.mtl",
        "\"\\\\server\\models\\my plate.mtl\"",
        "/somewhere/else/My Plate.mtl",
        "b.mtl \"My Plate.mtl\"",
        "C:\\models\\b.mtl \"C:\\models\\My Plate.mtl\"",
    ] {
        for material in ["Red", "red", "\"Red\"", "Red # c", "Red # of the front"] {
            let found = surfaces(&format!("mtllib {library}"), material);
            assert_eq!(found, (diffuse(1.0, 0.0, 0.0), Vec::new()), "{library} {material}");
        }
    }
    let library = "mtllib b.mtl \\ \n \"My Plate.mtl\"";
    assert_eq!(surfaces(library, "blue"), (diffuse(0.0, 0.0, 1.0), Vec::new()));
    assert_eq!(surfaces(library, "Material #1"), (diffuse(0.0, 1.0, 0.0), Vec::new()));
    for unknown in ["Material #2", "Twin", "green"] {
        let (surface, warnings) = surfaces(library, unknown);
        assert_eq!(surface, diffuse(0.8, 0.8, 0.8), "{unknown}");
        assert!(matches!(&warnings[..], [w] if w.contains("is in no MTL file")), "{unknown}: {warnings:?}");
    }
    let (_, warnings) = surfaces("mtllib \"gone one.mtl\" gone.mtl", "red");
    assert_eq!(warnings.len(), 3, "{warnings:?}");
    assert!(warnings[0].contains("gone one.mtl") && warnings[1].contains("gone.mtl"), "{warnings:?}");
}

#[test]
fn materials_are_found_beside_the_mesh() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("sub dir")).unwrap();
    fs::write(folder.path().join("sub dir/my colors.mtl"), "newmtl red\nKd 1 0 0\nnewmtl unused\nKe 1 1 1\n").unwrap();
    fs::write(folder.path().join("emitter.mtl"), "newmtl emitter\nKe 5 5 5\n").unwrap();
    let faces = "f 1 2 3\nusemtl red\nf 1 2 3\nusemtl nowhere\nf 1 2 3\nusemtl red\nf 1 3 4\n";
    let obj = |libraries: &str, faces: &str| {
        let path = folder.path().join("a.obj");
        fs::write(&path, format!("{libraries}\n{SQUARE}{faces}")).unwrap();
        Scene::load(&path).unwrap()
    };
    let Loaded { scene, warnings, .. } = obj("mtllib sub dir\\my colors.mtl", faces);
    let names: Vec<_> = scene.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["default grey", "red"], "in order of use");
    assert_eq!(scene.meshes[0].triangle_materials, [0, 1, 0, 1]);
    assert_eq!(scene.materials[0].surface, Surface::diffuse([0.8; 3]));
    assert_eq!(scene.materials[1].surface, Surface::diffuse([1.0, 0.0, 0.0]));
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warning.contains("a.obj:9: the material \"nowhere\""), "{warning}");
    assert!(scene.environment.is_some(), "an emitter that nothing uses gives no light");

    let Loaded { warnings, .. } = obj("mtllib ", "f 1 2 3\n");
    assert!(matches!(&warnings[..], [w] if w.contains("a.obj:1: \"mtllib\" has no file name")), "{warnings:?}");

    // Two files in one statement; the first is not there.
    let Loaded { scene, warnings, .. } = obj("mtllib gone.mtl emitter.mtl", "usemtl emitter\nf 1 2 3\n");
    assert!(matches!(&warnings[..], [w] if w.contains("a.obj:1: ") && w.contains("gone.mtl")), "{warnings:?}");
    assert_eq!(scene.materials[0].surface, Surface::emitter([5.0; 3]));
    assert!(scene.environment.is_none() && scene.background == [0.0; 3], "the mesh lights itself");

    // In a scene file: the mesh's own materials, shared or renamed, or one for all.
    let base = "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\nhorizontal_fov = 40\n\
        [[material]]\nname = \"emitter\"\ntype = \"mirror\"\n";
    let mesh = "[[mesh]]\nfile = \"a.obj\"\n";
    let text = format!("{base}{mesh}{mesh}{mesh}material = \"emitter\"\n");
    let scene = Scene::from_toml_str(&text, "scene.toml", Some(folder.path())).unwrap().scene;
    let names: Vec<_> = scene.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["emitter", "emitter (2)"]);
    let used: Vec<_> = scene.meshes.iter().map(|mesh| mesh.triangle_materials[0]).collect();
    assert_eq!(used, [1, 1, 0]);
}

#[test]
fn a_mesh_alone_is_framed_and_lit() {
    let text = "v -3 1 7\nv 5 1 7\nv 1 9 6\nv 1 2 -1\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n";
    let Loaded { scene, warnings, .. } = load(text);
    assert!(warnings.is_empty());
    assert_eq!(scene.environment, Some(Environment::studio()));
    assert!(scene.lights.is_empty());
    assert_eq!((scene.film.width, scene.film.height, scene.integrator.samples), (512, 512, 64));
    let camera = &scene.camera;
    assert!((camera.horizontal_fov - 40.0).abs() < 1e-9);
    let forward = (camera.target - camera.position).normalize();
    let right = forward.cross(camera.up).normalize();
    let up = right.cross(forward);
    assert!(-forward.z > 0.8 && forward.y < 0.0, "seen from +z, a little from the side and above");
    let mut farthest: f64 = 0.0;
    for &position in &scene.meshes[0].positions {
        let p = position - camera.position;
        let tangent = 20_f64.to_radians().tan() * p.dot(forward);
        assert!(p.dot(forward) > 0.0);
        farthest = farthest.max(p.dot(right).abs() / tangent).max(p.dot(up).abs() / tangent);
    }
    assert!(farthest < 1.0 && farthest > 0.5, "all in the image, and large: {farthest}");
    assert_eq!(camera.target, DVec3::new(1.0, 5.0, 3.0));
}

/// Reads the positions of `v` and `f`, and nothing else.
fn minimal_reader(text: &str) -> Vec<[DVec3; 3]> {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for line in text.lines() {
        match line.split_whitespace().collect::<Vec<_>>()[..] {
            ["v", x, y, z] => positions.push(DVec3::from([x, y, z].map(|word| word.parse::<f64>().unwrap()))),
            ["f", ref corners @ ..] => {
                let corner = |word: &str| match word.split('/').next().unwrap().parse::<isize>().unwrap() {
                    back @ ..0 => positions[positions.len().checked_add_signed(back).unwrap()],
                    index => positions[index as usize - 1],
                };
                let fan = corners[1..].windows(2);
                triangles.extend(fan.map(|pair| [corner(corners[0]), corner(pair[0]), corner(pair[1])]));
            }
            _ => {}
        }
    }
    triangles
}

#[test]
fn agrees_with_a_minimal_reader() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes");
    let mut count = 0;
    for path in fs::read_dir(root).unwrap().map(|entry| entry.unwrap().path()) {
        if path.extension().is_none_or(|extension| extension != "obj") {
            continue;
        }
        count += 1;
        let expected = minimal_reader(&fs::read_to_string(&path).unwrap());
        assert_eq!(soup(&Scene::load(&path).unwrap().scene.meshes[0]), expected, "{path:?}");
    }
    assert!(count > 0);
}

/// Files that `tobj` alone would read wrongly or not at all.
#[test]
fn statements_that_libraries_stumble_over() {
    for text in [
        "v 0 0 0 2\nv 1 0 0 0\nv 1 1 0 -1\nv 0 1 0 1 1\nf 1 2 3 4\n",
        "v 0 0 0 1 1 1\nv 1 0 0\nv 1 1 0 .5 .5 .5 1\nv 0 1 0\nl 1 2 3 4\nl 1 2 3\nf 1 2 3 4\nusemtl\n",
        "vt 1\nvn 0 0 1\nvt 0 1 0\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2/1 3//1 4/2/1\n",
    ] {
        let mesh = &load(text).scene.meshes[0];
        assert_eq!(soup(mesh), [triangle(LOWER), triangle(UPPER)], "{text}");
        if text.contains("vn") {
            assert!(mesh.vertex_normals.iter().all(|&normal| normal == DVec3::Z));
        }
    }
    // Corners without a normal do not take that of the corner before.
    let mesh = smooth(&format!("vn 1 0 0\n{FOLD}f 1//1 2 3\n"), "smooth");
    assert_eq!(mesh.vertex_normals, [DVec3::Y, DVec3::Z, DVec3::Z]);
}

#[test]
fn large_files_take_linear_time() {
    // A million faces without area, and half a million materials: quadratic work would take hours.
    let mut text = String::from("v 0 0 0\nv 1 1 1\nv 2 2 2\n");
    text.push_str(&"f 1 2 3\n".repeat(1_000_000));
    assert!(error(text.as_bytes()).contains("empty mesh: 1000000 faces, 1000000 of them without area"));
    let mut text = String::from(SQUARE);
    (0..200_000).for_each(|i| text.push_str(&format!("mtllib m{i} m\nusemtl m{i}\no o{i}\nf 1 2 3\n")));
    text.push_str(&format!("f {}\n", "1 2 3 ".repeat(100_000)));
    text.push_str(&"\\\n".repeat(200_000));
    assert_eq!(parse_obj(text.as_bytes(), "a.obj").unwrap().material_names.len(), 200_000);
    let scene = load(&text).scene;
    assert!(scene.triangle_count() >= 300_000);
    assert_eq!(scene.materials.len(), 1);
}
