//! Images from gradients: what the groups of pixels that they need must not cost.

use glam::DVec3;
use photolith::render::{Gradients, Reuse, SampleMap};
use photolith::scene::{Material, Mesh, Normals, PixelFilter, Surface};
use photolith::{RenderSettings, Scene};

use crate::harness::{context, render_counted, shipped};

/// A fence in front of a bright sky, nearly black: how bright a pixel is depends on how much of it the fence covers.
fn fence() -> Scene {
    let mut scene = shipped("direct", (48, 48), 16);
    scene.film.filter = PixelFilter::Box;
    (scene.integrator.max_depth, scene.integrator.indirect) = (3, true);
    scene.background = [1.0; 3];
    scene.lights.clear();
    scene.spheres.clear();
    scene.materials = vec![Material::new("paint", Surface::diffuse([0.02; 3]))];
    let corner = |i: u32, right: bool, up: bool| {
        let x = f64::from(i) + if right { 0.4 } else { 0.0 } + if up { 2.5 } else { 0.0 };
        DVec3::new(x - 31.5, if up { 40.0 } else { -40.0 }, 0.0)
    };
    let slats = 60;
    scene.meshes = vec![Mesh {
        name: "fence".to_owned(),
        positions: (0..slats)
            .flat_map(|i| [(false, false), (true, false), (true, true), (false, true)].map(|(r, u)| corner(i, r, u)))
            .collect(),
        vertex_normals: Vec::new(),
        triangles: (0..slats).flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]).collect(),
        triangle_materials: vec![0; 2 * slats as usize],
        normals: Normals::Flat,
        ..Mesh::default()
    }];
    scene
}

/// When groups move, the rest of a pixel's samples fills the gaps that the first ones have left in it.
#[test]
fn places_in_pixels_are_spread_over_all_samples() {
    let context = context();
    let scene = fence();
    let variance = |gradients: Gradients| {
        let images: Vec<Vec<f64>> = (0..12)
            .map(|seed| {
                let settings = RenderSettings {
                    seed,
                    gradients,
                    reuse: Reuse::Always,
                    sample_map: SampleMap::Off,
                    ..RenderSettings::of(&scene)
                };
                let (film, statistics) = render_counted(&context, &scene, &settings);
                assert_eq!(statistics.gradients, gradients == Gradients::Auto);
                film.mean().iter().map(|pixel| f64::from(pixel[1])).collect()
            })
            .collect();
        let count = images.len() as f64;
        let of_pixel = |p: usize| {
            let mean = images.iter().map(|image| image[p]).sum::<f64>() / count;
            images.iter().map(|image| (image[p] - mean).powi(2)).sum::<f64>() / (count - 1.0)
        };
        (0..images[0].len()).map(of_pixel).sum::<f64>() / images[0].len() as f64
    };
    let [with, without] = [Gradients::Auto, Gradients::Off].map(variance);
    println!("variance {with:e} with gradients, {without:e} without");
    assert!(without > 1e-5 && with < 1.15 * without, "{with:e} with gradients, {without:e} without");
}
