//! `photolith bench` from outside: slopes, fields, and what it refuses.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use photolith::bench::growth::{Growth, measure};
use photolith::{Context, RenderError, RenderSettings, Validation};

use super::common::context_options;
use super::*;

/// A floor, a ball and an emitter under a sky: noise from every dimension, no rare bright paths.
const SCENE: &str = r#"
version = 1
[camera]
position = [0, 2, 6]
target = [0, 0.5, 0]
horizontal_fov = 40
[film]
width = 24
height = 16
filter = "box"
[integrator]
max_depth = 2
samples = 16
[background]
radiance = [0.5, 0.7, 1.0]
[[material]]
name = "grey"
type = "diffuse"
reflectance = [0.6, 0.5, 0.4]
[[sphere]]
center = [0, -100, 0]
radius = 100
material = "grey"
[[sphere]]
center = [0, 1, 0]
radius = 1
material = "grey"
[[light]]
type = "point"
position = [3, 5, 2]
power = [300, 300, 300]
"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

fn bench(folder: &Path, arguments: &str) -> Output {
    // Where references are kept; the others need none, and refuse the option.
    let needs_reference = !arguments.contains("--growth") && !arguments.contains("--rays");
    let cache: &[&str] = if needs_reference { &["--cache", "cache"] } else { &[] };
    program(folder)
        .args(["bench", "--validate", "core"])
        .args(cache)
        .args(arguments.split_ascii_whitespace())
        .output()
        .unwrap()
}

