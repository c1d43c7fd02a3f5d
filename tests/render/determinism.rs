//! A sample is a pure function of scene, settings, pixel, index and seed: however a rendering is cut up, scheduled and
//! compiled, the film has the same bits.

use std::ops::ControlFlow;
use std::time::Duration;

use glam::DVec3;
use photolith::render::{Adaptive, Feature, Gradients, Prepared, Reuse, SampleMap, Scheduler};
use photolith::scene::{Bsdf, Light, Material, Mesh, Normals, Sphere, Surface};
use photolith::{Context, Film, RenderSettings, Renderer, Scene};

use crate::harness::{assert_same_bits, context, glass_cat, render, render_counted, shipped};
use crate::variants::{Subject, small_budget, variants};

const SAMPLES: u32 = 32;

/// Renders a scene at sizes that are no multiples of a tile, in every way.
fn same_bits_in_every_way(subject: Subject, name: &str, reuse: Reuse) {
    let context = context();
    for size in [(48, 40), (13, 21), (1, 1)] {
        let scene = shipped(name, size, SAMPLES);
        let base = RenderSettings { reuse, ..RenderSettings::of(&scene) };
        let expected = render(&context, &scene, &base);
        // Of small images, half of the ways.
        for settings in variants(subject, &base).into_iter().filter(|s| size == (48, 40) || s.general) {
            assert_same_bits(&render(&context, &scene, &settings), &expected, &format!("{size:?}, {settings:?}"));
        }
    }
}

#[test]
fn spheres() {
    same_bits_in_every_way(Subject::Spheres, "spheres", Reuse::Auto);
}

#[test]
fn glass() {
    same_bits_in_every_way(Subject::Glass, "glass", Reuse::Auto);
}

#[test]
fn paths_reused_without_a_bvh() {
    same_bits_in_every_way(Subject::GlassReused, "glass", Reuse::Always);
}

#[test]
fn mesh() {
    same_bits_in_every_way(Subject::Cat, "cat", Reuse::Off);
}

#[test]
fn mesh_with_reused_paths() {
    same_bits_in_every_way(Subject::CatReused, "cat", Reuse::Auto);
    let context = context();
    let scene = shipped("cat", (48, 40), SAMPLES);
    let off = RenderSettings { reuse: Reuse::Off, ..RenderSettings::of(&scene) };
    let differing = |a: &[[f64; 3]], b: &[[f64; 3]]| a.iter().zip(b).filter(|(a, b)| a != b).count();
    let (with, without) = (render(&context, &scene, &RenderSettings::of(&scene)), render(&context, &scene, &off));
    assert!(differing(with.sums(), without.sums()) > 1000, "paths are not reused");
}

/// Each feature by itself is compiled in where a scene lacks it. (Whether paths are reused makes no difference to that.)
#[test]
fn features_that_are_not_needed() {
    let context = context();
    // Diffuse surfaces and a point light; and none of the former.
    let diffuse = shipped("indirect", (48, 40), SAMPLES);
    let mut mirrors = diffuse.clone();
    mirrors.materials.iter_mut().for_each(|material| material.surface = Surface::mirror([0.9; 3]));
    mirrors.materials[0].surface = Surface::emitter([3.0; 3]);
    for (name, feature) in Feature::ALL {
        let scene = if feature == Feature::Diffuse { &mirrors } else { &diffuse };
        let base = RenderSettings { reuse: Reuse::Off, ..RenderSettings::of(scene) };
        let unneeded = RenderSettings { unneeded: Some(feature), ..base.clone() };
        let features = |settings| Prepared::of(scene, settings).expect("settings that make sense").features().clone();
        assert_ne!(features(&unneeded), features(&base), "{name} is needed");
        let expected = render(&context, scene, &base);
        assert!(expected.sums().iter().flatten().any(|&sum| sum > 0.0), "{name}: nothing is lit");
        assert_same_bits(&render(&context, scene, &unneeded), &expected, &format!("+{name}"));
    }
}

