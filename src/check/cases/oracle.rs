//! Whole images against the path tracer in double precision.

use crate::check::scenes::{
    Build, diffuse, divided_room, emitter, emitters, empty, glass, icosphere, mirror, room, screened_room, v,
};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::oracle;
use crate::oracle::OracleSettings;
use crate::render::{RenderSettings, Reuse, Scheduler};
use crate::scene::{Bsdf, MetallicRoughness, Normals, PixelFilter, Scene, Surface};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "oracle/room",
        what: "walls, mirror, glass, a box and a light, depth 6",
        oracle: "path tracer in f64",
        quantity: "worst deviation in standard errors, over channels, blocks of 8×8 and the mean, over what α = 1e-4 allows",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &room()),
    },
    Case {
        name: "oracle/nested-glass",
        what: "glass in glass, touching glass spheres, a hollow sphere, emitters and a sky",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &nested_glass()),
    },
    Case {
        name: "oracle/smooth-mesh",
        what: "smooth meshes, diffuse, mirror and glass, under a sky",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &smooth_mesh()),
    },
    Case {
        name: "oracle/emitters",
        what: "a room with emitters that are spheres, polygons and a mesh, some of which touch what they light",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &emitters()),
    },
    Case {
        name: "oracle/emitters-across",
        what: "spheres around and across emitters, one of them the room: what is on the other side of a surface lights nothing",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &emitters_across()),
    },
    Case {
        name: "oracle/reused-paths",
        what: "a body, many balls, a screen and a mirror in a room: paths serve pixels that may not see their second hits",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle_with(lab, &divided_room(), Reuse::Always, Scheduler::Queue),
    },
    Case {
        name: "oracle/reused-lanes",
        what: "the same room without a BVH: paths meet in the lanes of a subgroup",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle_with(lab, &screened_room(), Reuse::Always, Scheduler::Inline),
    },
    Case {
        name: "oracle/reused-emitters",
        what: "the room with emitters, a mirror and glass: paths are shared, also behind mirrors, and emitters sampled alike",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle_with(lab, &emitters(), Reuse::Always, Scheduler::Auto),
    },
    Case {
        name: "oracle/reused-rough",
        what: "the same with metals and varnish in place of mirror and glass, and on the floor: what cannot be shared is seen first",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle_with(lab, &rough_emitters(), Reuse::Always, Scheduler::Auto),
    },
    Case {
        name: "oracle/caustics",
        what: "emitters before, beside and within glass and mirrors of spheres and meshes: paths and light paths share their light",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &caustics()),
    },
    Case {
        name: "oracle/caustics-within",
        what: "a camera and a body within glass, and a mirror: light comes from another medium; Gaussian filter",
        oracle: "path tracer in f64",
        quantity: "the same",
        threshold: 1.0,
        full_only: false,
        measure: |lab| against_oracle(lab, &within_glass()),
    },
];

/// A spherical room with emitters that opaque spheres hide or cut.
fn emitters_across() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 4;
    scene.sphere(v(0.0, 0.0, -5.0), 7.0, diffuse(0.5));
    // Across the wall, and outside of it.
    scene.sphere(v(0.0, 7.5, -5.0), 1.5, emitter(4.0));
    scene.sphere(v(-9.5, 0.0, -5.0), 2.0, emitter(50.0));
    // Half in a ball, within one, and a flat one through one.
    scene.sphere(v(0.0, -104.0, -6.0), 101.0, diffuse(0.75));
    scene.sphere(v(-1.5, -3.0, -5.0), 0.75, emitter(3.0));
    scene.sphere(v(2.0, -1.5, -6.0), 1.25, diffuse(0.625));
    scene.sphere(v(2.0, -0.75, -6.0), 0.375, emitter(100.0));
    scene.sphere(v(-1.0, 1.0, -7.0), 1.0, mirror(0.875));
    scene.quad([v(-1.75, 1.0, -8.0), v(-0.25, 1.0, -8.0), v(-0.25, 1.0, -5.25), v(-1.75, 1.0, -5.25)], emitter(2.0));
    scene
}

