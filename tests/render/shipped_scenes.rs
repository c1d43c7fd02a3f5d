//! Every shipped scene against the oracle, which shares no code with the shaders, by Welch's test on the mean of the
//! image and on blocks of it.

use photolith::image::metrics::{CompareOptions, Welch, compare};
use photolith::image::{Image, Variance};
use photolith::oracle::{self, OracleSettings};
use photolith::render::Mutation;
use photolith::scene::Mesh;
use photolith::{Context, RenderSettings, Scene};

use crate::harness::{SCENES, context, render, shipped};

/// Renderings with seeds of their own, from which the noise is estimated.
const BATCHES: u32 = 8;

/// Means over seeds 0..BATCHES, with the variance of each mean.
fn rendered(context: &Context, scene: &Scene, mutation: Option<Mutation>) -> Image {
    let pixels = (scene.film.width * scene.film.height) as usize;
    let (mut mean, mut squares) = (vec![[0.0f64; 3]; pixels], vec![[0.0f64; 3]; pixels]);
    for seed in 0..BATCHES {
        let film = render(context, scene, &RenderSettings { seed, mutation, ..RenderSettings::of(scene) });
        for (i, sum) in film.sums().iter().enumerate() {
            for c in 0..3 {
                // Welford's update.
                let delta = sum[c] / f64::from(film.counts()[i]) - mean[i][c];
                mean[i][c] += delta / f64::from(seed + 1);
                squares[i][c] += delta * delta * f64::from(seed) / f64::from(seed + 1);
            }
        }
    }
    let n = f64::from(BATCHES);
    let of_mean = squares.iter().map(|s| s.map(|s| (s / (n * (n - 1.0))) as f32)).collect();
    let mean = mean.iter().map(|m| m.map(|x| x as f32)).collect();
    Image::from_pixels(scene.film.width, scene.film.height, mean)
        .and_then(|image| image.with_variance(Variance { of_mean, batches: BATCHES }))
        .expect("an image")
}

fn reference(scene: &Scene, samples: u32) -> Image {
    let image = oracle::render(scene, &OracleSettings { samples, seed: 1 });
    let single = |v: &Vec<[f64; 3]>| v.iter().map(|p| p.map(|x| x as f32)).collect::<Vec<_>>();
    let variance = Variance { of_mean: single(&image.variance_of_mean), batches: samples };
    Image::from_pixels(image.width, image.height, single(&image.mean))
        .and_then(|mean| mean.with_variance(variance))
        .expect("an image")
}

fn welch(image: &Image, reference: &Image) -> Welch {
    compare(image, reference, &CompareOptions::default()).expect("comparable images").welch.expect("variances")
}

/// Fails unless the image's mean (four standard errors) and its 16×16 blocks agree with the oracle, and unless the
/// noise is so low that a global error of 1% would have been seen.
fn agrees(context: &Context, scene: &Scene, oracle_samples: u32) {
    let (image, reference) = (rendered(context, scene, None), reference(scene, oracle_samples));
    let welch = welch(&image, &reference);
    let worst = welch.mean.worst.expect("a tested mean");
    let tile = welch.tiles.worst.expect("a tested tile");
    println!("{}: mean t = {:.2}, worst of {} blocks t = {:.2}", scene.source, worst.t, welch.tiles.tests, tile.t);
    assert!(worst.t.abs() < 4.0, "{}: {worst:?}", scene.source);
    assert_eq!(welch.tiles.rejected, 0, "{}: {tile:?}", scene.source);
    let total = |image: &Image, c: usize| image.pixels().iter().map(|p| f64::from(p[c])).sum::<f64>();
    let variance = |image: &Image, c: usize| {
        image.variance().expect("a variance").of_mean.iter().map(|v| f64::from(v[c])).sum::<f64>()
    };
    for c in 0..3 {
        let error = (variance(&image, c) + variance(&reference, c)).sqrt() / total(&reference, c);
        assert!(error < 0.01 / 4.0, "{}: channel {c} has a standard error of {:.3}%", scene.source, 100.0 * error);
    }
}