/// In a dark room hardly any noise is that of indirect light: after a pilot pass, paths serve their own pixels only.
#[test]
fn mesh_whose_paths_are_not_worth_reusing() {
    let context = context();
    let lit = shipped("cat", (48, 40), SAMPLES);
    let mut dark = lit.clone();
    for material in &mut dark.materials {
        if let Bsdf::Diffuse { reflectance } = &mut material.surface.bsdf {
            *reflectance = [0.02; 3];
        }
    }
    let pixels = 48 * 40;
    let counted = |scene: &Scene| render_counted(&context, scene, &RenderSettings::of(scene));
    let (_, all) = counted(&lit);
    assert!(all.reused_samples == all.samples && all.reuse_gain.is_some_and(|gain| gain > 1.5), "{all:?}");
    let (expected, few) = counted(&dark);
    assert!(few.reuse_gain.is_some_and(|gain| gain < 1.2), "{few:?}");
    assert!(few.reused_samples == 0 && few.samples == pixels * u64::from(SAMPLES), "{few:?}");
    // The same as ever in the mean, and in every way.
    let off = render(&context, &dark, &RenderSettings { reuse: Reuse::Off, ..RenderSettings::of(&dark) });
    let mean = |film: &Film| film.sums().iter().flatten().sum::<f64>() / (3 * pixels * u64::from(SAMPLES)) as f64;
    assert!((mean(&expected) / mean(&off) - 1.0).abs() < 0.01, "{} and {}", mean(&expected), mean(&off));
    let base = RenderSettings::of(&dark);
    for settings in [
        RenderSettings { samples_per_dispatch: Some(1), ..base.clone() },
        RenderSettings { samples_per_dispatch: Some(7), general: true, ..base.clone() },
        RenderSettings { loop_budget: Some(small_budget(Subject::CatReused, Scheduler::Queue)), ..base.clone() },
    ] {
        assert_same_bits(&render(&context, &dark, &settings), &expected, &format!("{settings:?}"));
    }
    // Too few samples for a pilot pass.
    let one = shipped("cat", (48, 40), 1);
    let (_, untried) = counted(&one);
    assert!(untried.reuse_gain.is_none() && untried.reused_samples == untried.samples, "{untried:?}");
}

/// Paths that meet their first diffuse surface at their last hit, in a mirror, go on if other features want that: the light of several
/// points there is the pixel's own all the same.
#[test]
fn last_hits_are_alike_in_every_kernel() {
    let context = context();
    let mut scene = shipped("spheres", (48, 40), SAMPLES);
    scene.integrator.max_depth = 2;
    let light = scene.lights[0].clone();
    scene.lights.push(light);
    for scheduler in [Scheduler::Inline, Scheduler::Queue] {
        let base = RenderSettings { scheduler, reuse: Reuse::Always, ..RenderSettings::of(&scene) };
        let (expected, statistics) = render_counted(&context, &scene, &base);
        assert!(statistics.gradients, "{statistics:?}");
        let general = RenderSettings { general: true, ..base };
        assert_same_bits(&render(&context, &scene, &general), &expected, &format!("{general:?}"));
    }
}

/// Where loops have no budget, workgroups of the queue take several tiles if these get few samples (four or eight here, with two
/// threads). Of some of them, parts lie outside.
#[test]
fn few_samples_in_many_tiles() {
    let context = context();
    let scenes = [1, 4].map(|samples| shipped("cat", (260, 252), samples));
    // The last of several paths, where the cat is seen.
    for scene in scenes.into_iter().chain([glass_cat((260, 252), 1)]) {
        let samples = scene.integrator.samples;
        for reuse in [Reuse::Off, Reuse::Auto] {
            let base = RenderSettings { reuse, ..RenderSettings::of(&scene) };
            let expected = render(&context, &scene, &RenderSettings { scheduler: Scheduler::Inline, ..base.clone() });
            let settings = RenderSettings { scheduler: Scheduler::Queue, loop_budget: Some(0), ..base };
            assert_same_bits(&render(&context, &scene, &settings), &expected, &format!("{samples} {settings:?}"));
        }
    }
}

/// Which parts of an image are noisy, and what samples cost there, is told by the same numbers however the work is cut.
#[test]
fn noisy_parts_get_more_samples() {
    let context = context();
    let scene = shipped("cat", (128, 128), 8);
    same_bits_with_a_sample_map(&context, &scene);
    // Of some sets of tiles, and of some groups, parts lie outside.
    same_bits_with_a_sample_map(&context, &shipped("cat", (132, 124), 8));
    // Of two samples no pixel has less.
    same_bits_with_a_sample_map(&context, &shipped("cat", (128, 128), 2));
}

