//! The bounding volume hierarchy: copies, and the count of its steps. That it finds what testing every triangle finds, and that the two
//! triangle tests agree, are cases of `check` (`bvh/brute-force`, `determinism/no-bvh`, `triangles/two-tests`).

use std::ops::ControlFlow;

use photolith::render::{Accel, Reuse, SampleMap, Scheduler};
use photolith::scene::Sphere;
use photolith::{RenderSettings, Renderer, Scene};

use crate::harness::{assert_same_bits, context, glass_cat, render, shipped, spheres_and_cat};

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

/// Where the device has none, they are refused by name. The cat of glass has light paths too.
#[test]
fn ray_queries_render_the_same_image() {
    let context = context();
    for scene in [shipped("cat", (48, 40), 4), glass_cat((32, 32), 4)] {
        let settings = RenderSettings { accel: Accel::RayQuery, ..RenderSettings::of(&scene) };
        if context.info().ray_query.is_none() {
            let error = Renderer::new(&context, &scene, &settings).err().expect("no renderer");
            assert!(error.to_string().contains("lacks ray queries"), "{error}");
            continue;
        }
        let traversed = render(&context, &scene, &RenderSettings::of(&scene));
        assert_same_bits(&render(&context, &scene, &settings), &traversed, &scene.source);
    }
}

/// Whatever a trial chooses.
#[test]
fn a_trial_changes_no_image() {
    let context = context();
    let scene = shipped("cat", (24, 20), 4);
    let traversed = render(&context, &scene, &RenderSettings { accel: Accel::Bvh, ..RenderSettings::of(&scene) });
    let tried = RenderSettings { forces_trial: true, ..RenderSettings::of(&scene) };
    let mut renderer = Renderer::new(&context, &scene, &tried).expect("a renderer");
    let has_choice = context.info().ray_query.is_some();
    let chosen = renderer.settings().accel;
    let expected: &[_] = if has_choice { &[Accel::Bvh, Accel::RayQuery] } else { &[Accel::Auto] };
    assert!(expected.contains(&chosen), "{chosen:?}");
    let film = renderer.render(|_| ControlFlow::Continue(())).expect("a film");
    assert_same_bits(&film, &traversed, "after a trial");
    assert_same_bits(&render(&context, &scene, &RenderSettings::of(&scene)), &traversed, "without one");
}

/// The device decides at edges what a ray meets; else images have the same bits.
#[test]
fn queried_triangles_render_nearly_the_same_image() {
    let context = context();
    for scene in [shipped("cat", (48, 40), 4), spheres_and_cat((48, 40), 4)] {
        // What pixels have in common spreads differences.
        let own = RenderSettings { reuse: Reuse::Off, sample_map: SampleMap::Off, ..RenderSettings::of(&scene) };
        let settings = RenderSettings { accel: Accel::RayQueryTriangles, ..own.clone() };
        if context.info().ray_query.is_none() {
            assert!(Renderer::new(&context, &scene, &settings).is_err());
            continue;
        }
        let traversed = render(&context, &scene, &own);
        let queried = render(&context, &scene, &settings);
        assert_same_bits(&render(&context, &scene, &settings), &queried, "rendered again");
        let differ = queried.sums().iter().zip(traversed.sums()).filter(|(a, b)| a != b).count();
        assert!(differ <= traversed.sums().len() / 100, "{}: {differ} pixels differ", scene.source);
    }
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
