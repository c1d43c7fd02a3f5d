//! The bounding volume hierarchy finds what testing every triangle finds, and the two triangle tests agree.

mod common;

use std::ops::ControlFlow;

use common::{assert_same_bits, context, render, shipped};
use photolith::render::{Accel, Reuse, Scheduler, TriangleTest};
use photolith::scene::Sphere;
use photolith::{Context, RenderSettings, Renderer, Scene};

/// What the student report, whose renderer this one grew from, measured for its mesh.
const REPORTED_GAIN: f64 = 7.0;

#[test]
fn bvh_and_brute_force_give_the_same_bits() {
    let context = context();
    let scene = shipped("cat", (40, 24), 1);
    let base = RenderSettings { reuse: Reuse::Off, ..RenderSettings::of(&scene) };
    for triangle_test in [TriangleTest::Watertight, TriangleTest::MollerTrumbore] {
        let base = RenderSettings { triangle_test, ..base.clone() };
        let every = render(&context, &scene, &RenderSettings { accel: Accel::None, ..base.clone() });
        for scheduler in [Scheduler::Inline, Scheduler::Queue] {
            let film = render(&context, &scene, &RenderSettings { scheduler, ..base.clone() });
            assert_same_bits(&film, &every, &format!("{triangle_test:?}, {scheduler:?}"));
        }
    }
}

/// Also of those that are not in the hierarchy, and of those of which some are.
#[test]
fn copies_of_spheres_are_one_sphere() {
    let context = context();
    let once = shipped("glass", (24, 16), 4);
    let of =
        |scene: &Scene| render(&context, scene, &RenderSettings { reuse: Reuse::Off, ..RenderSettings::of(scene) });
    for copies in [1, 16] {
        let mut scene = once.clone();
        // Far from the others in the file, and of another material.
        let other = once.spheres.iter().map(|s| Sphere { material: 0, ..s.clone() }).cycle();
        scene.spheres.extend(other.take(copies * once.spheres.len()));
        assert_same_bits(&of(&scene), &of(&once), &format!("{copies} copies"));
    }
}

/// They differ where a ray passes an edge so closely that rounding decides, and in how they round.
#[test]
fn triangle_tests_agree_but_for_edges() {
    let context = context();
    let scene = shipped("cat", (128, 128), 4);
    // A path that meets another triangle would show in four pixels.
    let base = RenderSettings { reuse: Reuse::Off, ..RenderSettings::of(&scene) };
    let watertight = render(&context, &scene, &base).mean();
    let other = RenderSettings { triangle_test: TriangleTest::MollerTrumbore, ..base };
    let moller_trumbore = render(&context, &scene, &other).mean();
    let differs = |(a, b): &(&[f32; 3], &[f32; 3])| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-3 * a[c].abs().max(1e-3));
    let differing = watertight.iter().zip(&moller_trumbore).filter(differs).count() as f64 / watertight.len() as f64;
    println!("{:.4}% of the pixels differ", 100.0 * differing);
    assert!(differing < 1e-3, "{differing} of the pixels differ");
}

/// Seconds for an image, the best of three.
fn seconds(context: &Context, scene: &Scene, settings: &RenderSettings) -> f64 {
    let mut renderer = Renderer::new(context, scene, settings).expect("a renderer");
    let run = |_| {
        renderer.render(|_| ControlFlow::Continue(())).expect("a film");
        renderer.statistics().render_seconds
    };
    (0..3).map(run).fold(f64::INFINITY, f64::min)
}

#[test]
fn gain_of_the_bvh_for_the_cat() {
    let context = context();
    let small = shipped("cat", (16, 16), 1);
    let every = seconds(&context, &small, &RenderSettings { accel: Accel::None, ..RenderSettings::of(&small) }) / 256.0;
    let large = shipped("cat", (64, 64), 16);
    let bvh = seconds(&context, &large, &RenderSettings::of(&large)) / 65536.0;
    let gain = every / bvh;
    println!(
        "{} triangles: {:.1} µs a sample with the BVH, {:.0} µs without: {gain:.0} times as fast",
        large.triangle_count(),
        1e6 * bvh,
        1e6 * every
    );
    assert!(gain > REPORTED_GAIN, "a gain of {gain}");
}

/// Steps are counted by both schedulers: 0.86 a ray, most of which miss the cat.
#[test]
fn steps_are_counted() {
    let context = context();
    let scene = shipped("cat", (48, 40), 16);
    let counted = [Scheduler::Inline, Scheduler::Queue].map(|scheduler| {
        let settings = RenderSettings { scheduler, reuse: Reuse::Off, count_steps: true, ..RenderSettings::of(&scene) };
        let mut renderer = Renderer::new(&context, &scene, &settings).expect("a renderer");
        renderer.render(|_| ControlFlow::Continue(())).expect("a film");
        let s = renderer.statistics();
        (s.rays, s.shadow_rays, s.bvh_steps)
    });
    assert_eq!(counted[0], counted[1]);
    let (rays, shadow_rays, steps) = counted[0];
    let per_ray = steps as f64 / (rays + shadow_rays) as f64;
    println!("{per_ray:.2} steps for each of {rays} rays and {shadow_rays} shadow rays");
    assert!((0.7..1.1).contains(&per_ray), "{per_ray} steps a ray");
}
