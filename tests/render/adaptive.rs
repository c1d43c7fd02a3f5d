//! Rendering to a noise: it stops there, says truly what it reached and how much each pixel varies, is free of bias, and gives the same
//! bits however it is cut up.

use std::ops::ControlFlow;

use photolith::render::{Adaptive, Gradients, LightTracing, RenderStatistics, Reuse, Sampler, Scheduler};
use photolith::{Context, Film, RenderError, RenderSettings, Renderer, Scene};

use crate::harness::{assert_same_bits, context, render, shipped};

const MOST: u32 = 1024;
/// What the seed of the second half is changed by (XOR).
const SECOND_HALF: u32 = 0x2993_8a61;

fn adaptive(scene: &Scene, noise: f64) -> RenderSettings {
    RenderSettings { samples: MOST, adaptive: Some(Adaptive { noise }), ..RenderSettings::of(scene) }
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

/// Sum of the squared errors of a film over that of the variances that it says it has.
fn error_over_variance(film: &Film, reference: &Film) -> f64 {
    let variance: f64 = film.variance().expect("a variance").iter().flatten().map(|&v| f64::from(v)).sum();
    let pairs = film.mean().into_iter().flatten().zip(reference.mean().into_iter().flatten());
    pairs.map(|(x, r)| f64::from(x - r).powi(2)).sum::<f64>() / variance
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
            let ratio = error_over_variance(&film, &exact);
            println!("{name}: target {target}, said {}, true {error}, {ratio} of the variance, {s:?}", found.noise);
            assert!(!s.stopped && found.noise <= 1.15 * target && found.noise > 0.5 * target, "{name}: {found:?}");
            assert!((0.8..1.3).contains(&(found.noise / error)), "{name}: said {}, true {error}", found.noise);
            assert!((0.6..1.6).contains(&ratio), "{name}: {ratio} of the variance");
            assert!(found.noisiest_tile >= found.noise, "{name}: {found:?}");
            let used: u64 = film.counts().iter().map(|&n| u64::from(n)).sum();
            assert_eq!(used + found.unused_samples, s.samples, "{name}");
            assert!(found.unused_samples < s.samples / 3, "{name}: {found:?}");
            assert!(film.counts().iter().all(|&n| n == film.counts()[0]) && film.counts()[0] <= MOST, "{name}: {s:?}");
            assert_eq!(s.gradients, name == "cat" && gradients == Gradients::Auto, "{name}");
        }
    }
}

/// If counts favoured dark or bright images, the mean of many would show it.
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
        let deviations: Vec<f64> = (1..=seeds)
            .map(|seed| {
                renderer.set_seed(seed);
                let film = renderer.render(|_| ControlFlow::Continue(())).expect("a film");
                counts.push(film.counts()[0]);
                mean(&film) / exact - 1.0
            })
            .collect();
        assert!(counts.iter().any(|&n| n != counts[0]), "{name}: nothing was decided");
        let n = deviations.len() as f64;
        let bias = deviations.iter().sum::<f64>() / n;
        let error = (deviations.iter().map(|t| (t - bias).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        println!("{name}: {bias} ± {error}, {} to {}", counts.iter().min().unwrap(), counts.iter().max().unwrap());
        assert!(bias.abs() < 4.0 * error && error < 0.002, "{name}: {bias} ± {error}");
    }
}

#[test]
fn the_same_bits_in_every_way() {
    let context = context();
    for (name, light_paths, budgets, noises) in [
        ("cornell", LightTracing::Off, [400, 2500], [0.12, 0.06]),
        ("cornell", LightTracing::Auto, [1600, 10_000], [0.06, 0.06]),
        ("cat", LightTracing::Auto, [1500, 4000], [0.12, 0.03]),
    ] {
        // No multiples of a tile.
        let scene = shipped(name, (45, 37), MOST);
        for (reuse, noise, scheduler, budget) in [
            (Reuse::Off, noises[0], Scheduler::Inline, budgets[0]),
            (Reuse::Off, noises[0], Scheduler::Queue, budgets[1]),
            (Reuse::Auto, noises[1], Scheduler::Queue, 2 * budgets[1]),
        ] {
            // Without a BVH only some drivers reuse paths, and would make gradients.
            let gradients = if name == "cat" { Gradients::Auto } else { Gradients::Off };
            let base = RenderSettings { light_tracing: light_paths, reuse, gradients, ..adaptive(&scene, noise) };
            let (expected, s) = run(&context, &scene, &base);
            assert!(s.adaptive.is_some_and(|found| found.rounds > 1), "{name}, {light_paths:?}: {s:?}");
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
                let (film, _) = run(&context, &scene, &settings);
                assert_same_bits(&film, &expected, &format!("{name}, {settings:?}"));
                assert!(film.variance() == expected.variance(), "{name}, {settings:?}: variances differ");
            }
        }
    }
}

