//! What these tests share: a device that is watched by the validation layers, and the scenes.
//!
//! A machine without a Vulkan device or without the validation layers fails these tests: one that passes by skipping
//! hides everything.

use std::ops::{ControlFlow, Deref};

use glam::DVec3;
use photolith::render::{RenderStatistics, Reuse, SampleMap};
use photolith::scene::{Material, Normals, Sphere, Surface};
use photolith::{Context, Film, RenderSettings, Renderer, Scene, Validation};

use crate::assets::scene_path;
use crate::common::context_options;

/// The scenes that are shipped, by name.
pub const SCENES: [&str; 8] =
    ["antialias-1", "antialias-100", "cat", "cornell", "direct", "glass", "indirect", "spheres"];

/// A device under validation. Fails the test on drop if a layer had anything to say.
pub struct Watched(Context);

/// The default device under core validation.
pub fn context() -> Watched {
    watched(Validation::Core)
}

/// The default device under the given validation.
pub fn watched(validation: Validation) -> Watched {
    Watched(Context::new(&context_options(validation)).expect("a Vulkan device and validation layers"))
}

impl Deref for Watched {
    type Target = Context;

    fn deref(&self) -> &Context {
        &self.0
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        let messages = self.0.messages().all();
        if !std::thread::panicking() {
            assert!(messages.is_empty(), "{} validation message(s): {messages:#?}", messages.len());
        }
    }
}

/// A shipped scene with another image size and number of samples.
pub fn shipped(name: &str, (width, height): (u32, u32), samples: u32) -> Scene {
    let mut scene = Scene::load(&scene_path(name)).expect("a shipped scene loads").scene;
    (scene.film.width, scene.film.height) = (width, height);
    scene.integrator.samples = samples;
    scene
}

/// Renders to the end.
pub fn render(context: &Context, scene: &Scene, settings: &RenderSettings) -> Film {
    render_counted(context, scene, settings).0
}

/// Renders to the end, and says what was done. Samples that are not finite fail.
pub fn render_counted(context: &Context, scene: &Scene, settings: &RenderSettings) -> (Film, RenderStatistics) {
    let mut renderer = Renderer::new(context, scene, settings).expect("a renderer");
    let film = renderer.render(|_| ControlFlow::Continue(())).expect("a film");
    let statistics = renderer.statistics().clone();
    assert_eq!(statistics.bad_samples, 0, "{}: samples that are not finite", scene.source);
    // Where paths may be reused noisy parts may get up to four times as many, others at least half; and edges of emitters up to 32 times
    // (`SampleMap`). One sample is too few to try.
    let pilot_groups = settings.samples > 1 && (settings.reuse == Reuse::Always || statistics.reuse_gain.is_some());
    let mapped = settings.sample_map == SampleMap::Auto && (pilot_groups || statistics.multiplied_pixels > 0);
    let samples =
        if mapped { settings.samples.div_ceil(2)..=32 * settings.samples } else { settings.samples..=settings.samples };
    assert!(film.counts().iter().all(|n| samples.contains(n)), "{}: pixels lack samples", scene.source);
    (film, statistics)
}

/// Asserts that two films hold the same bits.
pub fn assert_same_bits(film: &Film, expected: &Film, what: &str) {
    let bits = |film: &Film| film.sums().iter().map(|s| s.map(f64::to_bits)).collect::<Vec<_>>();
    assert_eq!(film.counts(), expected.counts(), "{what}: counts of samples");
    let (a, b) = (bits(film), bits(expected));
    let differing = a.iter().zip(&b).filter(|(a, b)| a != b).count();
    assert_eq!(differing, 0, "{what}: {differing} of {} pixels differ", a.len());
}

/// A cat, and more balls than constants hold, so that both are in the hierarchy.
pub fn spheres_and_cat(size: (u32, u32), samples: u32) -> Scene {
    let mut scene = shipped("cat", size, samples);
    scene.spheres.extend((0..20).map(|i| {
        let center = DVec3::new(-40.0 + 4.0 * f64::from(i), 5.0 + f64::from(i % 7), 15.0);
        Sphere { center, radius: 1.5, material: 0, inward: false }
    }));
    scene
}

/// A cat of glass under an emitter.
pub fn glass_cat(size: (u32, u32), samples: u32) -> Scene {
    let mut scene = shipped("cat", size, samples);
    scene.lights.clear();
    let emitter = scene.materials.len() as u32;
    scene.materials.push(Material::new("emitter", Surface::emitter([50.0; 3])));
    scene.spheres.push(Sphere { center: DVec3::new(-5.0, 45.0, 15.0), radius: 5.0, material: emitter, inward: false });
    for mesh in &mut scene.meshes {
        mesh.normals = Normals::Flat;
        mesh.triangle_materials.fill(emitter + 1);
    }
    scene.materials.push(Material::new("glass", Surface::dielectric(1.5)));
    scene
}
