//! `photolith compare` from outside: exit codes, and what stdout and stderr carry.

use photolith::image::{Image, Metadata, Variance, read, write};
use photolith::scene::Transfer;

use super::*;

fn compare(directory: &Path, arguments: &str) -> Output {
    run(directory, &format!("compare {arguments}"))
}

/// A directory with reference.exr (a ramp), shifted.exr (0.01 brighter; both with noise of 0.001), equal.pfm,
/// nan.pfm, small.png.
fn images() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let save = |name: &str, image: &Image| {
        write(&directory.path().join(name), image, &Metadata::new(), Transfer::Srgb).unwrap();
    };
    let ramp = |shift: f32| {
        Image::from_fn(40, 20, |x, y| [x as f32 / 40.0 + shift, y as f32 / 20.0 + shift, 0.5 + shift]).unwrap()
    };
    let noisy = |shift| ramp(shift).with_variance(Variance { of_mean: vec![[1e-6; 3]; 800], batches: 16 }).unwrap();
    save("reference.exr", &noisy(0.0));
    save("shifted.exr", &noisy(0.01));
    save("equal.pfm", &ramp(0.0));
    let mut nan = ramp(0.0);
    nan.pixels_mut()[41][1] = f32::NAN;
    save("nan.pfm", &nan);
    save("small.png", &Image::new(2, 2).unwrap());
    directory
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

#[test]
fn exit_codes() {
    let directory = images();
    for (arguments, expected, said) in [
        ("shifted.exr reference.exr", 0, ""),
        ("equal.pfm reference.exr --max-rmse 0 --max-flip 0 --min-psnr 999 --max-bias 0", 0, "verdict    pass"),
        ("shifted.exr reference.exr --max-rmse 0.0101", 0, "at most 0.0101: pass"),
        ("shifted.exr reference.exr --max-rmse 0.0099", 1, "FAIL: rmse"),
        ("shifted.exr reference.exr --max-rel-mse 1e-5", 1, "FAIL: rel_mse"),
        ("shifted.exr reference.exr --max-mape 1e-3", 1, "FAIL: mape"),
        ("shifted.exr reference.exr --min-psnr 39.9", 0, "40.00 dB"),
        ("shifted.exr reference.exr --min-psnr 40.1", 1, "FAIL: psnr"),
        ("shifted.exr reference.exr --max-flip 1e-6", 1, "FAIL: flip"),
        ("shifted.exr reference.exr --max-bias 0.0099", 1, "FAIL: bias"),
        ("shifted.exr reference.exr --welch", 1, "FAIL: welch"),
        ("reference.exr reference.exr --welch", 0, "does not reject"),
        ("nan.pfm reference.exr", 0, "the first at (1, 1)"),
        ("nan.pfm reference.exr --max-rmse 1", 1, "FAIL: non_finite"),
        ("equal.pfm reference.exr", 0, "not tested: the image carries no estimate"),
    ] {
        let output = compare(directory.path(), arguments);
        let stdout = String::from_utf8(output.stdout.clone()).unwrap();
        assert_eq!(code(&output), expected, "{arguments}: {output:?}");
        assert!(stdout.contains(said), "{arguments}: {stdout}");
        assert!(output.stderr.is_empty(), "{arguments}: {output:?}");
    }
}

#[test]
fn bad_input_is_code_2_and_says_why_on_stderr() {
    let directory = images();
    std::fs::write(directory.path().join("text.exr"), "not an image").unwrap();
    for (arguments, said) in [
        ("small.png reference.exr", "the image has 2x2 pixels, the reference 40x20"),
        ("gone.png reference.exr", "cannot read gone.png"),
        ("text.exr reference.exr", "text.exr: not a valid OpenEXR file"),
        ("image.jpg reference.exr", ".png, .exr, .hdr, .pfm"),
        ("equal.pfm reference.exr --welch", "the image carries no estimate of its noise"),
        ("equal.pfm reference.exr --heatmap map.exr", "map.exr: an error map is written as .png"),
        ("equal.pfm reference.exr --heatmap gone/map.png", "cannot write gone/map.png"),
        ("equal.pfm reference.exr --heatmap-max 1", "--heatmap"),
        ("equal.pfm reference.exr --max-rmse=-1", "at least 0"),
        ("equal.pfm reference.exr --max-rmse=nan", "at least 0"),
        ("equal.pfm reference.exr --ppd 0", "1 to 1000"),
        ("equal.pfm", "<REFERENCE>"),
    ] {
        let output = compare(directory.path(), arguments);
        let stderr = String::from_utf8(output.stderr.clone()).unwrap();
        assert_eq!(code(&output), 2, "{arguments}: {output:?}");
        assert!(stderr.contains(said), "{arguments}: {stderr}");
        assert!(output.stdout.is_empty(), "{arguments}: {output:?}");
    }
}

#[test]
fn json_is_one_line_of_the_schema() {
    let directory = images();
    let output =
        compare(directory.path(), "shifted.exr reference.exr --json --worst 2 --max-rmse 0.001 --heatmap map.png");
    assert_eq!(code(&output), 1);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), 1);
    let json: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["schema"], "photolith-compare-1");
    assert_eq!((&json["width"], &json["height"], &json["pass"]), (&40.into(), &20.into(), &false.into()));
    let near = |value: &Value, expected: f64| {
        let value = value.as_f64().unwrap();
        assert!((value / expected - 1.0).abs() < 1e-4, "{value}, expected {expected}");
    };
    near(&json["rmse"], 0.01);
    near(&json["psnr"], 40.0);
    near(&json["bias"]["luminance"]["mean"], 0.01);
    near(&json["noise_mse"]["reference"], 1e-6);
    near(&json["checks"][0]["limit"], 0.001);
    // t = 0.01/√(2e-6) for a pixel.
    near(&json["welch"]["pixels"]["worst"]["t"], 7.0711);
    assert_eq!(json["worst"].as_array().unwrap().len(), 2);
    near(&json["heatmap"]["max"], 0.01);
    let (map, metadata) = read(&directory.path().join("map.png")).unwrap();
    assert_eq!((map.width(), map.height()), (40, 20));
    assert!(metadata.get("heatmap.max").is_some());
    // Equal images: an infinite PSNR is null.
    let output = compare(directory.path(), "equal.pfm reference.exr --json");
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(json["psnr"].is_null() && json["welch"].is_null() && json["welch_lacks"] == "image", "{json}");
}