/// The room of emitters with rough surfaces.
fn rough_emitters() -> Scene {
    let mut scene = emitters();
    let rough = |metallic: f64, roughness: f64| {
        let base_color = [0.9, 0.7, 0.5];
        Bsdf::MetallicRoughness(MetallicRoughness { base_color, metallic, roughness, ..MetallicRoughness::default() })
    };
    for material in &mut scene.materials {
        match &mut material.surface.bsdf {
            bsdf @ Bsdf::Dielectric { .. } => *bsdf = rough(1.0, 0.3),
            bsdf @ Bsdf::Mirror { .. } => *bsdf = rough(0.0, 0.4),
            _ => {}
        }
    }
    let floor = [v(-2.5, -1.9, -7.5), v(-2.5, -1.9, -3.0), v(2.5, -1.9, -3.0), v(2.5, -1.9, -7.5)];
    scene.quad(floor, Surface { bsdf: rough(0.0, 0.5), ..diffuse(0.0) });
    scene
}

/// A room whose light comes by way of glass and mirrors, with a BVH.
fn caustics() -> Scene {
    let mut scene = empty();
    scene.integrator.max_depth = 6;
    scene.cuboid(v(-3.0, -2.0, -8.0), v(3.0, 2.5, 2.0), diffuse(0.5));
    scene.quad([v(-1.5, 2.25, -6.5), v(1.5, 2.25, -6.5), v(1.5, 2.25, -3.5), v(-1.5, 2.25, -3.5)], emitter(3.0));
    // An emitter within glass, and one that a target reaches behind.
    scene.sphere(v(-1.5, -1.25, -5.0), 0.75, glass(1.5));
    scene.sphere(v(-1.5, -1.25, -5.0), 0.5, emitter(2.0));
    scene.quad([v(2.25, -0.5, -6.0), v(2.25, -0.5, -4.5), v(2.25, 1.0, -4.5), v(2.25, 1.0, -6.0)], emitter(2.0));
    scene.sphere(v(2.0, -1.25, -5.25), 0.625, mirror(0.875));
    let (positions, triangles) = icosphere(v(0.25, -1.0, -4.75), 0.75, 1);
    scene.mesh(&positions, &triangles, glass(1.5));
    let (positions, triangles) = icosphere(v(-0.25, 0.75, -6.0), 0.625, 1);
    scene.mesh(&positions, &triangles, mirror(0.9375));
    scene
}

/// What the camera sees is in glass with it, and the light is not.
fn within_glass() -> Scene {
    let mut scene = empty();
    scene.film.filter = PixelFilter::Gaussian;
    scene.integrator.max_depth = 5;
    scene.sphere(v(0.0, 0.0, -3.0), 4.0, glass(1.5));
    scene.sphere(v(0.0, -0.5, -5.0), 1.25, diffuse(0.75));
    scene.quad([v(-1.5, -2.0, -5.5), v(1.5, -2.0, -5.5), v(1.5, -2.0, -3.5), v(-1.5, -2.0, -3.5)], diffuse(0.625));
    scene.sphere(v(1.75, 0.5, -4.5), 0.5, mirror(0.875));
    scene.quad([v(-4.0, 6.0, -7.0), v(4.0, 6.0, -7.0), v(4.0, 6.0, 1.0), v(-4.0, 6.0, 1.0)], emitter(2.0));
    scene.sphere(v(-9.0, 0.0, -3.0), 3.0, emitter(1.5));
    scene
}

fn nested_glass() -> Scene {
    let mut scene = empty();
    scene.background = [0.25, 0.5, 0.75];
    scene.sphere(v(-1.2, 0.0, -6.0), 1.0, glass(1.5));
    scene.sphere(v(-1.2, 0.0, -6.0), 0.5, glass(1.2));
    // Hollow: the inner surface's normal points to its centre.
    scene.sphere(v(1.2, 0.8, -6.0), 1.0, glass(1.5));
    scene.sphere(v(1.2, 0.8, -6.0), 0.75, glass(1.5));
    if let Some(inner) = scene.spheres.last_mut() {
        inner.inward = true;
    }
    // Two that touch.
    scene.sphere(v(0.0, -1.5, -6.0), 0.5, glass(1.7));
    scene.sphere(v(1.0, -1.5, -6.0), 0.5, glass(1.7));
    scene.quad([v(-5.0, -2.0, -1.0), v(5.0, -2.0, -1.0), v(5.0, -2.0, -12.0), v(-5.0, -2.0, -12.0)], diffuse(0.75));
    scene.quad([v(-2.0, 3.0, -8.0), v(2.0, 3.0, -8.0), v(2.0, 3.0, -4.0), v(-2.0, 3.0, -4.0)], emitter(4.0));
    scene.integrator.max_depth = 10;
    scene
}

