//! The program from outside: exit codes, what stdout and stderr carry, and the files that it leaves.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use common::scene_path;
use photolith::image::read;
use serde_json::Value;

const CAMERA: &str = "[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\nhorizontal_fov = 40\n";
const BALL: &str = "[[material]]\nname = \"white\"\ntype = \"diffuse\"\nreflectance = [0.8, 0.8, 0.8]\n\
                    [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"white\"\n";
const SKY: &str = "[background]\nradiance = [1, 1, 1]\n";

fn program(directory: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_photolith"));
    command.current_dir(directory).stdin(Stdio::null()).env_remove("RUST_LOG");
    command
}

/// Runs the program in `directory` with arguments that have no spaces.
fn run(directory: &Path, arguments: &str) -> Output {
    program(directory).args(arguments.split_ascii_whitespace()).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

/// A directory with a small good scene, `ball.toml`.
fn directory() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    put(directory.path(), "ball.toml", &format!("version = 1\n{CAMERA}{SKY}{BALL}"));
    directory
}

fn put(directory: &Path, name: &str, content: &str) {
    fs::write(directory.join(name), content).expect("a file");
}

fn names(directory: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Asserts the exit code, that stdout is empty, and that the one message has the words and is no panic.
fn assert_fails(output: &Output, code: i32, words: &[&str], what: &str) {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{what}: {output:?}");
    assert!(output.stdout.is_empty(), "{what}: {output:?}");
    assert!(!stderr.contains("panicked"), "{what}: {stderr}");
    for word in words {
        assert!(stderr.contains(word), "{what}: {stderr:?} should contain {word:?}");
    }
}

#[test]
fn bad_scenes_are_code_2_and_name_file_and_line() {
    let directory = directory();
    let d = directory.path();
    put(d, "key.toml", &format!("version = 1\n{CAMERA}{BALL}inwards = true\n"));
    put(d, "type.toml", &format!("version = 1\n{CAMERA}{}", BALL.replace("radius = 1", "radius = \"big\"")));
    put(d, "nan.toml", &format!("version = 1\n{CAMERA}{}", BALL.replace("radius = 1", "radius = nan")));
    put(d, "negative.toml", &format!("version = 1\n{CAMERA}{}", BALL.replace("radius = 1", "radius = -1")));
    put(d, "empty.toml", &format!("version = 1\n{CAMERA}"));
    put(d, "zero.toml", &format!("version = 1\n{CAMERA}{BALL}[film]\nwidth = 0\n"));
    put(d, "nomesh.toml", &format!("version = 1\n{CAMERA}[[mesh]]\nfile = \"gone.obj\"\n"));
    put(d, "index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    put(d, "empty.obj", "v 0 0 0\n");
    put(d, "scene.txt", "version = 1\n");
    fs::write(d.join("bytes.toml"), b"version = 1\n\xff").unwrap();
    fs::create_dir(d.join("folder.toml")).unwrap();
    for (scene, words) in [
        ("gone.toml", &["gone.toml", "No such file"][..]),
        ("folder.toml", &["folder.toml", "folder, expected a file"]),
        ("scene.txt", &["scene.txt", ".toml", ".obj"]),
        ("bytes.toml", &["bytes.toml:2", "UTF-8"]),
        ("key.toml", &["key.toml:14", "inwards"]),
        ("type.toml", &["type.toml:12", "radius", "big"]),
        ("nan.toml", &["nan.toml:12", "sphere 1", "radius is NaN"]),
        ("negative.toml", &["negative.toml:12", "sphere 1", "radius is -1"]),
        ("empty.toml", &["empty.toml", "no sphere and no mesh"]),
        ("zero.toml", &["zero.toml:15", "film", "width is 0"]),
        ("nomesh.toml", &["nomesh.toml:7", "mesh 1", "gone.obj", "No such file"]),
        ("index.obj", &["index.obj:4", "9"]),
        ("empty.obj", &["empty.obj"]),
    ] {
        for command in ["render -o out.png", "info"] {
            let output = run(d, &format!("{command} {scene}"));
            assert_fails(&output, 2, words, &format!("{command} {scene}"));
        }
    }
    assert!(!d.join("out.png").exists());
}

#[test]
fn bad_options_are_code_2() {
    let directory = directory();
    fs::create_dir(directory.path().join("folder.png")).unwrap();
    for (arguments, words) in [
        ("", &["Usage"][..]),
        ("paint", &["paint"]),
        ("render", &["<SCENE>"]),
        ("render ball.toml --size 12", &["'12' is not a size", "640x480"]),
        ("render ball.toml --size 0x5", &["'0x5' is not a size"]),
        ("render ball.toml --size 70000x1", &["'70000x1' is not a size"]),
        ("render ball.toml --samples 0", &["--samples"]),
        ("render ball.toml --samples many", &["--samples"]),
        ("render ball.toml --max-depth 0", &["--max-depth"]),
        ("render ball.toml --seed -1", &["-1"]),
        ("render ball.toml --time-limit 0", &["'0' is not a time"]),
        ("render ball.toml --time-limit nan", &["'nan' is not a time"]),
        ("render ball.toml --time-limit 1e30", &["'1e30' is not a time, expected seconds above 0 and below 1.8e19"]),
        ("compare a.pfm a.pfm --heatmap map.jpg", &["map.jpg: an error map is written as .png"]),
        ("render ball.toml --accel grid", &["grid", "bvh", "none"]),
        ("render ball.toml --intersection fast", &["fast", "watertight", "moller-trumbore"]),
        ("render ball.toml -o out.jpg", &["out.jpg", ".png, .exr, .hdr, .pfm"]),
        ("render ball.toml -o out", &["out", ".png, .exr, .hdr, .pfm"]),
        ("render ball.toml -o gone/out.png", &["gone/out.png", "No such file"]),
        ("render ball.toml -o folder.png", &["folder.png", "directory"]),
        ("render ball.toml -o /dev/null/out.png", &["/dev/null/out.png", "Not a directory"]),
        ("render ball.toml -o out.png --size 8x8 --loop-budget 1 --scheduler inline", &["loop budget of 1"]),
        ("render ball.toml -o out.png --size 8x8 --workgroup 1025", &["1025"]),
    ] {
        assert_fails(&run(directory.path(), arguments), 2, words, arguments);
    }
    assert_eq!(names(directory.path()), ["ball.toml", "folder.png"]);
}

#[test]
fn a_folder_of_shaders_must_have_some() {
    let directory = directory();
    let render = "render ball.toml --size 8x8 --samples 1 --spirv shaders -o ball.png";
    assert_fails(&run(directory.path(), render), 2, &["shaders: no shader is there", "path_trace.spv"], "no folder");
    fs::create_dir(directory.path().join("shaders")).expect("a folder");
    put(directory.path(), "shaders/other.spv", "");
    assert_fails(&run(directory.path(), render), 2, &["no shader is there"], "another file");
    put(directory.path(), "shaders/path_trace.spv", "no SPIR-V at all, but long enough");
    assert_fails(&run(directory.path(), render), 2, &["path_trace.spv: not a SPIR-V module"], "a text");
    // The kernel that this rendering needs is not there: the built-in one is used.
    fs::rename(directory.path().join("shaders/path_trace.spv"), directory.path().join("shaders/path_turns.spv"))
        .unwrap();
    assert!(run(directory.path(), render).status.success());
    assert!(directory.path().join("ball.png").exists());
}

#[test]
fn an_image_too_large_for_memory_is_an_error() {
    let directory = directory();
    let output = run(directory.path(), "render ball.toml -o out.png --size 65536x65536");
    assert_fails(&output, 2, &["65536"], "65536x65536");
    assert_eq!(names(directory.path()), ["ball.toml"]);
}

#[test]
fn no_device_is_code_3() {
    let directory = directory();
    for device in ["99", "no-such-card", "00000000-0000-0000-0000-000000000000"] {
        let output = run(directory.path(), &format!("render ball.toml -o out.png --device {device}"));
        assert_fails(&output, 3, &[device, "there are: 0: "], device);
    }
    for command in ["render ball.toml -o out.png", "devices"] {
        let output = program(directory.path())
            .args(command.split(' '))
            .env("VK_DRIVER_FILES", "/nonexistent")
            .env("VK_ICD_FILENAMES", "/nonexistent")
            .output()
            .unwrap();
        assert_fails(&output, 3, &["no Vulkan device found", "mesa-vulkan-drivers"], command);
    }
    let output = program(directory.path())
        .args(["devices", "--json"])
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    assert!(text(&output.stderr).contains("no Vulkan device found"), "{output:?}");
    let json = one_line(&output);
    assert_eq!((&json["devices"], &json["picked"]), (&Value::Array(Vec::new()), &Value::Null));
    assert_eq!(names(directory.path()), ["ball.toml"]);
}

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
    // An image compared with itself.
    let output = run(d, "compare out.exr out.exr --max-rmse 0 --json");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["rmse"], &json["pass"]), (&0.0.into(), &true.into()));
    let output = run(d, "compare out.png ball.png");
    assert_fails(&output, 2, &["20x10", "8x8"], "compare");
}

