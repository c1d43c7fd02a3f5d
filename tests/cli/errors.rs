//! Bad input: one clear error, and its exit code.

use super::*;

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
        ("render ball.toml --time-limit 0", &["'0'", "--time-limit", "expected a number of seconds above 0"]),
        ("render ball.toml --time-limit nan", &["'nan'", "--time-limit", "expected a number of seconds"]),
        ("render ball.toml --time-limit 1e30", &["expected a number of seconds above 0 and below 1.8e19"]),
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

#[cfg(unix)]
#[test]
fn an_image_does_not_take_the_place_of_its_scene() {
    let directory = directory();
    let d = directory.path();
    std::os::unix::fs::symlink("ball.toml", d.join("link.png")).unwrap();
    let output = run(d, "render ball.toml --size 8x8 --samples 1 -o link.png");
    assert_fails(&output, 2, &["--output link.png: this file is also read"], "a link to the scene");
}

/// What never ends is not waited for.
#[cfg(unix)]
#[test]
fn what_is_no_file_is_not_read() {
    let directory = directory();
    let d = directory.path();
    std::os::unix::fs::symlink("/dev/zero", d.join("zero.pfm")).unwrap();
    for arguments in [
        "compare zero.pfm zero.pfm",
        "bench ball.toml --size 8x8 --reference zero.pfm",
        "check --filter energy/black --expectations zero.pfm",
        "check --filter energy/black --markdown table.md --with zero.pfm",
    ] {
        assert_fails(&run(d, arguments), 2, &["zero.pfm", "not a regular file"], arguments);
    }
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