fn smooth_mesh() -> Scene {
    let mut scene = empty();
    scene.background = [1.0, 0.75, 0.5];
    scene.light(v(0.0, 4.0, -3.0), 200.0);
    for (i, surface) in [diffuse(0.75), mirror(0.875), glass(1.5)].into_iter().enumerate() {
        let center = v(-2.0 + 2.0 * i as f64, 0.0, -6.0);
        let (positions, triangles) = icosphere(center, 0.9, 1);
        let mesh = scene.mesh(&positions, &triangles, surface);
        mesh.vertex_normals = positions.iter().map(|p| (*p - center).normalize().as_vec3().as_dvec3()).collect();
        mesh.normals = Normals::Smooth;
    }
    scene.quad([v(-5.0, -1.5, -1.0), v(5.0, -1.5, -1.0), v(5.0, -1.5, -12.0), v(-5.0, -1.5, -12.0)], diffuse(0.5));
    scene
}

pub(super) fn against_oracle(lab: &Lab, scene: &Scene) -> Result<Measured, CheckError> {
    against_oracle_with(lab, scene, Reuse::Auto, Scheduler::Auto)
}

/// Renders both. The device's noise comes from independent seeds, which under a stratified sampler is not the variance
/// of its samples.
pub(super) fn against_oracle_with(
    lab: &Lab,
    scene: &Scene,
    reuse: Reuse,
    scheduler: Scheduler,
) -> Result<Measured, CheckError> {
    let mut scene = scene.clone();
    scene.size(32, lab.size(32, 512) as u32);
    let seeds = 8;
    let exact = oracle::render(&scene, &OracleSettings { samples: lab.size(96, 4096) as u32, seed: 11 });
    let mut images = Vec::new();
    for seed in 0..seeds {
        let settings = RenderSettings { seed, reuse, scheduler, ..lab.settings(&scene) };
        let image = lab.render_with(&scene, &settings)?;
        images.push([0, 1, 2].map(|c| image.channel(c)));
    }
    let (mut deviations, mut worst_block) = (Vec::new(), 0.0f64);
    for c in 0..3 {
        for block in blocks() {
            let n = block.len() as f64;
            let of_seed = |image: &[Vec<f64>; 3]| block.iter().map(|&i| image[c][i]).sum::<f64>() / n;
            let means: Vec<f64> = images.iter().map(of_seed).collect();
            let (mean, error) = crate::check::statistics::mean_and_error(&means);
            let reference = block.iter().map(|&i| exact.mean[i][c]).sum::<f64>() / n;
            let variance = block.iter().map(|&i| exact.variance_of_mean[i][c]).sum::<f64>() / (n * n);
            let total = (error * error + variance).sqrt();
            let difference = (mean - reference).abs();
            // Where nothing varies both agree to rounding.
            let floor = 1e-5 * reference.abs();
            deviations.push(if difference <= floor { 0.0 } else { difference / total });
            worst_block = worst_block.max(difference / reference.abs().max(f64::MIN_POSITIVE));
        }
    }
    // Two-sided quantile of the normal distribution, one test among all; the oracle's share of the noise dominates.
    let each = 1.0 - (1.0 - 1e-4f64).powf(1.0 / deviations.len() as f64);
    let allowed = normal_quantile(1.0 - each / 2.0);
    let worst = crate::check::statistics::worst(deviations.iter().copied());
    let detail = format!(
        "{} tests, worst {worst:.2} of {allowed:.2} standard errors, {:.1}% of a block",
        deviations.len(),
        100.0 * worst_block
    );
    Ok(Measured::new(worst / allowed, detail))
}

fn normal_quantile(p: f64) -> f64 {
    use statrs::distribution::{ContinuousCDF, Normal};
    Normal::standard().inverse_cdf(p)
}

/// The pixels of each 8×8 block of the 32×32 image, and of all of it.
fn blocks() -> Vec<Vec<usize>> {
    let mut all: Vec<Vec<usize>> = vec![(0..1024).collect()];
    for block in 0..16 {
        let (x, y) = (8 * (block % 4), 8 * (block / 4));
        all.push((0..64).map(|i| (y + i / 8) * 32 + x + i % 8).collect());
    }
    all
}