fn json(output: &Output) -> Value {
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    assert_eq!(text.lines().count(), 1);
    serde_json::from_str(&text).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn independent_numbers_converge_with_one_half_and_sobol_faster() {
    let folder = folder();
    let line = "scene.toml --samples 1..64 --vary sampler=independent,sobol --json --csv a.csv --plot a.svg \
                --markdown a.md --section small";
    let found = json(&bench(folder.path(), line));
    assert_eq!(found["schema"], "photolith-bench-2");
    for field in ["device", "driver", "version", "date"] {
        assert!(!found[field].as_str().unwrap().is_empty(), "{field}");
    }
    let scene = &found["scenes"][0];
    assert_eq!((&scene["width"], &scene["height"], &scene["seeds"]), (&24.into(), &16.into(), &8.into()));
    let noise = number(&scene["reference"]["noise_rmse"]);
    assert_eq!(scene["reference"]["origin"], "renderer");
    assert!(number(&scene["reference"]["samples"]) > 0.0);

    let [independent, sobol] = [0, 1].map(|i| &scene["configurations"][i]);
    assert_eq!((&independent["label"], &sobol["label"]), (&"sampler=independent".into(), &"sampler=sobol".into()));
    let slope = |c: &Value| (number(&c["slope"]["exponent"]), number(&c["slope"]["half_width"]));
    let (flat, steep) = (slope(independent), slope(sobol));
    assert!((flat.0 + 0.5).abs() < 0.15 && flat.1 < 0.15, "{flat:?}");
    assert!(steep.0 < flat.0 - 0.1, "{steep:?} is not steeper than {flat:?}");

    for c in [independent, sobol] {
        assert!(number(&c["setup_s"]) >= number(&c["compile_s"]));
        // Spheres in constants: no BVH.
        assert!(c["steps_per_ray"].is_null() && c["bvh_build_s"].is_null());
        let rows = c["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 7);
        for (i, row) in rows.iter().enumerate() {
            let get = |field: &str| number(&row[field]);
            assert_eq!(get("samples"), f64::from(1 << i));
            assert!(get("device_s") <= get("render_s"), "{row}");
            assert!(get("rmse") >= noise && get("rmse_half_width") < 0.5 * get("rmse"), "{row}");
            assert!((get("rmse").powi(2) / get("mse") - 1.0).abs() < 1e-9);
            assert!((get("efficiency") * get("mse") * get("render_s") - 1.0).abs() < 1e-9);
            let pixels = 24.0 * 16.0;
            assert!((get("msamples_per_s") * get("render_s") * 1e6 / pixels / get("samples") - 1.0).abs() < 1e-9);
            assert!(get("rays_per_sample") > 1.0 && get("rays_per_sample") < 5.0, "{row}");
            assert!(get("rel_mse") > 0.0 && get("mape") > 0.0 && get("flip") > 0.0);
            // Four half-widths of 95%: unbiased, and a bias of a percent would show at 64 samples.
            assert!(get("bias").abs() < 4.0 * get("bias_half_width"), "{row}");
        }
        assert!(number(&rows[6]["bias_half_width"]) < 0.005);
    }
    // The target is what the worse of the two reaches with all its samples; Sobol needs fewer.
    let samples = |c: &Value| number(&c["time_to_target"]["samples"]);
    assert!((samples(independent) - 64.0).abs() < 1e-6 && samples(sobol) < 40.0);

    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("a.csv").lines().count(), 1 + 2 * 7);
    assert!(read("a.svg").contains("wall time (s)") && read("a.svg").contains("sampler=sobol"));
    let markdown = read("a.md");
    assert!(markdown.starts_with("<!-- begin small -->") && markdown.contains("![small](a.svg)"), "{markdown}");

    // The reference is there now: used again, and not made anew for a scene that shows the same.
    let kept = || std::fs::read_dir(folder.path().join("cache")).unwrap().map(|f| f.unwrap()).collect::<Vec<_>>();
    assert_eq!(kept().len(), 1);
    let changed = || kept()[0].metadata().unwrap().modified().unwrap();
    let before = changed();
    std::fs::write(folder.path().join("scene.toml"), SCENE.replace("samples = 16", "samples = 17")).unwrap();
    bench(folder.path(), &format!("scene.toml --samples 2 --seeds 2 --reference-noise {}", 1.001 * noise));
    assert_eq!(changed(), before);
    std::fs::write(folder.path().join("scene.toml"), SCENE.replace("radius = 1\n", "radius = 0.9\n")).unwrap();
    bench(folder.path(), "scene.toml --samples 2 --seeds 2");
    assert_eq!(kept().len(), 2);
}

/// Each kind of numbers gives the same image in the mean, and those that are independent the same noise.
#[test]
fn the_reports_generator_is_as_good_as_the_hash() {
    let folder = folder();
    let line = "scene.toml --samples 1..64 --vary sampler=independent,pcg --json";
    let found = json(&bench(folder.path(), line));
    let [hash, pcg] = [0, 1].map(|i| &found["scenes"][0]["configurations"][i]);
    assert!((number(&pcg["slope"]["exponent"]) + 0.5).abs() < 0.15);
    for (a, b) in hash["rows"].as_array().unwrap().iter().zip(pcg["rows"].as_array().unwrap()) {
        let ratio = number(&a["mse"]) / number(&b["mse"]);
        assert!((0.8..1.25).contains(&ratio), "{ratio}: {a} {b}");
        assert_ne!(a["mse"], b["mse"]);
        assert!(number(&b["bias"]).abs() < 4.0 * number(&b["bias_half_width"]), "{b}");
    }
    assert_eq!(number(&hash["relative_time"]), 1.0);
    assert!(number(&pcg["relative_time"]) > 0.0);
}

#[test]
fn a_feature_that_is_not_needed_costs_time_and_no_bits() {
    let folder = folder();
    let line = "scene.toml --samples 4 --seeds 2 --vary features=specialised,+dielectric,+bvh,general --json";
    let found = json(&bench(folder.path(), line));
    let all = found["scenes"][0]["configurations"].as_array().unwrap();
    assert_eq!(all.len(), 4);
    for c in all {
        assert_eq!(c["rows"][0]["mse"], all[0]["rows"][0]["mse"], "{}", c["label"]);
    }
}

#[test]
fn two_halves_are_measured_beside_uniform() {
    let folder = folder();
    let found = json(&bench(
        folder.path(),
        "scene.toml --size 64x48 --samples 16,64 --seeds 4 --vary sampling=uniform,dual --json",
    ));
    let all = found["scenes"][0]["configurations"].as_array().unwrap();
    let rows: Vec<_> = all.iter().map(|c| c["rows"].as_array().unwrap()).collect();
    for (uniform, dual) in rows[0].iter().zip(rows[1]) {
        assert_eq!(uniform["samples"], dual["samples"]);
        assert_ne!(uniform["mse"], dual["mse"]);
        // As many samples, stratified over half of them.
        let ratio = number(&dual["rel_mse"]) / number(&uniform["rel_mse"]);
        assert!((0.5..3.0).contains(&ratio), "{ratio}: {uniform} {dual}");
        assert!(number(&dual["bias"]).abs() < 4.0 * number(&dual["bias_half_width"]), "{dual}");
    }
    // It takes no fewer than 2, and neither does what stands beside it.
    let found = json(&bench(folder.path(), "scene.toml --seeds 2 --vary sampling=uniform,dual --json"));
    for c in found["scenes"][0]["configurations"].as_array().unwrap() {
        let samples: Vec<_> = c["rows"].as_array().unwrap().iter().map(|r| r["samples"].as_u64().unwrap()).collect();
        assert_eq!(samples, [2, 4, 8, 16, 32, 64]);
    }
}

/// A tetrahedron over a floor of two triangles, which small meshes are turned into constants, and a bumpy sheet of
/// 20,000, which is a BVH: the rays that are written must meet what the f64 tests of all triangles find.
#[test]
fn rays_are_those_of_the_scene_and_what_they_meet_is_right() {
    let folder = folder();
    let mut obj = String::new();
    let n = 40;
    for i in 0..=n {
        for j in 0..=n {
            let (x, z) = (f64::from(j) / 4.0 - 5.0, f64::from(i) / 4.0 - 5.0);
            obj += &format!("v {x} {} {z}\n", 0.4 * (1.7 * x).sin() * (1.3 * z).cos());
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j + 1;
            obj += &format!("f {a} {} {}\nf {} {} {}\n", a + n + 1, a + 1, a + 1, a + n + 1, a + n + 2);
        }
    }
    std::fs::write(folder.path().join("sheet.obj"), obj).unwrap();
    let mesh = SCENE.replacen("[[light]]", "[[mesh]]\nfile = \"sheet.obj\"\nmaterial = \"grey\"\n[[light]]", 1);
    // Only triangles are written to the file.
    let without_spheres = mesh.split("[[sphere]]").next().unwrap().to_owned() + &mesh[mesh.find("[[mesh]]").unwrap()..];
    std::fs::write(folder.path().join("sheet.toml"), without_spheres).unwrap();
    let found =
        json(&bench(folder.path(), "sheet.toml --size 40x24 --rays --json --dump-rays rays.bin --csv rays.csv"));
    let rates = found["rays"][0]["rates"].as_array().unwrap();
    let counts = [0, 1, 2].map(|i| rates[i]["rays"].as_u64().unwrap() as usize);
    assert_eq!(counts[0], 40 * 24);
    assert!(counts[1] > 100 && counts[1] <= counts[0] && counts[2] > 100 && counts[2] <= counts[0], "{counts:?}");
    for rate in rates {
        assert!(
            number(&rate["mrays_per_s"]) > 0.0 && number(&rate["best_mrays_per_s"]) >= number(&rate["mrays_per_s"])
        );
        assert!(number(&rate["steps_per_ray"]) > 1.0, "{rate}");
    }
    assert_eq!(std::fs::read_to_string(folder.path().join("rays.csv")).unwrap().lines().count(), 4);

    let bytes = std::fs::read(folder.path().join("rays.bin")).unwrap();
    assert_eq!(&bytes[..16], b"photolith-rays-1");
    let words: Vec<[u8; 4]> = bytes[16..].chunks_exact(4).map(|w| w.try_into().unwrap()).collect();
    let integer = |i: usize| u32::from_le_bytes(words[i]) as usize;
    let float = |i: usize| f64::from(f32::from_le_bytes(words[i]));
    let vector = |i: usize| glam::DVec3::new(float(i), float(i + 1), float(i + 2));
    let triangles = integer(0);
    assert_eq!((triangles, [integer(1), integer(2), integer(3)]), (2 * 40 * 40, counts));
    let mut at = 4 + 9 * triangles;
    for (kind, &count) in counts.iter().enumerate() {
        let mut differ = 0;
        for i in 0..count {
            let ray = at + 8 * i;
            let (o, far, d) = (vector(ray), float(ray + 3), vector(ray + 4));
            assert!((d.length() - 1.0).abs() < 1e-6);
            let distances = (0..triangles).filter_map(|t| {
                let [a, b, c] = [0, 3, 6].map(|k| vector(4 + 9 * t + k));
                let (e1, e2) = (b - a, c - a);
                let (p, s) = (d.cross(e2), o - a);
                let q = s.cross(e1);
                let det = e1.dot(p);
                let (u, v, t) = (s.dot(p) / det, d.dot(q) / det, e2.dot(q) / det);
                (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 1e-5 && t < far).then_some(t)
            });
            let nearest = distances.min_by(f64::total_cmp);
            let said = float(at + 8 * count + i);
            let agree = match nearest {
                None => said < 0.0,
                Some(t) => said >= 0.0 && (kind == 1 || (said / t - 1.0).abs() < 1e-3),
            };
            differ += usize::from(!agree);
        }
        // At edges and at grazing angles rounding decides.
        assert!(differ <= count / 200, "kind {kind}: {differ} of {count} differ");
        at += 9 * count;
    }
    assert_eq!(at, words.len());
}

#[test]
fn nothing_is_reported_below_the_noise_floor() {
    let folder = folder();
    let output = bench(folder.path(), "scene.toml --samples 1,1024 --seeds 2 --reference-noise 0.02 --json");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = &found["scenes"][0]["configurations"][0]["rows"];
    assert!(number(&rows[0]["rmse"]) > 0.02);
    assert_eq!(rows[1]["below_noise_floor"], true);
    for field in ["mse", "rmse", "rel_mse", "mape", "flip", "efficiency"] {
        assert!(rows[1][field].is_null(), "{field}");
    }
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("below the noise of the reference") && said.contains("1024 samples"), "{said}");
}

