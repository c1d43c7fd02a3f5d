//! Renderings to a noise.

use photolith::image::read;

use super::assets::scene_path;
use super::*;

#[test]
fn the_noise_is_reported_and_counts_and_variance_are_written() {
    let directory = directory();
    let photolith = |arguments: &str| {
        let scene = scene_path("cornell");
        run(directory.path(), &format!("render {} --size 40x40 {arguments}", scene.display()))
    };
    for bad in ["--noise=0", "--noise=-1", "--noise=nan", "--noise=inf", "--noise=low"] {
        let output = photolith(bad);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{bad}: {stderr}");
        assert!(stderr.contains("expected a number above 0"), "{bad}: {stderr}");
    }
    let output = photolith("--noise 0.1 --json -o a.exr");
    let stderr = text(&output.stderr);
    assert!(output.status.success() && stderr.contains("noise ") && stderr.contains("samples per pixel"), "{stderr}");
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(json["adaptive"]["noise_target"], 0.1);
    // In small images the target may be missed by a quarter.
    assert!(json["adaptive"]["noise"].as_f64().expect("a number") < 0.125, "{json}");
    let (image, metadata) = read(&directory.path().join("a.exr")).expect("an image");
    let counts = image.counts().expect("counts");
    assert_eq!(json["spp_most"].as_u64(), counts.iter().max().map(|&n| u64::from(n)));
    assert_eq!(json["spp_done"].as_u64(), counts.iter().min().map(|&n| u64::from(n)));
    let mean = counts.iter().map(|&n| f64::from(n)).sum::<f64>() / 1600.0;
    assert!((json["spp_mean"].as_f64().expect("a number") / mean - 1.0).abs() < 1e-9);
    assert!(metadata.get("Noise").is_some());
    let variance = image.variance().expect("a variance");
    assert!(variance.batches == 2 && variance.of_mean.iter().flatten().any(|&v| v > 0.0));
    // Another seed has the same expectation.
    let output = photolith("--noise 0.1 --seed 5 -o b.exr");
    assert!(output.status.success(), "{output:?}");
    let compared = run(directory.path(), "compare a.exr b.exr --welch");
    assert_eq!(compared.status.code(), Some(0), "{compared:?}");
    // One sample is not enough to tell.
    let output = photolith("--noise 0.1 --samples 1");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(text(&output.stderr).contains("expected at least 2"), "{output:?}");
}