/// Four times as many need a larger table of random numbers.
#[test]
fn noisy_parts_get_more_of_hundreds_of_samples() {
    let context = context();
    let scene = shipped("cat", (64, 48), 260);
    let base = RenderSettings::of(&scene);
    let expected = render(&context, &scene, &base);
    assert!(expected.counts().contains(&130) && expected.counts().iter().any(|&n| n > 260), "all alike");
    let general = RenderSettings { general: true, samples_per_dispatch: Some(50), ..base };
    assert_same_bits(&render(&context, &scene, &general), &expected, "general, in parts");
}

fn same_bits_with_a_sample_map(context: &Context, scene: &Scene) {
    let base = RenderSettings::of(scene);
    let (expected, statistics) = render_counted(context, scene, &base);
    let (counts, samples) = (expected.counts(), scene.integrator.samples);
    let least = if samples < 4 { samples } else { samples / 2 };
    assert!(counts.iter().min() == Some(&least) && counts.iter().any(|&n| n > samples), "{statistics:?}");
    assert_eq!(counts.iter().map(|&n| u64::from(n)).sum::<u64>(), statistics.samples);
    for settings in [
        RenderSettings { samples_per_dispatch: Some(1), ..base.clone() },
        RenderSettings { samples_per_dispatch: Some(5), general: true, ..base.clone() },
        RenderSettings { scheduler: Scheduler::Inline, ..base.clone() },
        RenderSettings { scheduler: Scheduler::Queue, ..base.clone() },
        RenderSettings { passage: Some(1 << 16), ..base.clone() },
    ] {
        assert_same_bits(&render(context, scene, &settings), &expected, &format!("{settings:?}"));
    }
    let even = render(context, scene, &RenderSettings { sample_map: SampleMap::Off, ..base });
    assert!(even.counts().iter().all(|&n| n == samples));
}

/// Of a workgroup that does not fill its subgroups some lanes hold nothing, where others would look for it.
#[test]
fn lanes_that_never_work() {
    let context = context();
    let mut scene = shipped("indirect", (24, 20), 3);
    let power = [9000.0, 7000.0, 5000.0];
    scene.lights.push(Light::Point { position: DVec3::new(20.0, 30.0, 10.0), power });
    scene.materials.push(Material::new("emitter", Surface::emitter([5.0, 7.0, 9.0])));
    let material = scene.materials.len() as u32 - 1;
    scene.spheres.push(Sphere { center: DVec3::new(-30.0, 30.0, 0.0), radius: 4.0, material, inward: false });
    let base = RenderSettings { reuse: Reuse::Off, ..RenderSettings::of(&scene) };
    let expected = render(&context, &scene, &base);
    for size in [1, 3, 13] {
        let settings = RenderSettings { workgroup_size: Some(size), ..base.clone() };
        assert_same_bits(&render(&context, &scene, &settings), &expected, &format!("workgroups of {size}"));
    }
}

/// A dispatch has so many workgroups at most: with small ones the film is cut into bands.
#[test]
fn a_film_in_bands() {
    let context = context();
    let scene = shipped("cornell", (1024, 540), 4);
    let base = RenderSettings { reuse: Reuse::Off, scheduler: Scheduler::Inline, ..RenderSettings::of(&scene) };
    let (expected, statistics) = render_counted(&context, &scene, &base);
    assert!(statistics.multiplied_pixels > 0, "{statistics:?}");
    for passage in [None, Some(1 << 20)] {
        let bands = RenderSettings { workgroup_size: Some(8), passage, ..base.clone() };
        assert_same_bits(&render(&context, &scene, &bands), &expected, &format!("in bands, {passage:?}"));
    }
}

/// Where the host does not see the film, the halves of a rendering to a noise change places by way of the host.
#[test]
fn dual_films_through_a_passage() {
    let context = context();
    let scene = shipped("cat", (132, 124), 64);
    let base = RenderSettings { adaptive: Some(Adaptive { noise: 0.02 }), ..RenderSettings::of(&scene) };
    let (expected, statistics) = render_counted(&context, &scene, &base);
    assert!(statistics.gradients, "{statistics:?}");
    let passage = RenderSettings { passage: Some(1 << 16), ..base };
    assert_same_bits(&render(&context, &scene, &passage), &expected, "through a passage");
}