#[test]
fn the_oracle_and_a_given_reference() {
    let folder = folder();
    let line = "scene.toml --size 12x8 --samples 4,16,64 --seeds 8 --json";
    let by_oracle = json(&bench(folder.path(), &format!("{line} --oracle --reference-noise 0.004")));
    assert_eq!(by_oracle["scenes"][0]["reference"]["origin"], "oracle");
    let row = &by_oracle["scenes"][0]["configurations"][0]["rows"][2];
    assert!(number(&row["bias"]).abs() < 3.0 * number(&row["bias_half_width"]), "{row}");

    let kept = std::fs::read_dir(folder.path().join("cache")).unwrap().next().unwrap().unwrap().path();
    let given = json(&bench(folder.path(), &format!("{line} --reference {}", kept.display())));
    assert_eq!(given["scenes"][0]["reference"]["origin"], "given");
    // The same seeds and reference: the same errors to the last bit.
    let errors = |found: &Value| found["scenes"][0]["configurations"][0]["rows"][0]["mse"].clone();
    assert_eq!(errors(&given), errors(&by_oracle));
}

#[test]
fn bad_input_is_code_2_and_says_why() {
    let folder = folder();
    let render = |name: &str| {
        let scene = folder.path().join("scene.toml");
        let mut command = program(folder.path());
        command.arg("render").arg(scene).args(["--samples", "1", "-o", name]);
        assert!(command.status().unwrap().success());
    };
    render("bare.pfm");
    let mut nan = std::fs::read(folder.path().join("bare.pfm")).unwrap();
    let last = nan.len() - 4;
    nan[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    nan[last - 12..last - 8].copy_from_slice(&f32::INFINITY.to_le_bytes());
    std::fs::write(folder.path().join("nan.pfm"), nan).unwrap();
    std::fs::write(folder.path().join("torn.md"), "<!-- begin a -->\n").unwrap();
    for (arguments, said) in [
        ("", "SCENE"),
        ("gone.toml", "gone.toml"),
        ("scene.toml --samples 0", "expected N, A..B or A,B,C"),
        ("scene.toml --vary colour=red", "unknown setting 'colour'"),
        ("scene.toml --vary sampler=halton", "expected sobol, independent or pcg"),
        ("scene.toml --vary sampler=sobol,sobol", "the value 'sobol' twice"),
        ("scene.toml --vary sampler=sobol --vary sampler=pcg", "'sampler' is given twice"),
        ("scene.toml --samples 1 --vary sampling=dual", "--samples: found 1, expected at least 2 samples"),
        ("scene.toml --samples 1..8 --vary sampling=uniform,dual", "--samples: found 1, expected at least 2"),
        (
            "scene.toml --reference-noise 1e-12",
            "samples per pixel, more than the 8589934592 that there are; raise --ref",
        ),
        ("scene.toml --reference nan.pfm --reference-noise 0.1", "nan.pfm: 2 pixel(s) of the reference are NaN or inf"),
        ("scene.toml --plot a.pdf", "a plot is written as .svg"),
        ("scene.toml --reference bare.pfm", "carries no estimate of its noise"),
        ("scene.toml --reference bare.pfm --reference-noise 0.1 --size 8x8", "24x16"),
        ("scene.toml scene.toml --reference bare.pfm", "for one scene, found 2"),
        ("scene.toml --vary features=+halo", "expected specialised, general, +diffuse"),
        ("scene.toml scene.toml --rays --dump-rays a.bin", "for one scene, found 2"),
        ("scene.toml --rays --plot a.svg", "nothing to draw"),
        ("scene.toml --dump-rays a.bin", "expected --rays"),
        ("scene.toml --max 5", "expected --growth"),
        ("--growth triangles --samples 1,2", "one number of --samples"),
        ("--growth triangles --max 999", "--max: triangles up to 999, expected at least 1000, the smallest size"),
        ("--growth depth --max 65536", "--max: depth up to 65536, expected at most 65535"),
        ("--growth triangles --max 99999999999", "--max: triangles up to 99999999999, expected at most 2147483647"),
        ("--growth triangles --size 8x8", "'--size <WxH>'"),
        ("--growth triangles --max-depth 2", "'--max-depth <N>'"),
        ("--growth triangles --ppd 60", "'--ppd <X>'"),
        ("--growth triangles --reference bare.pfm", "'--reference <FILE>'"),
        ("--growth triangles --reference-noise 1", "'--reference-noise <RADIANCE>'"),
        ("--growth triangles --oracle", "'--oracle'"),
        ("--growth triangles --cache cache", "'--cache <DIR>'"),
        ("scene.toml --rays --ppd 60", "'--ppd <X>'"),
        ("scene.toml --rays --reference bare.pfm", "'--reference <FILE>'"),
        ("scene.toml --rays --reference-noise 1", "'--reference-noise <RADIANCE>'"),
        ("scene.toml --rays --oracle", "'--oracle'"),
        ("scene.toml --rays --cache cache", "'--cache <DIR>'"),
        ("scene.toml --ppd 0.5", "expected a number of 1 to 1000"),
        ("scene.toml --csv gone/a.csv", "cannot write gone/a.csv: No such file"),
        ("scene.toml --plot gone/a.svg", "cannot write gone/a.svg: No such file"),
        ("scene.toml --markdown gone/a.md", "cannot write gone/a.md: No such file"),
        ("scene.toml --markdown torn.md --section a", "torn.md: found '<!-- begin a -->', expected '<!-- end a -->'"),
        ("scene.toml --rays --dump-rays gone/a.bin", "cannot write gone/a.bin: No such file"),
    ] {
        let output = bench(folder.path(), arguments);
        let stderr = String::from_utf8(output.stderr.clone()).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {output:?}");
        assert!(stderr.contains(said), "{arguments}: {stderr}");
        assert!(output.stdout.is_empty(), "{arguments}: nothing is measured first");
    }
    let output = bench(folder.path(), "scene.toml --vary device=none-such --samples 1");
    assert_eq!(output.status.code(), Some(3), "{output:?}");
}

#[test]
fn what_cannot_be_written_keeps_nothing_else_from_it() {
    let folder = folder();
    let output =
        bench(folder.path(), "scene.toml --size 8x8 --rays --json --csv /dev/full --markdown a.md --dump-rays a.bin");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.contains("photolith: cannot write /dev/full: No space left"), "{stderr}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["rays"][0]["rates"][0]["rays"], 64);
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("a.md").ends_with(b"<!-- end bench -->\n") && read("a.bin").starts_with(b"photolith-rays-1"));
}

