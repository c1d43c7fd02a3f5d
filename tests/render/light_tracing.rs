//! Light that is traced from emitters has the same bits, however it is scheduled.

use glam::DVec3;
use photolith::render::{LightTracing, Scheduler};
use photolith::scene::{Material, Sphere, Surface};
use photolith::{RenderSettings, Scene};

use crate::harness::{assert_same_bits, context, glass_cat, render, render_counted};
use crate::variants::{Subject, variants};

const SAMPLES: u32 = 32;

/// Light is traced from the emitter as well, which rays through the BVH outlast a small budget in turn.
#[test]
fn light_paths_through_a_mesh() {
    let context = context();
    let scene = glass_cat((48, 40), SAMPLES);
    let base = RenderSettings::of(&scene);
    let (expected, statistics) = render_counted(&context, &scene, &base);
    assert!(statistics.light_paths > 0 && statistics.reused_samples == 0, "{statistics:?}");
    let off = render(&context, &scene, &RenderSettings { light_tracing: LightTracing::Off, ..base.clone() });
    let differing = off.sums().iter().zip(expected.sums()).filter(|(a, b)| a != b).count();
    assert!(differing > 50, "light paths light {differing} pixels");
    for settings in variants(Subject::GlassCat, &base) {
        assert_same_bits(&render(&context, &scene, &settings), &expected, &format!("{settings:?}"));
    }
    // A sample and a light path fit in, but not several light paths.
    let tight = RenderSettings { scheduler: Scheduler::Inline, loop_budget: Some(600), ..base };
    assert_same_bits(&render(&context, &scene, &tight), &expected, "glass cat, light paths one by one");
}

/// Balls of glass and mirrors under an emitter.
fn many_bodies(size: (u32, u32), samples: u32) -> Scene {
    let mut scene = glass_cat(size, samples);
    scene.meshes.clear();
    let glass = scene.materials.len() as u32 - 1;
    scene.materials.push(Material::new("mirror", Surface::mirror([0.9; 3])));
    scene.spheres.extend((0..30u32).map(|i| Sphere {
        center: DVec3::new(f64::from(i % 6) * 6.0 - 15.0, f64::from(i / 6) * 5.0 - 6.0, f64::from(i % 4) * 3.0),
        radius: 2.0,
        material: glass + i % 2,
        inward: false,
    }));
    scene
}

/// Light paths aim at each of many bodies: what the sum over these takes is counted where loops have a budget.
#[test]
fn light_paths_towards_many_bodies() {
    let context = context();
    let scene = many_bodies((48, 40), SAMPLES);
    let base = RenderSettings::of(&scene);
    let (expected, statistics) = render_counted(&context, &scene, &base);
    assert!(statistics.light_paths > 0 && statistics.multiplied_pixels > 50, "{statistics:?}");
    for (scheduler, threads) in
        [(Scheduler::Inline, None), (Scheduler::Interleaved, Some(true)), (Scheduler::Queue, None)]
    {
        for loop_budget in [1500, 4000] {
            let what = format!("many bodies, {scheduler:?}, loop budget {loop_budget}");
            let settings = RenderSettings { scheduler, threads, loop_budget: Some(loop_budget), ..base.clone() };
            assert_same_bits(&render(&context, &scene, &settings), &expected, &what);
        }
    }
}

/// What a dispatch has noted is added up while the next one is traced: on CPUs there are five, on GPUs three larger ones, and those that
/// ran out of their budget are traced once more.
#[test]
fn light_paths_of_several_dispatches() {
    let context = context();
    let scene = many_bodies((320, 256), 16);
    let base = RenderSettings::of(&scene);
    let (expected, statistics) = render_counted(&context, &scene, &base);
    assert_eq!(statistics.light_paths, 320 * 256 * 16 / 8);
    for (threads, loop_budget) in [(Some(true), None), (None, Some(1500))] {
        let settings = RenderSettings { threads, loop_budget, ..base.clone() };
        let (film, again) = render_counted(&context, &scene, &settings);
        let what = format!("several dispatches, threads {threads:?}, loop budget {loop_budget:?}");
        assert_same_bits(&film, &expected, &what);
        assert_eq!(again.rays > statistics.rays, loop_budget.is_some(), "{what}: {again:?}, {statistics:?}");
    }
}