#[test]
fn render_reports_json() {
    let directory = directory();
    let cat = scene_path("cat");
    let arguments = format!("render {} --size 24x16 --samples 4 -o out.png --json --validate", cat.display());
    let output = run(directory.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let json = one_line(&output);
    assert_eq!(json["schema"], "photolith-render-1");
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

fn one_line(output: &Output) -> Value {
    let stdout = text(&output.stdout);
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    serde_json::from_str(stdout).expect("JSON")
}

#[test]
fn info_and_devices() {
    let directory = directory();
    let d = directory.path();
    let json = one_line(&run(d, &format!("info {} --json", scene_path("glass").display())));
    assert_eq!(json["schema"], "photolith-info-1");
    assert_eq!((&json["spheres"], &json["triangles"], &json["point_lights"]), (&10.into(), &0.into(), &1.into()));
    assert_eq!((&json["width"], &json["samples"], &json["max_depth"]), (&1024.into(), &600.into(), &20.into()));
    assert!(json["tree"].is_null());
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

/// Hours of work, to be stopped.
const LONG: &str = "--size 512x512 --samples 1000000";

#[test]
fn the_time_limit_stops_in_time_and_writes_the_image() {
    let directory = directory();
    let start = Instant::now();
    let spheres = scene_path("spheres");
    let output =
        run(directory.path(), &format!("render {} {LONG} -o out.pfm --time-limit 1.5 --json", spheres.display()));
    let elapsed = start.elapsed();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(text(&output.stderr).contains("time limit reached"), "{output:?}");
    let json = one_line(&output);
    assert_eq!(json["stopped"], true);
    assert!(json["spp_done"].as_u64().is_some_and(|n| n >= 1), "{json}");
    // Tests run beside each other: room for a busy machine, but nowhere near the hours of the whole work.
    let rendering = json["render_s"].as_f64().unwrap();
    assert!((0.5..4.0).contains(&rendering) && elapsed < Duration::from_secs(30), "{rendering} s, {elapsed:?}");
    assert_eq!(names(directory.path()), ["ball.toml", "out.pfm"]);
    let (image, _) = read(&directory.path().join("out.pfm")).unwrap();
    // Every pixel was rendered; in the closed room hardly any sample remains dark.
    let dark = image.pixels().iter().filter(|p| !p.iter().all(|&c| c > 0.0 && c.is_finite())).count();
    assert!(dark < 512 * 512 / 1000, "{dark} pixels without light");
}

#[test]
fn the_time_limit_leaves_no_pixel_out() {
    let directory = directory();
    // Its meshes make it one in which some tiles go ahead, to try whether paths are worth reusing; and so large that it
    // takes more than the dispatches that are begun at once.
    let cat = scene_path("cat");
    let output = run(
        directory.path(),
        &format!(
            "render {} --scheduler queue --size 1024x640 --samples 100000 -o out.pfm --time-limit 0.001 --json",
            cat.display()
        ),
    );
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let json = one_line(&output);
    assert_eq!(json["stopped"], true);
    assert!(json["spp_done"].as_u64().is_some_and(|n| n >= 1), "{json}");
    assert!(json["reuse_gain"].as_f64().is_some_and(|gain| gain > 0.0), "{json}");
    let (image, _) = read(&directory.path().join("out.pfm")).unwrap();
    let dark = image.pixels().iter().filter(|p| !p.iter().all(|&c| c > 0.0 && c.is_finite())).count();
    assert!(dark < 1024 * 640 / 1000, "{dark} pixels without light");
}

/// The time limit is over before the first dispatch ends, so that each start does one.
#[test]
fn a_rendering_in_several_starts_is_that_of_one() {
    let directory = directory();
    let d = directory.path();
    let render = |options: &str| {
        let settings = "--size 48x32 --samples 50 --samples-per-dispatch 5 --seed 3";
        let scene = scene_path("cornell");
        let output = run(d, &format!("render {} {settings} -o out.exr {options}", scene.display()));
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        text(&output.stderr).to_owned()
    };
    render("--time-limit 1e9");
    let (whole, _) = read(&d.join("out.exr")).unwrap();
    let mut starts = 0;
    let in_parts = "--time-limit 0.000001 --checkpoint rest";
    while render(in_parts).contains("kept in rest: the same command goes on from there") {
        starts += 1;
        assert!(d.join("rest").exists() && starts < 50, "{starts} starts");
        assert!(read(&d.join("out.exr")).is_ok());
    }
    assert!(starts > 1);
    assert_eq!(names(d), ["ball.toml", "out.exr"]);
    assert_eq!(read(&d.join("out.exr")).unwrap().0.pixels(), whole.pixels());
    // Kept from time to time, within one start.
    render("--time-limit 1e9 --checkpoint rest --checkpoint-every 0.000001");
    assert_eq!(names(d), ["ball.toml", "out.exr"]);
    assert_eq!(read(&d.join("out.exr")).unwrap().0.pixels(), whole.pixels());
}

#[test]
fn checkpoints_of_other_renderings_are_refused_and_stay() {
    let directory = directory();
    let d = directory.path();
    let in_parts = "render ball.toml --size 16x16 --samples 9 --samples-per-dispatch 1 --reuse off --time-limit 0.000001 \
                    --checkpoint rest -o out.png";
    assert_eq!(run(d, in_parts).status.code(), Some(0));
    let kept = fs::read(d.join("rest")).unwrap();
    put(d, "other.toml", &format!("version = 1\n{CAMERA}{SKY}{}", BALL.replace("radius = 1", "radius = 1.1")));
    for (arguments, words) in [
        (format!("{in_parts} --seed 4"), ["found \"Seed: 0\"", "expected \"Seed: 4\""]),
        (in_parts.replace("9", "10"), ["found \"Samples: 9\"", "expected \"Samples: 10\""]),
        (in_parts.replace("ball", "other"), ["found \"Scene: ", "expected \"Scene: "]),
        (format!("{in_parts} --accel none"), ["found \"Accel: bvh\"", "expected \"Accel: none\""]),
        (in_parts.replace("--time-limit 0.000001", ""), ["found \"TimeLimit: some\"", "expected \"TimeLimit: none\""]),
        (format!("{in_parts} --noise 0.1"), ["--noise", "--checkpoint"]),
        (in_parts.replace("rest", "out.png"), ["--checkpoint out.png", "--output writes this file too"]),
        (in_parts.replace("rest", "ball.toml"), ["--checkpoint ball.toml", "also read"]),
    ] {
        assert_fails(&run(d, &arguments), 2, &words, &arguments);
        assert_eq!(fs::read(d.join("rest")).unwrap(), kept, "{arguments}");
    }
    for (damaged, word) in [(&kept[..kept.len() - 1], "damaged"), (&b"a text"[..], "not a checkpoint")] {
        fs::write(d.join("rest"), damaged).unwrap();
        assert_fails(&run(d, in_parts), 2, &["rest", word], word);
        assert_eq!(fs::read(d.join("rest")).unwrap(), damaged);
    }
}

#[cfg(unix)]
#[test]
fn an_image_that_cannot_be_written_leaves_its_checkpoint() {
    let directory = directory();
    let d = directory.path();
    std::os::unix::fs::symlink("/dev/full", d.join("out.pfm")).unwrap();
    let arguments = "render ball.toml --size 16x16 --samples 9 -o out.pfm --checkpoint rest";
    let output = run(d, arguments);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    for words in ["cannot write out.pfm", "kept in rest: the same command goes on from there"] {
        assert!(text(&output.stderr).contains(words), "{output:?}");
    }
    fs::remove_file(d.join("out.pfm")).unwrap();
    assert_eq!(run(d, arguments).status.code(), Some(0));
    assert_eq!(names(d), ["ball.toml", "out.pfm"]);
}

/// The program at work with such arguments, after Ctrl-C.
#[cfg(unix)]
fn interrupted(directory: &Path, arguments: &str) -> Child {
    let mut child =
        program(directory).args(arguments.split(' ')).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // Compiled and at work by then, even on a busy machine; if not, what it begins with still runs.
    std::thread::sleep(Duration::from_secs(4));
    assert!(child.try_wait().unwrap().is_none(), "the program ended by itself");
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    child
}

#[cfg(unix)]
#[test]
fn ctrl_c_writes_what_there_is() {
    let directory = directory();
    let child = interrupted(directory.path(), &format!("render {} {LONG} -o out.png", scene_path("spheres").display()));
    let start = Instant::now();
    let output = child.wait_with_output().unwrap();
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    assert!(text(&output.stderr).contains("interrupted after"), "{output:?}");
    assert!(output.stdout.is_empty(), "{output:?}");
    assert_eq!(names(directory.path()), ["ball.toml", "out.png"]);
    let (image, metadata) = read(&directory.path().join("out.png")).unwrap();
    assert_eq!(image.width(), 512);
    assert!(metadata.get("Samples").unwrap().parse::<f64>().unwrap() >= 1.0);
}

/// A folder that is gone stands for a disk that is full.
#[cfg(unix)]
#[test]
fn a_checkpoint_that_cannot_be_written_costs_no_image() {
    let directory = directory();
    let d = directory.path();
    fs::create_dir(d.join("gone")).unwrap();
    let arguments = format!("render {} {LONG} -o out.png", scene_path("spheres").display());
    let mut child = program(d)
        .args(arguments.split(' ').chain("--checkpoint gone/rest --checkpoint-every 0.1 --time-limit 8".split(' ')))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !d.join("gone/rest").exists() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(20));
    }
    // It may be about to be written once more.
    while fs::remove_dir_all(d.join("gone")).is_err() {}
    assert!(child.try_wait().unwrap().is_none(), "the program ended by itself");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(text(&output.stderr).contains("what is done is not kept: cannot write gone/rest"), "{output:?}");
    assert_eq!(names(d), ["ball.toml", "out.png"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_lets_the_running_case_end_and_reports_the_others_as_not_run() {
    let directory = directory();
    let child = interrupted(directory.path(), "check --jobs 1 --json --junit report.xml");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    let cases = &one_line(&output)["devices"][0]["cases"];
    let cases = cases.as_array().unwrap();
    let left: Vec<_> = cases.iter().filter(|c| c["verdict"] == "not_run").collect();
    assert!(!left.is_empty() && left.iter().all(|c| c["message"] == "interrupted"), "{output:?}");
    assert!(fs::read_to_string(directory.path().join("report.xml")).unwrap().contains("interrupted"));
}

#[test]
fn vectors_of_any_width_give_the_same_bits() {
    let directory = directory();
    let scene = scene_path("spheres");
    for (width, output) in [(None, "widest.pfm"), (Some("256"), "256.pfm"), (Some("128"), "128.pfm")] {
        let mut command = program(directory.path());
        // Groups of eight pixels do not fit into the four lanes of 128 bits, and meet in memory.
        command.args(["render", "--size", "40x24", "--samples", "4", "--reuse", "always", "-o", output]).arg(&scene);
        command.env_remove("MESA_SHADER_CACHE_DIR").env_remove("LP_NATIVE_VECTOR_WIDTH");
        // The driver's cache does not tell widths apart.
        command.env("XDG_CACHE_HOME", directory.path().join(output).with_extension("cache"));
        if let Some(width) = width {
            command.env("LP_NATIVE_VECTOR_WIDTH", width);
        }
        let found = command.output().expect("the program starts");
        assert!(found.status.success(), "{}", text(&found.stderr));
    }
    let image = |name| fs::read(directory.path().join(name)).expect("an image");
    assert_eq!(image("widest.pfm"), image("256.pfm"));
    assert_eq!(image("128.pfm"), image("256.pfm"));
}