/// A cache that cannot be used costs the time to make the reference, and no result.
#[test]
fn a_broken_cache_is_a_warning() {
    let folder = folder();
    let line = "scene.toml --samples 1,4 --seeds 1 --reference-noise 0.02";
    let measured = |warning: &str| {
        let output = bench(folder.path(), line);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let (text, said) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(text.contains("1 seed; reference: renderer"), "{text}");
        assert!(said.contains(warning) && said.is_empty() == warning.is_empty(), "{said}");
    };
    let cache = folder.path().join("cache");
    std::fs::write(&cache, "no folder").unwrap();
    measured("the reference is not kept: cannot write");
    std::fs::remove_file(&cache).unwrap();
    measured("");
    let kept = std::fs::read_dir(&cache).unwrap().next().unwrap().unwrap().path();
    std::fs::write(&kept, "no image").unwrap();
    measured("not a valid OpenEXR file");
    measured("");
    std::fs::remove_file(&kept).unwrap();
    std::fs::create_dir(&kept).unwrap();
    measured("it is a folder, expected a file; it is made anew");
    measured("the reference is not kept: cannot write cache/");
}

#[test]
fn radiance_beyond_single_precision_has_no_errors_and_no_advice() {
    let folder = folder();
    std::fs::write(folder.path().join("scene.toml"), SCENE.replace("[0.5, 0.7, 1.0]", "[1e30, 1e30, 1e30]")).unwrap();
    let output = bench(folder.path(), "scene.toml --samples 1,2 --seeds 2 --csv a.csv --plot a.svg --markdown a.md");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("noise of the reference is not finite") && !said.contains("--reference-noise"), "{said}");
    assert!(said.contains("a.svg is not written: there is no point to draw"), "{said}");
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    for line in read("a.csv").lines().skip(1) {
        assert!(line.split(',').all(|cell| !["NaN", "inf", "-inf"].contains(&cell)), "{line}");
    }
    assert!(!read("a.md").contains("a.svg)") && !folder.path().join("a.svg").exists());
}

