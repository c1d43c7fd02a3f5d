//! What the camera sees first, against the oracle.

use glam::{DVec2, DVec3};
use photolith::oracle::trace::closest_hit;
use photolith::oracle::{Hit, primary_ray};
use photolith::render::{SampleMap, SeenSurface};
use photolith::scene::{Bsdf, Lens};
use photolith::{RenderSettings, Renderer, Scene};

use crate::harness::{context, render, shipped};

fn seen(scene: &Scene, settings: &RenderSettings) -> Vec<Option<SeenSurface>> {
    let context = context();
    let mut renderer = Renderer::new(&context, scene, settings).expect("a renderer");
    renderer.seen_surfaces().expect("what is seen")
}

/// Whether both are the same surface at the same place.
fn agree(scene: &Scene, seen: &SeenSurface, hit: &Hit) -> bool {
    let camera = &scene.camera;
    let forward = (camera.target - camera.position).normalize();
    let scale = 1e-5 * (1.0 + hit.position.length() + hit.position.distance(camera.position));
    let near = |a: [f32; 3], b: DVec3| DVec3::from(a.map(f64::from)).distance(b) < 2e-3;
    let albedo = match hit.surface.bsdf {
        Bsdf::Diffuse { reflectance } | Bsdf::Mirror { reflectance } => Some(DVec3::from(reflectance)),
        Bsdf::Dielectric { .. } => Some(DVec3::ONE),
        Bsdf::Black => Some(DVec3::ZERO),
        _ => None,
    };
    seen.material as usize == hit.material
        && seen.position.distance(hit.position) < scale
        && (seen.depth - (hit.position - camera.position).dot(forward)).abs() < scale
        && near(seen.normal, hit.normal)
        && near(seen.shading_normal, hit.shading_normal)
        && albedo.is_none_or(|albedo| near(seen.albedo, albedo))
}

fn assert_seen(scene: &Scene, what: &str) {
    let (width, height) = (scene.film.width as usize, scene.film.height as usize);
    let found = seen(scene, &RenderSettings::of(scene));
    assert_eq!(found.len(), width * height, "{what}");
    let expected: Vec<_> = (0..width * height)
        .map(|pixel| {
            let center = DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
            closest_hit(scene, &primary_ray(scene, center, DVec2::ZERO))
        })
        .collect();
    let same = found.iter().zip(&expected).filter(|pair| match pair {
        (Some(seen), Some(hit)) => agree(scene, seen, hit),
        (None, None) => true,
        _ => false,
    });
    // Rays at edges may meet either side.
    let (same, all) = (same.count(), width * height);
    assert!(same + 2 >= all, "{what}: {same} of {all}");
    assert!(found.iter().flatten().count() > all / 10, "{what}: hardly anything is seen");
}

#[test]
fn surfaces_are_those_of_the_oracle() {
    for name in ["spheres", "glass", "cornell", "cat"] {
        assert_seen(&shipped(name, (32, 24), 1), name);
    }
}

#[test]
fn every_camera_sees_them() {
    let mut scene = shipped("cornell", (30, 20), 1);
    scene.camera.lens = Some(Lens { radius: 0.2, focus: 3.0 });
    assert_seen(&scene, "a lens");
    scene.camera.lens = None;
    scene.camera.orthographic_width = Some(2.5);
    assert_seen(&scene, "parallel rays");
    scene.camera.lens = Some(Lens { radius: 0.1, focus: 3.0 });
    assert_seen(&scene, "parallel rays and a lens");
}

#[test]
fn to_look_changes_no_bit() {
    let scene = shipped("cornell", (40, 30), 4);
    let settings = RenderSettings { sample_map: SampleMap::Auto, ..RenderSettings::of(&scene) };
    let context = context();
    let expected = render(&context, &scene, &settings);
    let mut renderer = Renderer::new(&context, &scene, &settings).expect("a renderer");
    let before = renderer.seen_surfaces().expect("what is seen");
    let film = renderer.render(|_| std::ops::ControlFlow::Continue(())).expect("a film");
    assert!(film == expected);
    assert!(renderer.seen_surfaces().expect("what is seen") == before);
}
