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
        ("render ball.toml --techniques fast", &["'fast' is no technique", "auto, none, all", "reuse, gradients"]),
        ("render ball.toml --techniques none,+gradients", &["'+gradients' needs reuse"]),
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
    let made = Command::new("mkfifo").arg(d.join("pipe")).status().unwrap();
    assert!(made.success());
    fs::File::create(d.join("huge")).unwrap().set_len(1 << 42).unwrap();
    let render = "render ball.toml --size 8x8 --samples 1 -o out.png";
    assert_fails(
        &run(d, &format!("{render} --checkpoint pipe")),
        2,
        &["pipe cannot be read: it is not a regular"],
        "a pipe",
    );
    assert_fails(
        &run(d, &format!("{render} --checkpoint huge")),
        2,
        &["huge cannot be read: it has", "at most"],
        "a file",
    );
    assert_fails(&run(d, "render ball.toml --size 8x8 --samples 1 --format png -o pipe"), 2, &["nobody reads"], "pipe");
    assert_fails(&run(d, "info pipe"), 2, &["pipe"], "pipe");
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
    fs::rename(directory.path().join("shaders/path_trace.spv"), directory.path().join("shaders/path_interleaved.spv"))
        .unwrap();
    assert!(run(directory.path(), render).status.success());
    assert!(directory.path().join("ball.png").exists());
}

#[test]
fn an_image_too_large_for_memory_is_an_error() {
    let directory = directory();
    let output = run(directory.path(), "render ball.toml -o out.png --size 65536x65536");
    assert_fails(&output, 2, &["65536x65536 pixels needs at least 208.0 GiB", "are available"], "65536x65536");
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
        let words = ["no Vulkan device found", "VK_ICD_FILENAMES=/nonexistent", "mesa-vulkan-drivers"];
        assert_fails(&output, 3, &words, command);
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

/// Names and keys of files are shown, but do nothing to a terminal.
#[test]
fn no_control_character_reaches_a_terminal() {
    let directory = directory();
    let d = directory.path();
    put(d, "key.toml", &format!("version = 1\n{CAMERA}{BALL}\"\\u001b[31mred\\u0007\" = 1\n"));
    put(d, "name.toml", &format!("version = 1\n{CAMERA}{SKY}{BALL}").replace("white", "w\\u001b]0;t\\u0007\\nx"));
    put(d, "word.obj", "v 0 0 0\nv 1 0 0\nv \x1b[2J 0 0\nusemtl \x1b[1m\x7f\u{9b}\u{202e}\nf 1 2 3\n");
    put(d, "material.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl \x1b[1m\x7f\u{9b}\u{202e}\nf 1 2 3\n");
    put(d, "\x1b[31m.toml", "version = 2\n");
    put(d, "two\nlines.toml", "version = 2\n");
    for arguments in [
        &["info", "key.toml"][..],
        &["info", "name.toml"],
        &["info", "name.toml", "--json"],
        &["info", "word.obj"],
        &["info", "material.obj"],
        &["info", "\x1b[31m.toml"],
        &["info", "two\nlines.toml"],
        &["info", "\x1b[32mgone.toml"],
        &["info", "ball.toml", "--size", "\x1b[31m"],
        &["\x1b[31m"],
        &["render", "ball.toml", "--device", "\x1b[31m"],
        &["check", "--filter", "\x1b[31m"],
    ] {
        let output = program(d).args(arguments).output().unwrap();
        for text in [text(&output.stdout), text(&output.stderr)] {
            let acts = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
            assert!(!text.contains(acts), "{arguments:?}: {text:?}");
        }
        assert!(!output.stdout.is_empty() || !output.stderr.is_empty(), "{arguments:?}");
        if arguments.contains(&"--json") {
            assert!(one_line(&output)["materials"][0]["name"].as_str().is_some_and(|name| name.contains('\u{1b}')));
        }
    }
}

#[test]
fn warnings_are_errors_where_that_is_asked_for() {
    let directory = directory();
    let d = directory.path();
    put(d, "black.toml", &format!("version = 1\n{CAMERA}{BALL}"));
    for command in ["info", "render --size 8x8 --samples 1 -o out.png"] {
        assert_eq!(run(d, &format!("{command} black.toml")).status.code(), Some(0));
        assert_eq!(run(d, &format!("{command} ball.toml --strict")).status.code(), Some(0));
        fs::remove_file(d.join("out.png")).ok();
        let words = ["the image will be black", "1 warning, expected none with --strict"];
        assert_fails(&run(d, &format!("{command} black.toml --strict")), 2, &words, command);
        assert!(!d.join("out.png").exists());
    }
}
