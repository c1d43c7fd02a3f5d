//! What commands print and write.

use photolith::image::read;

use super::assets::scene_path;
use super::*;

#[test]
fn every_format_is_written_with_its_metadata_and_nothing_else() {
    let directory = directory();
    let d = directory.path();
    for extension in ["png", "exr", "hdr", "pfm"] {
        let file = format!("out.{extension}");
        let output = run(d, &format!("render ball.toml --size 20x10 --samples 4 --seed 7 -o {file}"));
        assert_eq!(output.status.code(), Some(0), "{file}: {output:?}");
        assert!(output.stdout.is_empty() && output.stderr.is_empty(), "{file}: {output:?}");
        let (image, metadata) = read(&d.join(&file)).unwrap();
        assert_eq!((image.width(), image.height()), (20, 10), "{file}");
        // White sky in the corner; a convex grey body in the middle.
        let near = |a: f32, b: f32| (a - b).abs() < 0.01;
        assert!(near(image.pixel(0, 0).unwrap()[0], 1.0), "{file}");
        assert!(near(image.pixel(10, 5).unwrap()[1], 0.8), "{file}: {:?}", image.pixel(10, 5));
        if extension != "pfm" {
            for (key, value) in [("Scene", "ball.toml"), ("Samples", "4"), ("Seed", "7"), ("MaxDepth", "8")] {
                assert_eq!(metadata.get(key), Some(value), "{file}: {key}");
            }
            assert_eq!(metadata.get("Software"), Some(concat!("photolith ", env!("CARGO_PKG_VERSION"))), "{file}");
            assert!(metadata.get("Device").is_some_and(|d| !d.is_empty()), "{file}");
            assert!(metadata.get("Driver").is_some(), "{file}");
        }
    }
    assert_eq!(names(d), ["ball.toml", "out.exr", "out.hdr", "out.pfm", "out.png"]);
    // Without -o: the scene's name, in the working directory.
    assert_eq!(run(d, "render ball.toml --size 8x8 --samples 1").status.code(), Some(0));
    assert!(d.join("ball.png").exists());
    fs::copy(d.join("ball.toml"), d.join("frame.001.toml")).unwrap();
    assert_eq!(run(d, "render frame.001.toml --size 8x8 --samples 1").status.code(), Some(0));
    assert!(d.join("frame.001.png").exists());
    // An image compared with itself.
    let output = run(d, "compare out.exr out.exr --max-rmse 0 --json");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["rmse"], &json["pass"]), (&0.0.into(), &true.into()));
    let output = run(d, "compare out.png ball.png");
    assert_fails(&output, 2, &["20x10", "8x8"], "compare");
}

#[test]
fn layers_are_written_beside_the_image() {
    let directory = directory();
    let d = directory.path();
    let output = run(d, "render ball.toml --size 20x10 --samples 1 --aov seen.exr -o out.png");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    // Its first colours are the albedo: none of the sky, and that of the ball.
    let (albedo, metadata) = read(&d.join("seen.exr")).unwrap();
    assert_eq!((albedo.width(), albedo.height(), metadata.get("Scene")), (20, 10, Some("ball.toml")));
    assert_eq!(albedo.pixel(0, 0), Some([0.0; 3]));
    assert!(albedo.pixel(10, 5).is_some_and(|color| color[1] > 0.1), "{:?}", albedo.pixel(10, 5));
    for (arguments, expected) in [
        ("render ball.toml --aov seen.png -o b.png", "OpenEXR only"),
        ("render ball.toml --aov seen -o b.png", "OpenEXR only"),
        ("render ball.toml --aov b.exr -o b.exr", "--output writes this file too"),
        ("render ball.toml --aov none/b.exr -o b.png", "none"),
    ] {
        assert_fails(&run(d, arguments), 2, &[expected], arguments);
    }
    assert_eq!(names(d), ["ball.toml", "out.png", "seen.exr"]);
}

/// The program with a file as its standard input.
fn run_with_input(directory: &Path, arguments: &str, input: &str) -> Output {
    let file = fs::File::open(directory.join(input)).expect("a file");
    program(directory).args(arguments.split(' ')).stdin(file).output().expect("the program starts")
}

