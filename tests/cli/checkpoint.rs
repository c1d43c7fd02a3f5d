//! Renderings in several starts.

use std::time::{Duration, Instant};

use photolith::image::read;

use super::assets::scene_path;
use super::*;

/// The time limit is over before the first dispatch ends, so that each start does one.
#[test]
fn a_rendering_in_several_starts_is_that_of_one() {
    let directory = directory();
    let d = directory.path();
    let render = |options: &str| {
        // Pixels with many times as many samples would take more than a hundred starts.
        let settings = "--size 48x32 --samples 50 --samples-per-dispatch 5 --seed 3 --techniques auto,-sample-map";
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
fn a_complete_rendering_gets_more_samples_later() {
    let directory = directory();
    let d = directory.path();
    let render = |options: &str| {
        let output = run(d, &format!("render ball.toml --size 16x16 --techniques none -o out.pfm {options}"));
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        (text(&output.stderr).to_owned(), read(&d.join("out.pfm")).unwrap().0.pixels().to_vec())
    };
    let (_, whole) = render("--samples 40");
    let (told, begun) = render("--samples 8 --checkpoint rest --keep-checkpoint --time-limit 1e9");
    assert!(told.contains("kept in rest: with more samples"), "{told}");
    assert_eq!(render("--samples 8 --checkpoint rest --keep-checkpoint").1, begun);
    assert_eq!(render("--samples 40 --checkpoint rest").1, whole);
    assert_eq!(names(d), ["ball.toml", "out.pfm"]);
}

#[test]
fn checkpoints_of_other_renderings_are_refused_and_stay() {
    let directory = directory();
    let d = directory.path();
    let in_parts = "render ball.toml --size 16x16 --samples 9 --samples-per-dispatch 1 --techniques -reuse --time-limit 0.000001 \
                    --checkpoint rest -o out.png";
    assert_eq!(run(d, in_parts).status.code(), Some(0));
    let kept = fs::read(d.join("rest")).unwrap();
    put(d, "other.toml", &format!("version = 1\n{CAMERA}{SKY}{}", BALL.replace("radius = 1", "radius = 1.1")));
    for (arguments, words) in [
        (format!("{in_parts} --seed 4"), ["found \"Seed: 0\"", "expected \"Seed: 4\""]),
        (in_parts.replace("9", "8"), ["8 samples per pixel", "begun with 9"]),
        (in_parts.replace("ball", "other"), ["found \"Scene: ", "expected \"Scene: "]),
        (format!("{in_parts} --accel none"), ["found \"Accel: auto\"", "expected \"Accel: none\""]),
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
