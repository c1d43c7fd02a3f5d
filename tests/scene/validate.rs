//! `Scene::validate`: scenes that are built in code, with one thing wrong each.

use glam::DVec3;
use photolith::scene::{Light, Normals, Surface, Transfer};
use photolith::{Context, RenderError, RenderSettings, Renderer, Scene, Validation};

use crate::common::context_options;

fn good() -> Scene {
    let obj = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1\n";
    let mut scene = Scene::from_obj_bytes(obj, "code", None).unwrap().scene;
    let ball = photolith::scene::Sphere { center: DVec3::ZERO, radius: 1.0, material: 0, inward: false };
    scene.spheres = vec![ball];
    scene
}

#[test]
fn each_broken_invariant_is_found() {
    assert!(good().validate().is_ok());
    type Break = fn(&mut Scene);
    let cases: [(Break, &str); 27] = [
        (|s| s.camera.target = s.camera.position, "camera: target is"),
        (|s| s.camera.horizontal_fov = 180.0, "camera: horizontal_fov is 180"),
        (|s| s.camera.up = (s.camera.target - s.camera.position) * -7.0, "camera: up is"),
        (|s| s.camera.up = DVec3::NAN, "camera: up is [NaN, NaN, NaN]"),
        (|s| s.film.width = 0, "film: width is 0"),
        (|s| s.film.height = 65_537, "film: height is 65537"),
        (|s| s.film.transfer = Transfer::Gamma(-1.0), "film: gamma is -1"),
        (|s| s.integrator.max_depth = 0, "integrator: max_depth is 0"),
        (|s| s.integrator.samples = 0, "integrator: samples is 0"),
        (|s| s.integrator.russian_roulette = Some(0), "integrator: russian_roulette is 0"),
        (|s| s.background[1] = -1.0, "background: radiance is [0, -1, 0]"),
        (|s| s.materials.push(s.materials[0].clone()), "material 2: name is \"default grey\""),
        (|s| s.materials[0].surface = Surface::dielectric(0.0), "material 1: ior is 0"),
        (
            |s| s.materials[0].surface = Surface::dielectric(1e-50),
            "material 1: ior is 1e-50, expected a number from 0.001 to 1000",
        ),
        (|s| s.spheres[0].radius = f64::INFINITY, "sphere 1: radius is inf"),
        (|s| s.spheres[0].material = 1, "sphere 1: material is 1, expected an index below 1"),
        (|s| s.meshes[0].positions[1].x = f64::NAN, "mesh 1: vertex 2 is [NaN, 0, 0]"),
        (|s| s.meshes[0].positions[1].x = 1e31, "mesh 1: vertex 2 is [1e31, 0, 0]"),
        (|s| s.meshes[0].vertex_normals[2] *= 2.0, "mesh 1: vertex normal 3 is [0, 0, 2]"),
        (|s| s.meshes[0].vertex_normals.truncate(2), "mesh 1: the number of vertex normals is 2, expected 3"),
        (|s| s.meshes[0].normals = Normals::Flat, "mesh 1: the number of vertex normals is 3, expected 0"),
        (|s| s.meshes[0].triangles[0] = [0, 1, 3], "mesh 1: triangle 1 is [0, 1, 3], expected indices below 3"),
        (|s| s.meshes[0].triangles[0] = [0, 1, 1], "mesh 1: triangle 1 is [0, 1, 1], expected a triangle with an area"),
        (|s| s.meshes[0].triangle_materials[0] = 9, "mesh 1: material is 9, expected an index below 1"),
        (|s| s.meshes[0].triangle_materials.clear(), "mesh 1: the number of triangle materials is 0, expected 1"),
        (
            |s| s.lights.push(Light::Point { position: DVec3::ZERO, power: [0.0, 0.0, -1.0] }),
            "light 1: power is [0, 0, -1]",
        ),
        (
            |s| {
                s.spheres.clear();
                s.meshes.clear();
            },
            "empty scene",
        ),
    ];
    for (break_it, words) in cases {
        let mut scene = good();
        break_it(&mut scene);
        let message = scene.validate().expect_err(words).to_string();
        assert!(message.starts_with(&format!("code: {words}")), "{message:?} should have {words:?}");
    }
}

#[test]
fn a_renderer_is_not_made_of_such_a_scene() {
    let context = Context::new(&context_options(Validation::Core)).expect("a Vulkan device and validation layers");
    let scene = good();
    assert!(Renderer::new(&context, &scene, &RenderSettings::of(&scene)).is_ok());
    for spoil in [
        (|s| s.spheres[0].radius = f64::NAN) as fn(&mut Scene),
        |s| s.film.width = 0,
        |s| s.materials.clear(),
        |s| s.camera.target = s.camera.position,
    ] {
        let mut scene = good();
        spoil(&mut scene);
        let refused = Renderer::new(&context, &scene, &RenderSettings::of(&scene)).err();
        assert!(matches!(refused, Some(RenderError::Scene(_))), "{refused:?}");
    }
    assert_eq!(context.messages().all(), Vec::<String>::new());
}