#[test]
fn scenes_come_by_standard_input_and_images_go_to_standard_output() {
    let directory = directory();
    let d = directory.path();
    put(d, "a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
    put(d, "a.mtl", "newmtl a\nKd 1 0 0\n");
    for name in ["-", "/dev/stdin"] {
        let output = run_with_input(d, &format!("info {name} --json"), "ball.toml");
        assert_eq!(one_line(&output)["spheres"], 1, "{output:?}");
        let output = run_with_input(d, &format!("info {name} --json"), "a.obj");
        assert_eq!(one_line(&output)["materials"][0]["name"], "a", "{output:?}");
    }
    assert_fails(&run(d, "info -"), 2, &["standard input: neither a file nor a pipe"], "/dev/null");
    put(d, "bad.toml", "version = 2\n");
    assert_fails(&run_with_input(d, "info -", "bad.toml"), 2, &["stdin:1:11: version is 2"], "a bad scene");

    let settings = "--size 8x8 --samples 1";
    for format in ["png", "exr", "hdr", "pfm"] {
        let to_stdout = run_with_input(d, &format!("render - {settings} -o - --format {format}"), "ball.toml");
        assert!(to_stdout.status.success() && to_stdout.stderr.is_empty(), "{to_stdout:?}");
        let name = format!("out.{format}");
        fs::write(d.join(&name), &to_stdout.stdout).unwrap();
        let (image, _) = read(&d.join(&name)).unwrap();
        assert_eq!((image.width(), image.height()), (8, 8), "{format}");
    }
    assert!(run_with_input(d, &format!("render - {settings} --format hdr"), "ball.toml").status.success());
    assert!(run(d, &format!("render ball.toml {settings} --format pfm -o other.name")).status.success());
    assert!(fs::read(d.join("other.name")).unwrap().starts_with(b"PF"));
    assert!(d.join("stdin.hdr").exists());
    for (options, words) in
        [("-o -", "expected --format"), ("-o - --format png --json", "both write to standard output")]
    {
        assert_fails(&run(d, &format!("render ball.toml {settings} {options}")), 2, &[words], options);
    }
}

#[test]
fn render_reports_json() {
    let directory = directory();
    let cat = scene_path("cat");
    let arguments = format!("render {} --size 24x16 --samples 4 -o out.png --json --validate", cat.display());
    let output = run(directory.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let json = one_line(&output);
    assert_eq!(json["schema"], "photolith-render-2");
    assert_eq!((&json["output"], &json["spp_done"], &json["stopped"]), (&"out.png".into(), &4.into(), &false.into()));
    assert_eq!((&json["samples"], &json["bad_samples"]), (&(24 * 16 * 4).into(), &0.into()));
    for key in ["setup_s", "render_s", "rays", "shadow_rays", "msamples_per_s", "mrays_per_s", "peak_device_bytes"] {
        assert!(json[key].as_f64().is_some_and(|x| x > 0.0), "{key}: {json}");
    }
    // The room is closed: every path has five hits.
    assert_eq!(json["rays"], 24 * 16 * 4 * 5);
    for key in ["nodes", "leaves", "primitives", "depth", "sah_cost", "bytes", "build_s"] {
        assert!(json["bvh"][key].as_f64().is_some_and(|x| x > 0.0), "{key}: {json}");
    }
    for key in ["device", "driver", "version"] {
        assert!(json[key].as_str().is_some_and(|s| !s.is_empty()), "{key}: {json}");
    }
}

/// Commands that print, and end well.
const PRINTING: [&str; 11] = [
    "info ball.toml",
    "info ball.toml --json",
    "devices",
    "devices --json",
    "check --list",
    "check --list --json",
    "check --filter energy/black",
    "check --filter energy/black --json",
    "compare a.pfm a.pfm",
    "render ball.toml --size 8x8 --samples 1 -o a.pfm --json",
    "bench ball.toml --size 8x8 --rays",
];

#[cfg(unix)]
#[test]
fn a_reader_that_has_heard_enough_is_no_error_and_a_full_disk_is() {
    let directory = directory();
    let d = directory.path();
    assert_eq!(run(d, "render ball.toml --size 8x8 --samples 1 -o a.pfm").status.code(), Some(0));
    let full = || fs::File::options().write(true).open("/dev/full").expect("a device that is always full");
    for arguments in PRINTING.into_iter().chain(["--help", "check --help", "--version"]) {
        let command = || {
            let mut command = program(d);
            command.args(arguments.split(' '));
            command
        };
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = command().stdout(writer).output().expect("the program starts");
        assert_eq!(output.status.code(), Some(0), "{arguments}: {output:?}");
        assert!(!text(&output.stderr).contains("photolith: "), "{arguments}: {output:?}");

        let output = command().stdout(full()).output().expect("the program starts");
        assert_fails(&output, 2, &["photolith: cannot write to standard output: No space left"], arguments);
    }
    // Where nobody can be told, the exit code is still that of the error.
    let output = program(d).args(["info", "gone.toml"]).stderr(full()).output().expect("the program starts");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

#[test]
fn reports_of_checks_are_written_whole_or_refused_at_once() {
    let directory = directory();
    let d = directory.path();
    for option in ["--junit", "--markdown"] {
        let output = run(d, &format!("check --filter energy/black {option} gone/report"));
        assert_fails(&output, 2, &["photolith: cannot write gone/report: No such file"], option);
    }
    let output = run(d, "check --filter energy/black --junit /dev/full --markdown report.md");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(text(&output.stdout).contains("1 of 1 cases pass"), "{output:?}");
    assert!(text(&output.stderr).contains("photolith: cannot write /dev/full: No space left"), "{output:?}");
    assert!(fs::read_to_string(d.join("report.md")).unwrap().contains("`energy/black`"));
    assert_eq!(names(d), ["ball.toml", "report.md"]);
}

#[test]
fn info_and_devices() {
    let directory = directory();
    let d = directory.path();
    let json = one_line(&run(d, &format!("info {} --json", scene_path("glass").display())));
    assert_eq!(json["schema"], "photolith-info-2");
    assert_eq!((&json["spheres"], &json["triangles"], &json["point_lights"]), (&10.into(), &0.into(), &1.into()));
    assert_eq!((&json["width"], &json["samples"], &json["max_depth"]), (&1024.into(), &600.into(), &20.into()));
    assert!(json["bvh"].is_null());
    assert_eq!(json["features"]["dielectric"]["compiled"], true);
    assert_eq!(json["features"]["emitter"]["compiled"], false);
    let output = run(d, "info ball.toml");
    assert_eq!(output.status.code(), Some(0));
    for words in ["1 sphere, 0 meshes, 0 triangles, 1 material, 0 point lights", "left out", "specialised for"] {
        assert!(text(&output.stdout).contains(words), "{output:?}");
    }

    let json = one_line(&run(d, "devices --json"));
    assert_eq!(json["schema"], "photolith-devices-1");
    let picked = json["picked"].as_u64().expect("a device") as usize;
    let device = &json["devices"][picked];
    assert_eq!(device["missing"], Value::Array(Vec::new()));
    assert!(json["reason"].as_str().is_some_and(|r| !r.is_empty()));
    // A device can be asked for by each of its names.
    for name in [picked.to_string(), device["uuid"].as_str().unwrap().to_owned()] {
        let again = one_line(&run(d, &format!("devices --json --device {name}")));
        assert_eq!(again["picked"], json["picked"], "{name}");
        assert!(again["reason"].as_str().unwrap().contains(&name), "{again}");
    }
    assert!(text(&run(d, "devices").stdout).contains(device["name"].as_str().unwrap()));
    for arguments in ["--help", "render --help", "--version"] {
        let output = run(d, arguments);
        assert_eq!((output.status.code(), output.stderr.is_empty()), (Some(0), true), "{arguments}: {output:?}");
    }
}

#[test]
fn vectors_of_any_width_give_the_same_bits() {
    let directory = directory();
    let scene = scene_path("spheres");
    let image = |width: &str, techniques: &str| {
        let output = format!("{width}{techniques}.pfm");
        let mut command = program(directory.path());
        command
            .args(["render", "--size", "40x24", "--samples", "4", "--techniques", techniques, "-o", &output])
            .arg(&scene);
        // The driver's cache does not tell widths apart: the program does.
        command.env_remove("MESA_SHADER_CACHE_DIR").env("LP_NATIVE_VECTOR_WIDTH", width);
        command.env("XDG_CACHE_HOME", directory.path().join("cache"));
        let found = command.output().expect("the program starts");
        assert!(found.status.success(), "{}", text(&found.stderr));
        fs::read(directory.path().join(output)).expect("an image")
    };
    let [shared, own] = ["+reuse", "-reuse"].map(|techniques| image("256", techniques));
    assert_eq!(image("512", "+reuse"), shared);
    assert_eq!(image("512", "-reuse"), own);
    // The four lanes of 128 bits have no room for groups of eight pixels.
    assert_ne!(shared, own);
    assert_eq!(image("128", "+reuse"), own);
}

#[test]
fn views_and_pictures_are_chosen_and_told() {
    let directory = directory();
    let d = directory.path();
    let small = "render ball.toml --size 24x24 --samples 4 --json";
    let rendered = |options: &str| {
        let output = run(d, &format!("{small} {options}"));
        assert!(output.status.success(), "{options}: {}", text(&output.stderr));
        serde_json::from_slice::<Value>(&output.stdout).unwrap()
    };
    let fit = rendered("--camera fit --filter box -o fit.png");
    assert!((fit["camera"]["horizontal_fov"].as_f64().unwrap() - 40.0).abs() < 1e-9);
    assert_eq!(fit["camera"]["filter"], "Box");
    let moved = rendered("--camera 0 --look-from -1,2,6 --look-at 0,0.5,0 --vertical-fov 30 -o moved.png");
    assert_eq!(moved["camera"]["position"], serde_json::json!([-1.0, 2.0, 6.0]));
    let shown = rendered("--exposure auto --tone neutral --transparent -o clear.png");
    assert_eq!(
        (&shown["tone"], &shown["transparent"], &shown["exposure_auto"]),
        (&"neutral".into(), &true.into(), &true.into())
    );
    let bytes = fs::read(d.join("clear.png")).unwrap();
    // Colour type of the header: RGBA.
    assert_eq!(bytes[25], 6);
    for (options, said) in [
        ("--camera 1", "0 \"camera\""),
        ("--look-from 1,2", "X,Y,Z"),
        ("--look-from 0,0,0", "a point apart from position"),
        ("--vertical-fov 180", "between 0 and 180"),
        ("--exposure bright", "or auto"),
        ("--transparent -o clear.hdr", "has no alpha"),
    ] {
        let output = run(d, &format!("{small} {options}"));
        assert!(!output.status.success() && text(&output.stderr).contains(said), "{options}: {}", text(&output.stderr));
    }
}

/// A black ball leaves nothing of an environment that the camera does not see, at its edge neither.
#[test]
fn transparent_images_are_without_the_environment() {
    let directory = directory();
    let d = directory.path();
    put(d, "black.toml", &format!("version = 1\n{CAMERA}{}", BALL.replace("0.8", "0.0")));
    let options = "--environment studio --size 24x24 --samples 16";
    assert_eq!(run(d, &format!("render black.toml {options} --transparent -o black.exr")).status.code(), Some(0));
    let (image, _) = read(&d.join("black.exr")).unwrap();
    assert!(image.pixels().iter().all(|pixel| *pixel == [0.0; 3]));
    assert_eq!(run(d, &format!("render black.toml {options} -o seen.exr")).status.code(), Some(0));
    let (seen, _) = read(&d.join("seen.exr")).unwrap();
    let [black, all] = [seen.pixels().iter().filter(|p| p[0] == 0.0).count(), 24 * 24];
    assert!(black > 20 && black < all / 2, "{black}");
}