#[test]
fn emitters_and_roulette() {
    let context = context();
    let mut scene = shipped("cornell", (48, 40), SAMPLES);
    // Of few samples as of many.
    let [_, expected] = [2, SAMPLES].map(|samples| {
        scene.integrator.samples = samples;
        let (image, statistics) = render_counted(&context, &scene, &RenderSettings::of(&scene));
        // Without a map, other pixels are the same.
        let even = RenderSettings { sample_map: SampleMap::Off, ..RenderSettings::of(&scene) };
        let off = render(&context, &scene, &even);
        let differing = image.sums().iter().zip(off.sums()).filter(|(a, b)| a != b).count() as u64;
        let multiplied = statistics.multiplied_pixels;
        assert!(
            (50..1500).contains(&multiplied) && (1..=multiplied).contains(&differing),
            "{differing} of {multiplied}"
        );
        image
    });
    for settings in variants(Subject::Cornell, &RenderSettings::of(&scene)) {
        assert_same_bits(&render(&context, &scene, &settings), &expected, &format!("{settings:?}"));
    }
}

/// An emitter behind the camera is seen in a small mirror before it, whose edge is found there before one sample as before four.
#[test]
fn an_emitter_in_a_small_mirror() {
    let context = context();
    for samples in [1, 4] {
        let mut scene = shipped("cat", (192, 192), samples);
        scene.meshes.clear();
        scene.lights.clear();
        scene.camera.position = DVec3::new(0.0, 0.0, 20.0);
        scene.camera.target = DVec3::ZERO;
        let ball = |z: f64, radius: f64, material: u32| Sphere {
            center: DVec3::new(0.0, 0.0, z),
            radius,
            material,
            inward: false,
        };
        // The rest is dark.
        for material in &mut scene.materials {
            material.surface = Surface::diffuse([0.05; 3]);
        }
        let first = scene.materials.len() as u32;
        scene.spheres.extend([ball(-10.0, 4.0, first), ball(30.0, 3.0, first + 1)]);
        let surfaces = [Surface::mirror([0.9; 3]), Surface::emitter([50.0; 3])];
        scene.materials.extend(surfaces.map(|surface| Material::new(format!("{surface:?}"), surface)));
        let settings = RenderSettings { reuse: Reuse::Off, ..RenderSettings::of(&scene) };
        let (_, statistics) = render_counted(&context, &scene, &settings);
        assert!((4..100).contains(&statistics.multiplied_pixels), "{statistics:?}");
    }
}

/// Only the kinds of lights that there are are compiled in.
#[test]
fn lights_of_each_kind() {
    let context = context();
    let mut scene = shipped("spheres", (24, 20), 4);
    scene.spheres.truncate(1);
    scene.spheres[0] =
        Sphere { center: DVec3::new(0.0, -1000.0, 0.0), radius: 990.0, inward: false, ..scene.spheres[0] };
    scene.lights.truncate(1);
    let emitter = scene.materials.len() as u32;
    scene.materials.push(Material::new("emitter", Surface::emitter([3.0; 3])));
    // Facing down.
    let flat = |corners: &[[f64; 2]]| Mesh {
        name: "emitter".to_owned(),
        positions: corners.iter().map(|&[x, z]| DVec3::new(x, 10.0, z)).collect(),
        vertex_normals: Vec::new(),
        triangles: (2..corners.len() as u32).map(|i| [0, i - 1, i]).collect(),
        triangle_materials: vec![emitter; corners.len() - 2],
        normals: Normals::Flat,
        ..Mesh::default()
    };
    let ball = |radius, inward| Sphere { center: DVec3::new(0.0, 10.0, 0.0), radius, material: emitter, inward };
    let meshes = [
        flat(&[[-20.0, -20.0], [20.0, -20.0], [0.0, 20.0]]),
        flat(&[[-20.0, -20.0], [15.0, -20.0], [25.0, 20.0], [-10.0, 20.0]]),
        flat(&[[-20.0, -20.0], [20.0, -20.0], [20.0, 20.0], [-20.0, 20.0]]),
    ];
    let lit = |change: &dyn Fn(&mut Scene)| {
        let mut lit = scene.clone();
        lit.lights.clear();
        change(&mut lit);
        lit
    };
    let mut scenes: Vec<_> = meshes.iter().map(|mesh| lit(&|s| s.meshes = vec![mesh.clone()])).collect();
    scenes.extend([(5.0, false), (500.0, true)].map(|(radius, inward)| lit(&|s| s.spheres.push(ball(radius, inward)))));
    scenes.push(lit(&|s| s.lights = vec![scene.lights[0].clone(); 2]));
    scenes.push(lit(&|s| {
        s.meshes = meshes.to_vec();
        s.spheres.push(ball(5.0, false));
        s.lights = scene.lights.clone();
    }));
    for (i, scene) in scenes.iter().enumerate() {
        let base = RenderSettings::of(scene);
        let expected = render(&context, scene, &base);
        let lit = expected.sums().iter().filter(|sum| sum.iter().all(|&x| x > 0.0)).count();
        assert!(lit > 100, "scene {i}: {lit} pixels are lit");
        let all_kinds = RenderSettings { unneeded: Some(Feature::LightKinds), ..base };
        assert_same_bits(&render(&context, scene, &all_kinds), &expected, &format!("scene {i}"));
    }
}

