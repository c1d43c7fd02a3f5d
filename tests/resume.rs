//! A rendering that was stopped and gone on with has the bits of one that was not.

mod common;

use std::ops::ControlFlow;

use common::{assert_same_bits, context, render, shipped};
use photolith::render::{Adaptive, Checkpoint, Reuse};
use photolith::{Film, RenderError, RenderSettings, Renderer, Scene};

const SAMPLES: u32 = 24;

/// Stopped after every few dispatches, with a renderer of its own each time.
fn in_parts(scene: &Scene, settings: &RenderSettings, dispatches: u32) -> (Film, u32) {
    let context = context();
    let mut kept: Option<Checkpoint> = None;
    for parts in 1.. {
        let mut renderer = Renderer::new(&context, scene, settings).unwrap();
        let mut left = dispatches;
        let progress = |_: &_| {
            left -= 1;
            if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let film = match &kept {
            Some(checkpoint) => renderer.go_on(checkpoint, progress).unwrap(),
            None => renderer.render(progress).unwrap(),
        };
        let Some(checkpoint) = renderer.checkpoint().unwrap() else {
            assert_eq!(renderer.statistics().samples, film.counts().iter().map(|&n| u64::from(n)).sum::<u64>());
            return (film, parts);
        };
        let mut bytes = Vec::new();
        checkpoint.write("what", &mut bytes).unwrap();
        let (what, read) = Checkpoint::read(&bytes).unwrap();
        assert_eq!((what.as_str(), &read), ("what", &checkpoint));
        kept = Some(read);
    }
    unreachable!()
}

#[test]
fn stopping_changes_no_bit() {
    let context = context();
    for name in ["spheres", "cornell", "cat"] {
        for reuse in [Reuse::Always, Reuse::Off] {
            let scene = shipped(name, (40, 24), SAMPLES);
            // Small dispatches, so that rounds, phases and what precedes beams are cut in two.
            let settings = RenderSettings { samples_per_dispatch: Some(5), reuse, ..RenderSettings::of(&scene) };
            let whole = render(&context, &scene, &settings);
            for dispatches in [1, 3] {
                let (film, parts) = in_parts(&scene, &settings, dispatches);
                assert!(parts > 1, "{name}: never stopped");
                assert_same_bits(&whole, &film, &format!("{name}, {reuse:?}, {dispatches} dispatches at a time"));
            }
        }
    }
}

/// Dispatches of a part of the image each.
#[test]
fn stopping_within_a_round_changes_no_bit() {
    let context = context();
    let scene = shipped("cat", (160, 128), 12);
    let settings = RenderSettings::of(&scene);
    let whole = render(&context, &scene, &settings);
    let (film, parts) = in_parts(&scene, &settings, 1);
    assert!(parts > 1, "never stopped");
    assert_same_bits(&whole, &film, "in parts");
}

#[test]
fn a_complete_rendering_leaves_nothing_and_others_are_refused() {
    let context = context();
    let scene = shipped("cat", (16, 16), 64);
    let stop = |_: &_| ControlFlow::Break(());
    let settings = RenderSettings { samples_per_dispatch: Some(1), reuse: Reuse::Always, ..RenderSettings::of(&scene) };
    let mut renderer = Renderer::new(&context, &scene, &settings).unwrap();
    renderer.render(stop).unwrap();
    let checkpoint = renderer.checkpoint().unwrap().unwrap();
    renderer.render(|_| ControlFlow::Continue(())).unwrap();
    assert_eq!(renderer.checkpoint().unwrap(), None);

    // More pixels, fewer samples than there are, other gradients.
    let refused = |scene: &Scene, settings: &RenderSettings| {
        let mut renderer = Renderer::new(&context, scene, settings).unwrap();
        let taken = renderer.go_on(&checkpoint, |_| ControlFlow::Continue(()));
        assert!(matches!(taken, Err(RenderError::Settings(_))), "{settings:?}");
    };
    let mut larger = scene.clone();
    larger.film.width = 80;
    refused(&larger, &settings);
    refused(&scene, &RenderSettings { reuse: Reuse::Off, ..settings.clone() });
    let adaptive = RenderSettings { adaptive: Some(Adaptive::to_noise(0.5)), ..settings };
    refused(&scene, &adaptive);
    assert!(Renderer::new(&context, &scene, &adaptive).unwrap().checkpoint().is_err());
}
