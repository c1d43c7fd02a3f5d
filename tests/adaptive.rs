//! Adaptive sampling: it stops at the noise that was asked for, says truly what it reached, is free of bias, and gives
//! the same bits however it is cut up.

mod common;

use std::ops::ControlFlow;
use std::process::{Command, Stdio};

use common::{assert_same_bits, context, render, scene_path, shipped};
use photolith::image::read;
use photolith::render::{Adaptive, Beams, Gradients, RenderStatistics, Reuse, Sampler, Scheduler};
use photolith::{Context, Film, RenderError, RenderSettings, Renderer, Scene};
use serde_json::Value;

const MOST: u32 = 1024;

fn adaptive(scene: &Scene, noise: f64) -> RenderSettings {
    RenderSettings { samples: MOST, adaptive: Some(Adaptive::to_noise(noise)), ..RenderSettings::of(scene) }
}

fn run(context: &Context, scene: &Scene, settings: &RenderSettings) -> (Film, RenderStatistics) {
    let mut renderer = Renderer::new(context, scene, settings).expect("a renderer");
    let film = renderer.render(|_| ControlFlow::Continue(())).expect("a film");
    (film, renderer.statistics().clone())
}

/// Root of the mean of (x − r)²/(r² + 0.01).
fn relative_error(film: &Film, reference: &Film) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (x, r) in film.mean().iter().zip(reference.mean()) {
        for c in 0..3 {
            let (x, r) = (f64::from(x[c]), f64::from(r[c]));
            sum += (x - r).powi(2) / (r * r + 0.01);
            count += 1.0;
        }
    }
    f64::sqrt(sum / count)
}

fn mean(film: &Film) -> f64 {
    film.mean().iter().map(|p| p.iter().map(|&c| f64::from(c)).sum::<f64>()).sum::<f64>() / film.counts().len() as f64
}

#[test]
fn stops_at_the_noise_and_says_what_it_is() {
    let context = context();
    let goals: [(_, &[_]); 2] =
        [("cornell", &[(0.08, Gradients::Auto)]), ("cat", &[(0.03, Gradients::Off), (0.015, Gradients::Auto)])];
    for (name, goals) in goals {
        let scene = shipped(name, (48, 40), 4096);
        // Other random numbers, or the errors would not be independent.
        let exact = render(&context, &scene, &RenderSettings { seed: 77, ..RenderSettings::of(&scene) });
        for &(target, gradients) in goals {
            let (film, s) = run(&context, &scene, &RenderSettings { gradients, ..adaptive(&scene, target) });
            let found = s.adaptive.expect("an estimate");
            let error = relative_error(&film, &exact);
            println!("{name}: target {target}, said {}, true {error}, {s:?}", found.noise);
            assert!(!s.stopped && found.noise <= 1.15 * target && found.noise > 0.5 * target, "{name}: {found:?}");
            assert!((0.8..1.3).contains(&(found.noise / error)), "{name}: said {}, true {error}", found.noise);
            assert!(found.noisiest_tile >= found.noise, "{name}: {found:?}");
            let used: u64 = film.counts().iter().map(|&n| u64::from(n)).sum();
            assert_eq!(used + found.unused_samples, s.samples, "{name}");
            assert!(found.unused_samples < s.samples / 4, "{name}: {found:?}");
            let (fewest, most) = (s.samples_per_pixel, s.most_samples_per_pixel);
            assert!(fewest >= 16 && most <= MOST, "{name}: {fewest} to {most}");
            assert_eq!(fewest == most, s.gradients, "{name}: {fewest} to {most}");
            assert!(s.gradients || film.counts().iter().all(|n| n.is_power_of_two()), "{name}");
            assert_eq!(s.gradients, name == "cat" && gradients == Gradients::Auto, "{name}");
        }
    }
}

