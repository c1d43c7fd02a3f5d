//! Whether a rendering asks a driver that runs on the CPU for vectors of 512 bits.

use super::features::{Features, glass_triangles};
use super::settings::{RenderSettings, Reuse};
use crate::gpu::WideVectors;
use crate::scene::Scene;

/// Samples, over all pixels, from which on a rendering is long: 64 of 256×256. The first start of all takes .15 to .2 s longer
/// with vectors of 512 bits, .7 s with a large hierarchy; so many samples gain .03 to .1 s, .2 s (a Xeon, Granite Rapids, 25.0.7).
const LONG_RENDERING: f64 = (64 * 256 * 256) as f64;
/// Triangles and spheres from which on a hierarchy is a large one: with a smaller one the width makes no difference.
const LARGE_TREE: usize = 75_000;

/// Whether the CPU has vectors of 512 bits, and they pay for a rendering: then
/// [`prefer_wide_vectors`](crate::gpu::prefer_wide_vectors) is to be called before the first [`Context`](crate::Context).
pub fn suits_wide_vectors(scene: &Scene, settings: &RenderSettings) -> bool {
    is_long(scene, settings) && WideVectors::of_machine().is_some_and(|machine| pays(scene, settings, machine))
}

fn is_long(scene: &Scene, settings: &RenderSettings) -> bool {
    f64::from(scene.film.width) * f64::from(scene.film.height) * f64::from(settings.samples) >= LONG_RENDERING
}

/// Whether they pay in a long rendering: without a hierarchy, and with a large one on some CPUs if the driver skips branches that no
/// lane takes. One that executes them takes 1.0 to 2.7 times as long with a hierarchy, and without one 1.6 to 3.6 times where lanes
/// share paths, which they exchange in one instruction if they are eight; where they do not share them .83 to .92 (22.3.6).
fn pays(scene: &Scene, settings: &RenderSettings, machine: WideVectors) -> bool {
    let needed = Features::of(scene, settings);
    if needed.tree {
        let is_large = scene.triangle_count() + scene.spheres.len() >= LARGE_TREE;
        is_large && machine.skip_branches && (machine.suit_walks || has_large_glass(&needed, scene))
    } else {
        machine.skip_branches || !needed.can_reuse() || settings.reuse == Reuse::Off
    }
}

/// Whether most rays may be within large meshes of glass, where wide vectors pay on other CPUs too. (Lamps light them by beams,
/// which do not gain.)
fn has_large_glass(needed: &Features, scene: &Scene) -> bool {
    needed.dielectric && !needed.emitter && glass_triangles(scene).count() >= LARGE_TREE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::generate::terrain;
    use crate::check::scenes::room;
    use crate::scene::Surface;

    const OLD: WideVectors = WideVectors { skip_branches: false, suit_walks: true };
    const NEW: WideVectors = WideVectors { skip_branches: true, suit_walks: false };

    #[test]
    fn rooms_whose_paths_are_shared_want_a_driver_that_skips_branches() {
        let scene = room();
        let settings = RenderSettings::of(&scene);
        assert_eq!([OLD, NEW].map(|machine| pays(&scene, &settings, machine)), [false, true]);
        let settings = RenderSettings { reuse: Reuse::Off, ..settings };
        assert_eq!([OLD, NEW].map(|machine| pays(&scene, &settings, machine)), [true, true]);
        let mut scene = scene;
        scene.integrator.max_depth = 1;
        assert!(pays(&scene, &RenderSettings::of(&scene), OLD));
    }

    #[test]
    fn large_meshes_want_glass_or_a_cpu_that_works_on_512_bits_at_once() {
        let both = WideVectors { skip_branches: true, suit_walks: true };
        let pay = |scene: &Scene| [OLD, NEW, both].map(|machine| pays(scene, &RenderSettings::of(scene), machine));
        let mut scene = terrain(100_000);
        assert_eq!(pay(&scene), [false, false, true]);
        assert_eq!(pay(&terrain(10_000)), [false; 3]);
        scene.materials.iter_mut().for_each(|material| material.surface = Surface::dielectric(1.5));
        assert_eq!(pay(&scene), [false, true, true]);
    }

    #[test]
    fn short_renderings_do_not_wait_for_a_longer_compilation() {
        let mut scene = room();
        (scene.film.width, scene.film.height) = (256, 256);
        let long = |samples| is_long(&scene, &RenderSettings { samples, ..RenderSettings::of(&scene) });
        assert_eq!([16, 64].map(long), [false, true]);
    }
}