#[test]
fn what_fails_keeps_what_was_measured_before_it() {
    let folder = folder();
    // Inside a perfect mirror a path never ends before its depth, which is more than the budget of loops.
    let deep = SCENE
        .replace("max_depth = 2", "max_depth = 60000\nrussian_roulette = \"off\"")
        .replace("\"diffuse\"\nreflectance = [0.6, 0.5, 0.4]", "\"mirror\"")
        .replace("center = [0, -100, 0]\nradius = 100", "center = [0, 0, 0]\nradius = 100\ninward = true");
    std::fs::write(folder.path().join("deep.toml"), deep).unwrap();
    let line = "scene.toml deep.toml --samples 4 --seeds 2 --vary loop-budget=1000 --json --csv a.csv";
    let output = bench(folder.path(), line);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("deep.toml"), "{output:?}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let scenes: Vec<_> = found["scenes"].as_array().unwrap().iter().map(|s| s["scene"].as_str().unwrap()).collect();
    assert_eq!(scenes, ["scene.toml"]);
    // A heading, and 1, 2 and 4 samples.
    assert_eq!(std::fs::read_to_string(folder.path().join("a.csv")).unwrap().lines().count(), 4);
}

/// Runs until `ready`, and some more; then sends Ctrl-C.
#[cfg(unix)]
fn interrupted(folder: &Path, arguments: &str, ready: impl Fn() -> bool) -> Output {
    let child = program(folder)
        .arg("bench")
        .args(arguments.split_ascii_whitespace())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !ready() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(50));
    }
    std::thread::sleep(Duration::from_secs(3));
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let sent = Instant::now();
    let output = child.wait_with_output().unwrap();
    assert!(sent.elapsed() < Duration::from_secs(30), "{:?}", sent.elapsed());
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    output
}