/// The cat with its vertices merged on a coarse grid: few enough triangles for the oracle, which tests every one.
fn coarse(mesh: &Mesh, cell: f64) -> Mesh {
    let mut index = std::collections::HashMap::new();
    let mut positions = Vec::new();
    let merged: Vec<u32> = mesh
        .positions
        .iter()
        .map(|&p| {
            *index.entry((p / cell).round().as_ivec3()).or_insert_with(|| {
                positions.push(p);
                positions.len() as u32 - 1
            })
        })
        .collect();
    let mut seen = std::collections::HashSet::new();
    let mut triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|i| merged[i as usize])).collect();
    triangles.retain(|&[a, b, c]| {
        let mut sorted = [a, b, c];
        sorted.sort_unstable();
        a != b && b != c && c != a && seen.insert(sorted)
    });
    let triangle_materials = vec![mesh.triangle_materials[0]; triangles.len()];
    Mesh { positions, triangles, triangle_materials, ..mesh.clone() }
}

#[test]
fn scenes_agree_with_the_oracle() {
    let context = context();
    // The cat has a test of its own; antialias-1 is antialias-100 with fewer samples.
    for name in SCENES.into_iter().filter(|&name| name != "cat" && name != "antialias-1") {
        // Caustics need more samples.
        let (samples, oracle_samples) = if name == "cornell" { (256, 2048) } else { (32, 64) };
        agrees(&context, &shipped(name, (48, 48), samples), oracle_samples);
    }
}

#[test]
fn a_coarse_cat_agrees_with_the_oracle() {
    let mut scene = shipped("cat", (48, 48), 32);
    scene.meshes[0] = coarse(&scene.meshes[0], 2.4);
    let triangles = scene.triangle_count();
    assert!((150..800).contains(&triangles), "{triangles} triangles");
    scene.validate().expect("a valid scene");
    agrees(&context(), &scene, 32);
}

/// A closed emitter of triangles, once flat (held in constants) and once smooth (in the BVH), an emitter that is a sphere,
/// and two points: one light is chosen at each hit, and each shadow ray must end before the emitter that it aims at.
const EMITTERS: &str = r#"
    version = 1
    [camera]
    position = [0, 0, 6]
    target = [0, 0, 0]
    horizontal_fov = 50
    [film]
    width = 48
    height = 48
    [integrator]
    max_depth = 4
    samples = 128
    [background]
    radiance = [0.1, 0.2, 0.3]
    [[material]]
    name = "grey"
    type = "diffuse"
    reflectance = [0.7, 0.6, 0.5]
    [[material]]
    name = "emitter"
    type = "emitter"
    radiance = [4, 5, 6]
    [[sphere]]
    center = [0, -101.5, 0]
    radius = 100
    material = "grey"
    [[sphere]]
    center = [-1.8, 1, -1]
    radius = 0.6
    material = "emitter"
    [[mesh]]
    file = "emitter.obj"
    material = "emitter"
    translate = [-0.5, 0.2, 0]
    [[mesh]]
    file = "emitter.obj"
    material = "emitter"
    normals = "smooth"
    rotate = [90, 20, 0]
    translate = [1.2, 0.3, 0.5]
    [[mesh]]
    file = "emitter.obj"
    material = "grey"
    scale = 1.5
    rotate = [20, 30, 40]
    translate = [0.5, -1.2, 1]
    [[light]]
    type = "point"
    position = [3, 3, 3]
    power = [60, 50, 40]
    [[light]]
    type = "point"
    position = [-3, 2, 3]
    power = [20, 30, 40]
"#;

#[test]
fn emitters_of_every_shape_agree_with_the_oracle() {
    let folder = tempfile::tempdir().expect("a folder");
    let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(folder.path().join("emitter.obj"), tetrahedron).expect("a mesh");
    let scene = Scene::from_toml_str(EMITTERS, "emitters", Some(folder.path())).expect("a scene").scene;
    agrees(&context(), &scene, 1024);
}

/// The tests above see an error where there is one.
#[test]
fn errors_are_seen() {
    let context = context();
    for (name, mutation) in
        [("spheres", Mutation::Albedo), ("direct", Mutation::Cosine), ("glass", Mutation::SwappedIor)]
    {
        let scene = shipped(name, (48, 48), 32);
        let welch = welch(&rendered(&context, &scene, Some(mutation)), &reference(&scene, 64));
        assert!(welch.mean.rejected + welch.tiles.rejected > 0, "{name}: {mutation:?} passes");
    }
}