/// If counts favoured dark or bright pixels, the mean of many images would show it.
#[test]
fn the_mean_over_seeds_is_that_of_uniform_sampling() {
    let context = context();
    for (name, noise, seeds) in [("cornell", 0.06, 96), ("cat", 0.05, 64)] {
        let scene = shipped(name, (24, 24), 16_384);
        let exact = mean(&render(&context, &scene, &RenderSettings { seed: 1 << 20, ..RenderSettings::of(&scene) }));
        // Independent numbers: heavier tails, and more for counts to go wrong by.
        let settings = RenderSettings { sampler: Sampler::Independent, ..adaptive(&scene, noise) };
        let mut renderer = Renderer::new(&context, &scene, &settings).expect("a renderer");
        let mut counts = Vec::new();
        let trials: Vec<f64> = (1..=seeds)
            .map(|seed| {
                renderer.set_seed(seed);
                let film = renderer.render(|_| ControlFlow::Continue(())).expect("a film");
                counts.extend_from_slice(film.counts());
                mean(&film) / exact - 1.0
            })
            .collect();
        assert!(counts.iter().any(|&n| n != counts[0]), "{name}: nothing was decided");
        let n = trials.len() as f64;
        let bias = trials.iter().sum::<f64>() / n;
        let error = (trials.iter().map(|t| (t - bias).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        println!("{name}: {bias} ± {error}, {} to {}", counts.iter().min().unwrap(), counts.iter().max().unwrap());
        assert!(bias.abs() < 4.0 * error && error < 0.002, "{name}: {bias} ± {error}");
    }
}

#[test]
fn the_same_bits_in_every_way() {
    let context = context();
    for (name, beams, budgets, noises) in [
        ("cornell", Beams::Off, [400, 2500], [0.12, 0.06]),
        ("cornell", Beams::Auto, [1600, 10_000], [0.06, 0.06]),
        ("cat", Beams::Auto, [1500, 4000], [0.12, 0.03]),
    ] {
        // No multiples of a tile.
        let scene = shipped(name, (45, 37), MOST);
        for (reuse, noise, scheduler, budget) in [
            (Reuse::Off, noises[0], Scheduler::Inline, budgets[0]),
            (Reuse::Off, noises[0], Scheduler::Queue, budgets[1]),
            (Reuse::Auto, noises[1], Scheduler::Queue, 2 * budgets[1]),
        ] {
            // Without a tree only some drivers reuse paths, and would make gradients.
            let gradients = if name == "cat" { Gradients::Auto } else { Gradients::Off };
            let base = RenderSettings { beams, reuse, gradients, ..adaptive(&scene, noise) };
            let (expected, s) = run(&context, &scene, &base);
            let differ = expected.counts().iter().any(|&n| n != expected.counts()[0]);
            assert_eq!(differ, !s.gradients, "{name}, {beams:?}: counts are alike");
            assert_eq!(s.gradients, name == "cat" && reuse == Reuse::Auto, "{name}");
            for settings in [
                RenderSettings { scheduler, ..base.clone() },
                RenderSettings { scheduler, samples_per_dispatch: Some(3), ..base.clone() },
                RenderSettings {
                    scheduler,
                    loop_budget: Some(budget),
                    workgroup_size: Some(32),
                    general: true,
                    ..base.clone()
                },
            ] {
                assert_same_bits(&run(&context, &scene, &settings).0, &expected, &format!("{name}, {settings:?}"));
            }
        }
    }
}

#[test]
fn no_pixel_gets_more_than_the_most() {
    let context = context();
    let scene = shipped("cornell", (24, 24), 1);
    // Without beams: there would be more of them than uniform sampling has. And without reuse, about which the two halves of the
    // image decide apart.
    let settings = RenderSettings { samples: 40, beams: Beams::Off, reuse: Reuse::Off, ..adaptive(&scene, 1e-4) };
    let (film, s) = run(&context, &scene, &settings);
    assert!(film.counts().iter().all(|&n| n == 40), "{:?}", film.counts());
    let found = s.adaptive.expect("an estimate");
    assert!(!s.stopped && found.noise > 1e-2, "{found:?}");
    let uniform = RenderSettings { adaptive: None, ..settings };
    assert_same_bits(&film, &render(&context, &scene, &uniform), "all pixels at the most");
    // And a mean that is given.
    let goal = Adaptive { noise: 0.0, mean_samples: Some(40) };
    let (film, s) =
        run(&context, &scene, &RenderSettings { samples: 640, adaptive: Some(goal), ..RenderSettings::of(&scene) });
    assert!(s.mean_samples_per_pixel <= 41.0 && s.mean_samples_per_pixel > 28.0, "{s:?}");
    assert!(film.counts().iter().any(|&n| n > 40));
    // And where all pixels have the same number.
    let scene = shipped("cat", (48, 48), 1);
    let (film, s) = run(&context, &scene, &RenderSettings { samples: 41, ..adaptive(&scene, 1e-4) });
    assert!(!s.stopped && s.gradients && film.counts().iter().all(|&n| n == 40), "{s:?}");
}

#[test]
fn what_was_done_is_kept_when_stopped() {
    let context = context();
    // Of one image that is sampled tile by tile, and of two, the first of which begins with two dispatches of a sample each: with
    // gradients, whatever they gain in so small an image.
    for (name, reuse, fewest, of_one) in [("cornell", Reuse::Auto, 4, 1), ("cat", Reuse::Always, 1, 2)] {
        let scene = shipped(name, (40, 40), 1);
        let settings = RenderSettings { samples_per_dispatch: Some(4), reuse, ..adaptive(&scene, 1e-3) };
        let mut renderer = Renderer::new(&context, &scene, &settings).expect("a renderer");
        for dispatches in [1, 2, 3, 6, 9] {
            let mut left = dispatches;
            let film = renderer
                .render(|_| {
                    left -= 1;
                    if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                })
                .expect("a film");
            let s = renderer.statistics();
            assert!(s.stopped && s.samples_per_pixel >= fewest, "{name}, {dispatches}: {s:?}");
            assert_eq!(s.adaptive.is_some(), dispatches > of_one, "{name}, {dispatches}: {s:?}");
            assert!(s.most_samples_per_pixel <= 4 * (dispatches + 1), "{name}, {dispatches}: {s:?}");
            let used: u64 = film.counts().iter().map(|&n| u64::from(n)).sum();
            let unused = s.adaptive.map_or(0, |found| found.unused_samples);
            assert_eq!(used + unused, s.samples, "{name}, {dispatches}");
            let brightness = mean(&film);
            assert!(brightness.is_finite() && brightness > 0.1, "{name}, {dispatches}: {brightness}");
        }
    }
}

#[test]
fn goals_without_sense_are_refused() {
    let context = context();
    let scene = shipped("cornell", (8, 8), 1);
    let fails = |scene: &Scene, settings: &RenderSettings, words: &str| match Renderer::new(&context, scene, settings) {
        Err(RenderError::Settings(problem)) => assert!(problem.contains(words), "{problem}"),
        other => panic!("{words}: {:?}", other.map(|_| ())),
    };
    for noise in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        fails(&scene, &adaptive(&scene, noise), "expected a number above 0");
    }
    fails(&scene, &RenderSettings { samples: 1, ..adaptive(&scene, 0.1) }, "expected at least 2");
    let pixel = shipped("cornell", (1, 1), 1);
    fails(&pixel, &adaptive(&pixel, 0.1), "at least 2 pixels");
}

#[test]
fn the_program_reports_the_noise_and_writes_the_counts() {
    let directory = tempfile::tempdir().expect("a directory");
    let photolith = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_photolith"))
            .current_dir(directory.path())
            .stdin(Stdio::null())
            .env_remove("RUST_LOG")
            .arg("render")
            .arg(scene_path("cornell"))
            .args(["--size", "40x40"])
            .args(arguments)
            .output()
            .expect("the program starts")
    };
    for bad in ["--noise=0", "--noise=-1", "--noise=nan", "--noise=inf", "--noise=low"] {
        let output = photolith(&[bad]);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{bad}: {stderr}");
        assert!(stderr.contains("expected a number above 0"), "{bad}: {stderr}");
    }
    let output = photolith(&["--noise", "0.1", "--json", "-o", "a.exr"]);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && stderr.contains("noise ") && stderr.contains("(mean "), "{stderr}");
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(json["adaptive"]["noise_target"], 0.1);
    assert!(json["adaptive"]["noise"].as_f64().expect("a number") < 0.115, "{json}");
    let (image, metadata) = read(&directory.path().join("a.exr")).expect("an image");
    let counts = image.counts().expect("counts");
    assert_eq!(json["spp_most"].as_u64(), counts.iter().max().map(|&n| u64::from(n)));
    assert_eq!(json["spp_done"].as_u64(), counts.iter().min().map(|&n| u64::from(n)));
    let mean = counts.iter().map(|&n| f64::from(n)).sum::<f64>() / 1600.0;
    assert!((json["spp_mean"].as_f64().expect("a number") / mean - 1.0).abs() < 1e-9);
    assert!(metadata.get("Noise").is_some());
    // One sample is not enough to tell.
    let output = photolith(&["--noise", "0.1", "--samples", "1"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("expected at least 2"), "{output:?}");
}
