//! A rendering that was stopped and gone on with has the bits of one that was not.

use std::ops::ControlFlow;
use std::time::Duration;

use photolith::render::{Adaptive, Checkpoint, Progress, RenderStatistics, Reuse, SampleMap};
use photolith::{Film, RenderError, RenderSettings, Renderer, Scene};

use crate::harness::{assert_same_bits, context, render, render_counted, shipped};

const SAMPLES: u32 = 24;

/// Stopped after every few dispatches that bring a further sample, or light paths, with a renderer of its own each time.
fn in_parts(scene: &Scene, settings: &RenderSettings, dispatches: u32) -> (Film, RenderStatistics, u32) {
    let context = context();
    let mut kept: Option<Checkpoint> = None;
    for parts in 1..1000 {
        let mut renderer = Renderer::new(&context, scene, settings).unwrap();
        let mut left = dispatches;
        let before = kept.as_ref().map_or(0, Checkpoint::samples);
        let progress = |progress: &Progress| {
            left -= u32::from(progress.done > before || progress.done >= progress.total);
            if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let film = match &kept {
            Some(checkpoint) => renderer.go_on(checkpoint, progress).unwrap(),
            None => renderer.render(progress).unwrap(),
        };
        let checkpoint = renderer.checkpoint().unwrap();
        if !renderer.statistics().stopped {
            assert_eq!(checkpoint.samples(), film.counts().iter().map(|&n| u64::from(n)).sum::<u64>());
            return (film, renderer.statistics().clone(), parts);
        }
        let mut bytes = Vec::new();
        checkpoint.write("what", &mut bytes).unwrap();
        let (what, read) = Checkpoint::read(&bytes).unwrap();
        assert_eq!((what.as_str(), &read), ("what", &checkpoint));
        kept = Some(read);
    }
    panic!("it gets no further")
}

fn counts(statistics: &RenderStatistics) -> [u64; 6] {
    let s = statistics;
    [s.samples, s.reused_samples, s.rays, s.shadow_rays, s.bad_samples, s.light_paths]
}

#[test]
fn stopping_changes_no_bit() {
    let context = context();
    for name in ["spheres", "cornell", "cat"] {
        for reuse in [Reuse::Always, Reuse::Off] {
            let scene = shipped(name, (40, 24), SAMPLES);
            // Small dispatches, so that rounds, phases and what precedes light paths are cut in two.
            let settings = RenderSettings { samples_per_dispatch: Some(5), reuse, ..RenderSettings::of(&scene) };
            let (whole, statistics) = render_counted(&context, &scene, &settings);
            let passage = RenderSettings { passage: Some(1 << 16), ..settings.clone() };
            for (settings, dispatches) in [(&settings, 1), (&settings, 3), (&passage, 2)] {
                let (film, in_all, parts) = in_parts(&scene, settings, dispatches);
                assert!(parts > 1, "{name}: never stopped");
                let what = format!("{name}, {reuse:?}, {dispatches} dispatches at a time");
                assert_same_bits(&whole, &film, &what);
                assert_eq!(counts(&in_all), counts(&statistics), "{what}");
            }
        }
    }
}

/// Light paths of several dispatches, of which the one in flight is still added up.
#[test]
fn stopping_within_light_paths_changes_no_bit() {
    let context = context();
    let scene = shipped("cornell", (320, 256), 16);
    // So many samples a dispatch that the last of paths never finds all done already, however fast the device is.
    let settings = RenderSettings { samples_per_dispatch: Some(16), ..RenderSettings::of(&scene) };
    let (whole, statistics) = render_counted(&context, &scene, &settings);
    assert_eq!(statistics.light_paths, 5 << 15);
    let after_paths = |progress: &Progress| progress.done >= progress.total;
    for dispatches in 2..=4 {
        let mut left = dispatches;
        let mut renderer = Renderer::new(&context, &scene, &settings).unwrap();
        let stopped = renderer.render(|progress| {
            left -= i32::from(after_paths(progress));
            if left > 0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        // The first report is of paths, and after the last one there was another dispatch in flight.
        assert_eq!(renderer.statistics().light_paths, (dispatches as u64) << 15);
        assert!(renderer.statistics().stopped && stopped.is_ok());
        let checkpoint = renderer.checkpoint().unwrap();
        let mut other = Renderer::new(&context, &scene, &settings).unwrap();
        let film = other.go_on(&checkpoint, |_| ControlFlow::Continue(())).unwrap();
        assert_same_bits(&whole, &film, &format!("stopped after {dispatches} dispatches of light paths"));
        assert_eq!(counts(other.statistics()), counts(&statistics));
    }
}

/// Dispatches of a part of the image each.
#[test]
fn stopping_within_a_round_changes_no_bit() {
    let context = context();
    let scene = shipped("cat", (160, 128), 12);
    let settings = RenderSettings::of(&scene);
    let whole = render(&context, &scene, &settings);
    let (film, _, parts) = in_parts(&scene, &settings, 1);
    assert!(parts > 1, "never stopped");
    assert_same_bits(&whole, &film, "in parts");
    // Samples run out of the budget of loops, and are done again.
    let settings = RenderSettings { loop_budget: Some(4000), ..settings };
    assert_same_bits(&whole, &in_parts(&scene, &settings, 3).0, "in parts, with a budget");
}

#[test]
fn what_is_handed_out_meanwhile_is_gone_on_with() {
    let context = context();
    for name in ["cornell", "cat"] {
        let scene = shipped(name, (40, 24), SAMPLES);
        let settings = RenderSettings { samples_per_dispatch: Some(5), ..RenderSettings::of(&scene) };
        let whole = render(&context, &scene, &settings);
        let mut renderer = Renderer::new(&context, &scene, &settings).unwrap();
        let (mut kept, go_on) = (Vec::new(), |_: &Progress| ControlFlow::Continue(()));
        let film = renderer.render_keeping(None, Duration::ZERO, |checkpoint| kept.push(checkpoint), go_on).unwrap();
        assert_same_bits(&whole, &film, name);
        assert!(kept.len() > 2, "{name}: {}", kept.len());
        assert!(kept.is_sorted_by(|a, b| a.samples() < b.samples() && a.seconds() < b.seconds()));
        for checkpoint in [&kept[0], &kept[kept.len() / 2], &renderer.checkpoint().unwrap()] {
            assert_same_bits(&whole, &renderer.go_on(checkpoint, go_on).unwrap(), name);
        }
    }
}

#[test]
fn checkpoints_of_other_renderings_are_refused() {
    let context = context();
    let scene = shipped("cat", (16, 16), 64);
    let settings = RenderSettings { samples_per_dispatch: Some(1), reuse: Reuse::Always, ..RenderSettings::of(&scene) };
    let mut renderer = Renderer::new(&context, &scene, &settings).unwrap();
    assert!(renderer.checkpoint().is_err(), "nothing is rendered");
    let mut left = 20;
    let stop = |_: &Progress| {
        left -= 1;
        if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    renderer.render(stop).unwrap();
    let checkpoint = renderer.checkpoint().unwrap();

    let refused = |scene: &Scene, settings: &RenderSettings| {
        let mut renderer = Renderer::new(&context, scene, settings).unwrap();
        let taken = renderer.go_on(&checkpoint, |_| ControlFlow::Continue(()));
        assert!(matches!(taken, Err(RenderError::Settings(_))), "{settings:?}");
    };
    let mut larger = scene.clone();
    larger.film.width = 80;
    refused(&larger, &settings);
    refused(&scene, &RenderSettings { reuse: Reuse::Off, ..settings.clone() });
    let adaptive = RenderSettings { adaptive: Some(Adaptive { noise: 0.5 }), ..settings };
    refused(&scene, &adaptive);
    assert!(Renderer::new(&context, &scene, &adaptive).unwrap().checkpoint().is_err());
}

#[test]
fn a_rendering_is_gone_on_with_to_more_samples() {
    let context = context();
    let go_on = |_: &Progress| ControlFlow::Continue(());
    let rms = |a: &Film, b: &Film| {
        let squares =
            a.mean().into_iter().zip(b.mean()).flat_map(|(a, b)| [0, 1, 2].map(|c| f64::from(a[c] - b[c]).powi(2)));
        (squares.sum::<f64>() / (3.0 * a.counts().len() as f64)).sqrt()
    };
    for name in ["spheres", "cornell", "cat"] {
        let scene = |samples| shipped(name, (40, 24), samples);
        let all = RenderSettings::of(&scene(16));
        let plain = RenderSettings { reuse: Reuse::Off, sample_map: SampleMap::Off, ..all.clone() };
        let reference = render(&context, &scene(4096), &RenderSettings { samples: 4096, seed: 9, ..all.clone() });
        for (settings, same_bits) in [(plain, true), (all, false)] {
            let more = RenderSettings { samples: 256, begun_with: Some(16), ..settings.clone() };
            let mut renderer = Renderer::new(&context, &scene(16), &settings).unwrap();
            let begun = renderer.render(go_on).unwrap();
            let checkpoint = renderer.checkpoint().unwrap();
            let mut renderer = Renderer::new(&context, &scene(256), &more).unwrap();
            let film = renderer.go_on(&checkpoint, go_on).unwrap();
            let (before, after) = (rms(&begun, &reference), rms(&film, &reference));
            assert!(after < 0.5 * before, "{name}: {before} {after}");
            assert!(renderer.statistics().mean_samples_per_pixel >= 256.0, "{name}");
            if same_bits {
                let at_once = RenderSettings { begun_with: None, ..more.clone() };
                assert_same_bits(&render(&context, &scene(256), &at_once), &film, name);
            }
            // Once again, and to as many as it has.
            let checkpoint = renderer.checkpoint().unwrap();
            assert_same_bits(&film, &renderer.go_on(&checkpoint, go_on).unwrap(), name);
            let mut fewer =
                Renderer::new(&context, &scene(8), &RenderSettings { samples: 8, begun_with: Some(16), ..settings })
                    .unwrap();
            assert!(matches!(fewer.go_on(&checkpoint, go_on), Err(RenderError::Settings(_))));
        }
    }
}