#[test]
fn all_samples_are_the_mean_of_two_renderings() {
    let context = context();
    for (size, samples) in [((24, 24), 41), ((1, 1), 2)] {
        let scene = shipped("cat", size, samples / 2);
        let uniform = RenderSettings { reuse: Reuse::Off, ..RenderSettings::of(&scene) };
        let settings = RenderSettings { samples, reuse: Reuse::Off, ..adaptive(&scene, 0.0) };
        let (film, s) = run(&context, &scene, &settings);
        assert!(!s.stopped && s.adaptive.is_some_and(|found| found.unused_samples == 0), "{s:?}");
        assert!(film.counts().iter().all(|&n| n == samples / 2 * 2), "{:?}", film.counts());
        let halves = [0, SECOND_HALF].map(|seed| render(&context, &scene, &RenderSettings { seed, ..uniform.clone() }));
        let variance = film.variance().expect("a variance");
        for (pixel, sum) in film.sums().iter().enumerate() {
            for c in 0..3 {
                let [x, y] = halves.each_ref().map(|half| half.sums()[pixel][c] / f64::from(half.counts()[pixel]));
                let mean = sum[c] / f64::from(film.counts()[pixel]);
                assert!((mean - (x + y) / 2.0).abs() <= 1e-12 * mean.abs(), "{pixel}: {mean} of {x} and {y}");
                assert_eq!(variance[pixel][c], (0.25 * (x - y).powi(2)) as f32, "{pixel}");
            }
        }
    }
}

#[test]
fn no_pixel_gets_more_than_the_most() {
    let context = context();
    for (name, samples) in [("cornell", 40), ("cat", 41)] {
        let scene = shipped(name, (48, 48), 1);
        let (film, s) = run(&context, &scene, &RenderSettings { samples, ..adaptive(&scene, 1e-4) });
        assert!(film.counts().iter().all(|&n| n == 40), "{name}: {:?}", film.counts());
        let found = s.adaptive.expect("an estimate");
        assert!(!s.stopped && found.noise > 1e-3 && found.unused_samples == 0, "{name}: {found:?}");
        assert_eq!(s.gradients, name == "cat", "{s:?}");
    }
}

#[test]
fn what_was_done_is_kept_when_stopped() {
    let context = context();
    // The first half begins with a dispatch of two samples and one of light paths; or, with gradients, with two of a sample each.
    for (name, reuse) in [("cornell", Reuse::Auto), ("cat", Reuse::Always)] {
        let scene = shipped(name, (40, 40), 1);
        let settings = RenderSettings { samples_per_dispatch: Some(4), reuse, ..adaptive(&scene, 1e-3) };
        let mut renderer = Renderer::new(&context, &scene, &settings).expect("a renderer");
        for dispatches in [1, 2, 3, 6, 9] {
            let mut done = 0;
            let film = renderer
                .render(|_| {
                    done += 1;
                    if done == dispatches { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                })
                .expect("a film");
            let s = renderer.statistics();
            assert!(s.stopped && s.samples_per_pixel >= 1, "{name}, {dispatches}: {s:?}");
            assert_eq!(s.adaptive.is_some(), dispatches > 2, "{name}, {dispatches}: {s:?}");
            assert_eq!(film.variance().is_some(), dispatches > 2, "{name}, {dispatches}");
            assert!(s.most_samples_per_pixel <= 4 * (dispatches + 1), "{name}, {dispatches}: {s:?}");
            let used: u64 = film.counts().iter().map(|&n| u64::from(n)).sum();
            assert_eq!(used, s.samples, "{name}, {dispatches}");
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
    for noise in [-0.1, f64::NAN, f64::INFINITY] {
        fails(&scene, &adaptive(&scene, noise), "expected a number that is not negative");
    }
    fails(&scene, &RenderSettings { samples: 1, ..adaptive(&scene, 0.1) }, "expected at least 2");
}