/// More samples go on where fewer ended: the first of them are the same. (Without reuse: `determinism/stopped` of `check`.)
#[test]
fn a_film_of_n_samples_is_the_start_of_a_longer_one() {
    let context = context();
    // Below 2^10 samples, so that all use the same table of the sampler.
    let long = shipped("spheres", (9, 7), 64);
    // Gradients and the sample map go by the number of samples that are asked for.
    let settings = |scene| RenderSettings {
        reuse: Reuse::Always,
        gradients: Gradients::Off,
        sample_map: SampleMap::Off,
        ..RenderSettings::of(scene)
    };
    // The limit is over before the first dispatch ends.
    let stopped =
        RenderSettings { samples_per_dispatch: Some(3), time_limit: Some(Duration::from_nanos(1)), ..settings(&long) };
    let begun = render_stopped(&context, &long, &stopped);
    let samples = begun.counts()[0];
    assert!((1..64).contains(&samples), "{samples} samples");
    let short = shipped("spheres", (9, 7), samples);
    assert_same_bits(&begun, &render(&context, &short, &settings(&short)), &format!("{samples} samples"));
}

/// What there is of a rendering that has stopped.
fn render_stopped(context: &Context, scene: &Scene, settings: &RenderSettings) -> Film {
    let mut renderer = Renderer::new(context, scene, settings).expect("a renderer");
    let film = renderer.render(|_| ControlFlow::Continue(())).expect("a film");
    assert!(renderer.statistics().stopped);
    film
}

/// The variants above are different programs only if they really cut the work differently.
#[test]
fn the_cut_is_what_was_asked_for() {
    let context = context();
    let scene = shipped("spheres", (48, 40), 64);
    let dispatches = |n| {
        // Without the dispatch of a pilot pass.
        let reuse = Reuse::Off;
        let settings = RenderSettings { samples_per_dispatch: Some(n), reuse, ..RenderSettings::of(&scene) };
        render_counted(&context, &scene, &settings).1.dispatches
    };
    assert_eq!([1, 3, 7, 64].map(dispatches), [64, 22, 10, 1]);
    // Samples beyond the budget are done again, in dispatches of their own.
    for (subject, name, scheduler) in [
        (Subject::Spheres, "spheres", Scheduler::Inline),
        (Subject::Cat, "cat", Scheduler::Inline),
        (Subject::Cornell, "cornell", Scheduler::Queue),
    ] {
        let scene = shipped(name, (48, 40), SAMPLES);
        let base = RenderSettings {
            scheduler,
            samples_per_dispatch: Some(SAMPLES),
            // With everything compiled in, the box is in a BVH, and the queue has work.
            general: scheduler == Scheduler::Queue,
            // Pixels with more samples may need dispatches of their own too.
            sample_map: SampleMap::Off,
            ..RenderSettings::of(&scene)
        };
        let budget = Some(small_budget(subject, scheduler));
        let unbounded = render_counted(&context, &scene, &base).1.dispatches;
        let bounded = render_counted(&context, &scene, &RenderSettings { loop_budget: budget, ..base }).1.dispatches;
        assert!(bounded > unbounded, "{name}, {scheduler:?}: {bounded} dispatches, {unbounded} without a budget");
    }
}

#[test]
fn another_seed_is_another_image() {
    let context = context();
    let scene = shipped("spheres", (16, 16), 4);
    let base = RenderSettings::of(&scene);
    let zero = render(&context, &scene, &base);
    let one = render(&context, &scene, &RenderSettings { seed: 1, ..base });
    assert!(zero.sums().iter().zip(one.sums()).all(|(a, b)| a != b));
}