#[cfg(unix)]
#[test]
fn ctrl_c_writes_the_seeds_that_are_complete() {
    let folder = folder();
    let line =
        "scene.toml --size 64x48 --samples 1..64 --seeds 1000 --reference-noise 0.02 --cache cache --json --csv a.csv";
    let made = || std::fs::read_dir(folder.path().join("cache")).is_ok_and(|mut files| files.next().is_some());
    let output = interrupted(folder.path(), line, made);
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("interrupted; what was complete is written"),
        "{output:?}"
    );
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let seeds = found["scenes"][0]["seeds"].as_u64().unwrap();
    assert!((1..1000).contains(&seeds), "{seeds}");
    assert_eq!(found["scenes"][0]["configurations"][0]["rows"].as_array().unwrap().len(), 7);
    assert_eq!(std::fs::read_to_string(folder.path().join("a.csv")).unwrap().lines().count(), 8);
}

#[cfg(unix)]
#[test]
fn ctrl_c_writes_the_sizes_that_are_complete() {
    let folder = folder();
    // The last of them take hours.
    let output = interrupted(folder.path(), "--growth depth --max 65535 --samples 16 --json", || true);
    let growth = &serde_json::from_slice::<Value>(&output.stdout).unwrap()["growth"];
    assert!((1..17).contains(&growth["rows"].as_array().unwrap().len()), "{growth}");
    assert!(growth["ended"].as_str().unwrap().ends_with(" depth: interrupted"), "{growth}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_before_anything_is_measured_writes_nothing() {
    let folder = folder();
    // A reference that takes hours.
    let line = "scene.toml --size 512x512 --seeds 1 --reference-noise 1e-4 --cache cache --json --csv a.csv";
    let output = interrupted(folder.path(), line, || true);
    assert!(String::from_utf8_lossy(&output.stderr).contains("interrupted before anything was measured"), "{output:?}");
    assert!(output.stdout.is_empty() && !folder.path().join("a.csv").exists(), "{output:?}");
}

#[test]
fn growth_of_triangles() {
    let folder = folder();
    let found =
        json(&bench(folder.path(), "--growth triangles --max 10000 --samples 1 --json --plot g.svg --csv g.csv"));
    let growth = &found["growth"];
    let rows = growth["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 3);
    assert!(number(&rows[2]["size"]) >= 10_000.0);
    for row in rows {
        // One or two triangles a leaf, most of them two, and three to four children a node: 3/2 to 4/3 records of 56 bytes for each leaf.
        let bytes = number(&row["bytes_per_primitive"]);
        assert!(bytes > 37.3 && bytes < 42.65, "{row}");
        assert!(number(&row["mprimitives_per_s"]) > 0.0 && number(&row["steps_per_ray"]) > 5.0);
    }
    // Steps grow like the logarithm of the size.
    let (few, many) = (number(&rows[0]["steps_per_ray"]), number(&rows[2]["steps_per_ray"]));
    assert!(many > few && many < 3.0 * few, "{few} {many}");
    assert!(growth["ended"].is_null() && growth["time_exponent"]["exponent"].is_number());
    assert_eq!(std::fs::read_to_string(folder.path().join("g.csv")).unwrap().lines().count(), 4);
    assert!(std::fs::read_to_string(folder.path().join("g.svg")).unwrap().contains("BVH build (s)"));
}

#[test]
fn a_series_that_cannot_go_on_says_where_and_why() {
    let context = Context::new(&context_options(Validation::Core)).unwrap();
    // Two iterations are enough for no path: what a limit of the driver would do.
    let settings = RenderSettings { samples: 1, loop_budget: Some(2), ..RenderSettings::default() };
    let (report, error) = measure(&context, Growth::Triangles, &[100, 200], &settings, |_| ControlFlow::Continue(()));
    assert!(matches!(error, Some(RenderError::Stuck { budget: 2 })), "{error:?}");
    assert!(report.rows.is_empty() && report.time_exponent.is_none());
    let ended = report.ended.unwrap();
    assert!(ended.starts_with("128 triangles: ") && ended.contains("loop budget of 2"), "{ended}");
    assert_eq!(context.messages().all(), Vec::<String>::new());
}
