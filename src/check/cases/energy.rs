//! Scenes whose radiance is known in closed form.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::check::probe::{PathInput, RayInput};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, emitter, empty, glass, icosphere, mirror, v};
use crate::check::statistics::{mean_and_error, relative, welch, worst, z_score};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::render::{RenderSettings, Reuse};
use crate::scene::{Normals, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "energy/sphere-centre",
        what: "closed diffuse sphere, light at the centre, depths 1, 8 and 20, every pixel",
        oracle: "Φρ/(4π²R²)·(1−ρ^D)/(1−ρ), without variance",
        quantity: "worst relative error over D",
        threshold: 1e-6,
        full_only: false,
        measure: |lab| sphere_centre(lab, Reuse::Off),
    },
    Case {
        name: "energy/sphere-centre-shared",
        what: "the same, where paths serve several pixels",
        oracle: "the same: all points of a sphere see each other alike, so that each pixel gets an eighth of each path",
        quantity: "worst relative error over D: of distances between points close to each other",
        threshold: 1e-4,
        full_only: false,
        measure: |lab| sphere_centre(lab, Reuse::Always),
    },
    Case {
        name: "energy/sphere-1000-bounces",
        what: "the same of single paths, reflectance 1, depth 1000",
        oracle: "linear in the depth",
        quantity: "worst relative error",
        threshold: 1e-4,
        full_only: false,
        measure: thousand_bounces,
    },
    Case {
        name: "energy/sphere-off-centre",
        what: "closed diffuse sphere, light off centre, depth 8",
        oracle: "direct light and the sphere's constant indirect light",
        quantity: "deviation of the mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: sphere_off_centre,
    },
    Case {
        name: "energy/black",
        what: "a room of reflectance 0, depth 8",
        oracle: "exactly 0",
        quantity: "largest radiance",
        threshold: 0.0,
        full_only: false,
        measure: black,
    },
    Case {
        name: "energy/convex-body",
        what: "a sphere, a box and a tessellated sphere of reflectance 0.75 under a sky of radiance 1",
        oracle: "exactly the reflectance",
        quantity: "worst relative error of a pixel",
        threshold: 1e-6,
        full_only: false,
        measure: convex_body,
    },
    Case {
        name: "energy/furnace",
        what: "mirrors and glass of reflectance 1 under a sky of radiance 1",
        oracle: "1",
        quantity: "worst error of a pixel",
        threshold: 1e-5,
        full_only: false,
        measure: furnace,
    },
    Case {
        name: "energy/low-poly",
        what: "mirrors and glass of a few triangles with smooth normals, a tetrahedron among them, under a sky of radiance 1",
        oracle: "1",
        quantity: "worst error of an image's mean (some light stays within glass for longer than 256 hits)",
        threshold: 1e-3,
        full_only: false,
        measure: low_poly,
    },
    Case {
        name: "energy/plates",
        what: "floor and ceiling of reflectance ρ1, ρ2 between perfect mirrors, light in the middle",
        oracle: "B1 = E (1 + ρ2)/(1 − ρ1ρ2)",
        quantity: "deviation of the mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: plates,
    },
    Case {
        name: "energy/mirror-corridor",
        what: "up to 60 reflections between mirrors of reflectance 0.9, then an emitter",
        oracle: "the unfolded path: 0.9ⁿ, and its length",
        quantity: "worst relative error",
        threshold: 2e-5,
        full_only: false,
        measure: corridor,
    },
    Case {
        name: "energy/roulette",
        what: "a room with Russian roulette from hit 2",
        oracle: "the room without",
        quantity: "deviation of the mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: roulette,
    },
];

/// The inside of a sphere of radius 2 with a light, seen from off centre.
fn shell(reflectance: f64, depth: u32, light: DVec3) -> Scene {
    let mut scene = empty();
    scene.camera.position = v(0.5, 0.25, 0.75);
    scene.camera.target = v(0.0, 0.25, -1.0);
    scene.sphere(DVec3::ZERO, 2.0, diffuse(reflectance));
    scene.light(light, 100.0);
    scene.integrator.max_depth = depth;
    scene
}

fn sphere_centre(lab: &Lab, reuse: Reuse) -> Result<Measured, CheckError> {
    let mut off = 0.0;
    for depth in [1, 8, 20] {
        let rho: f64 = 0.75;
        let scene = shell(rho, depth, DVec3::ZERO);
        let image = lab.render_with(&scene, &RenderSettings { reuse, ..lab.settings(&scene) })?;
        let bounces = (1.0 - rho.powi(depth as i32)) / (1.0 - rho);
        let exact = 100.0 * rho / (4.0 * PI * PI * 4.0) * bounces;
        off = worst(image.channel(0).iter().map(|x| relative(*x, exact) / f64::from(depth)).chain([off]));
    }
    Ok(Measured::new(off, "3 × 256 pixels, 16 samples"))
}

fn thousand_bounces(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = shell(1.0, 1000, DVec3::ZERO);
    scene.size(16, lab.size(2, 64) as u32);
    // Shared, all of this light would have weights from the distances of hits, some of which are close to each other: right in the
    // mean, but in single precision.
    let image = lab.render_with(&scene, &independent_pixels(lab, &scene))?;
    let exact = 100.0 / (4.0 * PI * PI * 4.0) * 1000.0;
    Ok(Measured::new(worst(image.channel(1).iter().map(|x| relative(*x, exact))), "256 pixels"))
}

/// Pixels that reuse each other's paths have noise in common, and the error of their mean is not that of their spread.
fn independent_pixels(lab: &Lab, scene: &Scene) -> RenderSettings {
    RenderSettings { reuse: Reuse::Off, ..lab.settings(scene) }
}

fn sphere_off_centre(lab: &Lab) -> Result<Measured, CheckError> {
    let (rho, depth, light): (f64, u32, _) = (0.75, 8, v(-0.5, 0.75, -0.25));
    let mut scene = shell(rho, depth, light);
    scene.size(32, lab.size(64, 4096) as u32);
    let image = lab.render_with(&scene, &independent_pixels(lab, &scene))?.channel(0);
    // A sphere lights itself evenly: each bounce adds the mean irradiance Φ/(4πR²) times ρ.
    let mean_irradiance = 100.0 / (4.0 * PI * 4.0);
    let indirect = mean_irradiance * rho * (1.0 - rho.powi(depth as i32 - 1)) / (1.0 - rho);
    let sides = 8;
    let difference: Vec<f64> = (0..image.len())
        .map(|i| {
            let (x, y) = (i % 32, i / 32);
            let mut direct = 0.0;
            for k in 0..sides * sides {
                let at = |p: usize, q: usize| p as f64 + (q as f64 + 0.5) / sides as f64;
                let film = glam::DVec2::new(at(x, k % sides), at(y, k / sides));
                let ray = crate::oracle::primary_ray(&scene, film, glam::DVec2::ZERO);
                let b = ray.origin.dot(ray.direction);
                let t = -b + (b * b - ray.origin.length_squared() + 4.0).sqrt();
                let p = ray.origin + t * ray.direction;
                let to = light - p;
                direct += 100.0 * to.dot(-p / 2.0) / (4.0 * PI * to.length().powi(3));
            }
            image[i] - rho / PI * (direct / (sides * sides) as f64 + indirect)
        })
        .collect();
    let (bias, error) = mean_and_error(&difference);
    let mean = image.iter().sum::<f64>() / image.len() as f64;
    let detail = format!("bias {:+.1e} ± {:.1e} relative", bias / mean, error / mean);
    Ok(Measured::new(bias.abs() / error, detail))
}

fn black(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = shell(0.0, 8, DVec3::ZERO);
    scene.sphere(v(0.0, 0.25, -1.0), 0.25, diffuse(0.0));
    scene.cuboid(v(-1.0, -1.0, -1.0), v(-0.5, -0.5, -0.5), diffuse(0.0));
    scene.size(16, 64);
    let image = lab.render(&scene)?;
    Ok(Measured::new(worst(image.channel(0)), "256 pixels"))
}

fn convex_body(lab: &Lab) -> Result<Measured, CheckError> {
    let mut off = 0.0;
    for body in 0..3 {
        let mut scene = empty();
        scene.background = [1.0; 3];
        scene.camera.horizontal_fov = 10.0;
        let center = v(0.25, -0.125, -4.0);
        match body {
            0 => scene.sphere(center, 1.5, diffuse(0.75)),
            1 => {
                scene.camera.position = v(3.0, 3.0, 3.0);
                scene.camera.target = DVec3::ZERO;
                scene.cuboid(v(-1.0, -1.0, -1.0), v(1.0, 1.0, 1.0), diffuse(0.75));
            }
            _ => {
                let (positions, triangles) = icosphere(center, 1.5, 3);
                scene.mesh(&positions, &triangles, diffuse(0.75));
            }
        }
        scene.size(16, lab.size(64, 4096) as u32);
        let image = lab.render(&scene)?;
        off = worst(image.channel(0).iter().map(|x| relative(*x, 0.75)).chain([off]));
    }
    Ok(Measured::new(off, "3 bodies, 256 pixels"))
}

fn furnace(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = empty();
    scene.background = [1.0; 3];
    // Light that grazes glass stays in it long: of n such samples some n/depth² are lost, one of 10⁶ with 256 hits.
    scene.integrator.max_depth = lab.size(256, 16_384) as u32;
    scene.sphere(v(-1.0, 0.0, -5.0), 1.0, mirror(1.0));
    scene.sphere(v(1.0, 0.5, -5.0), 1.0, glass(1.5));
    scene.sphere(v(0.0, -1.5, -5.0), 0.75, glass(1.1));
    let (positions, triangles) = icosphere(v(0.0, 1.5, -5.0), 0.5, 2);
    scene.mesh(&positions, &triangles, mirror(1.0));
    scene.cuboid(v(1.5, -2.0, -6.0), v(2.5, -1.0, -5.0), glass(1.3));
    scene.size(32, lab.size(16, 1024) as u32);
    let image = lab.render(&scene)?;
    Ok(Measured::new(worst(image.channel(2).iter().map(|x| (x - 1.0).abs())), "1024 pixels"))
}

fn low_poly(lab: &Lab) -> Result<Measured, CheckError> {
    let tetrahedron = (
        vec![v(1.0, 1.0, 1.0), v(1.0, -1.0, -1.0), v(-1.0, 1.0, -1.0), v(-1.0, -1.0, 1.0)],
        vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    );
    let meshes = [tetrahedron, icosphere(DVec3::ZERO, 1.0, 0), icosphere(DVec3::ZERO, 1.0, 1)];
    let mut off = 0.0;
    for (positions, triangles) in meshes {
        for surface in [mirror(1.0), glass(1.5), glass(1.0 / 1.5)] {
            let mut scene = empty();
            scene.background = [1.0; 3];
            scene.camera.position = v(0.5, 0.25, 4.0);
            scene.camera.target = DVec3::ZERO;
            scene.camera.horizontal_fov = 40.0;
            scene.integrator.max_depth = 256;
            let mesh = scene.mesh(&positions, &triangles, surface);
            mesh.normals = Normals::Smooth;
            mesh.vertex_normals = positions.iter().map(|p| p.normalize()).collect();
            scene.size(16, lab.size(16, 256) as u32);
            off = worst([off, (lab.render(&scene)?.mean()[1] - 1.0).abs()]);
        }
    }
    Ok(Measured::new(off, "9 × 256 pixels"))
}

fn plates(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(14);
    let (rho1, rho2) = (0.5, 0.8);
    let mut scene = empty();
    let corner = |x: f64, y: f64, z: f64| v(x, y, z);
    let side = |a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]| [a, b, c, d].map(|p| corner(p[0], p[1], p[2]));
    let (p, m) = (1.0, -1.0);
    scene.quad(side([m, m, m], [p, m, m], [p, m, p], [m, m, p]), diffuse(rho1));
    scene.quad(side([m, p, m], [p, p, m], [p, p, p], [m, p, p]), diffuse(rho2));
    scene.quad(side([m, m, m], [m, p, m], [m, p, p], [m, m, p]), mirror(1.0));
    scene.quad(side([p, m, m], [p, p, m], [p, p, p], [p, m, p]), mirror(1.0));
    scene.quad(side([m, m, m], [p, m, m], [p, p, m], [m, p, m]), mirror(1.0));
    scene.quad(side([m, m, p], [p, m, p], [p, p, p], [m, p, p]), mirror(1.0));
    scene.light(DVec3::ZERO, 12.0);
    scene.integrator.max_depth = 128;
    scene.camera.position = v(0.0, 0.25, 0.0);
    scene.camera.target = v(0.0, -1.0, 0.01);
    let origin = scene.camera.position;
    // Each sixth of the light goes to a face; what meets the mirrors directly is not followed (no caustics). Power is
    // conserved between the plates, so that the floor receives Φ/6·(1 + ρ2)/(1 − ρ1ρ2).
    let scale = lab.scatter(&scene)?.scale();
    let paths: Vec<_> = (0..lab.size(1 << 15, 1 << 20))
        .map(|i| {
            // Points of the floor, uniform in area.
            let target = v(rng.between(-1.0, 1.0), -1.0, rng.between(-1.0, 1.0)) - origin;
            let ray = RayInput::new(Vec3::ZERO, (scale * target).normalize().as_vec3());
            PathInput::new(ray, rng.bits() & 4095, i as u32)
        })
        .collect();
    let radiance: Vec<f64> = lab.radiance(&scene, &paths)?.iter().map(|r| r.x).collect();
    let incident = 12.0 / 6.0 * (1.0 + rho2) / (1.0 - rho1 * rho2);
    let exact = rho1 * incident / (4.0 * PI);
    let (mean, error) = mean_and_error(&radiance);
    let detail = format!("{mean:.5} ± {error:.1e}, exact {exact:.5}");
    Ok(Measured::new(z_score(&radiance, exact), detail))
}

fn corridor(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = empty();
    let end = 64.0;
    for x in [-1.0, 1.0] {
        scene.quad([v(x, -9.0, 1.0), v(x, 9.0, 1.0), v(x, 9.0, -end), v(x, -9.0, -end)], mirror(0.9));
    }
    scene.quad([v(-1.0, -9.0, -end), v(1.0, -9.0, -end), v(1.0, 9.0, -end), v(-1.0, 9.0, -end)], emitter(1.0));
    scene.integrator.max_depth = 200;
    let mut rng = Rng::new(15);
    let mut probe = lab.scatter(&scene)?;
    let scale = probe.scale();
    let mut paths: Vec<_> = (0..lab.size(1 << 11, 1 << 18))
        .map(|i| {
            let d = v(rng.between(-1.9, 1.9), rng.between(-0.1, 0.1), -1.0).normalize().as_vec3();
            PathInput::new(RayInput::new(Vec3::ZERO, d), 0, i as u32)
        })
        .collect();
    let starts: Vec<DVec3> = paths.iter().map(|p| DVec3::from(p.ray.direction.map(f64::from))).collect();
    let (mut length, mut ends) = (vec![0.0; paths.len()], vec![None; paths.len()]);
    let mut alive: Vec<usize> = (0..paths.len()).collect();
    for hits in 0..200 {
        let inputs: Vec<_> = alive.iter().map(|&i| paths[i]).collect();
        let records = probe.run(&inputs)?;
        let mut next = Vec::new();
        for (&i, record) in alive.iter().zip(&records) {
            length[i] += f64::from(record.t) / scale;
            if record.alive != 0 {
                paths[i] = record.next(&paths[i]);
                next.push(i);
            } else {
                ends[i] = Some((hits, f64::from(record.radiance[0])));
            }
        }
        alive = next;
    }
    let mut errors = Vec::new();
    let mut most = 0;
    for ((d, length), end_of) in starts.iter().zip(&length).zip(&ends) {
        let t = end / -d.z;
        let x = t * d.x;
        // Unfolded, a mirror stands at every odd x.
        let n = ((x.abs() + 1.0) / 2.0).floor();
        if ((x.abs() + 1.0) / 2.0 - n - 0.5).abs() > 0.499 {
            continue;
        }
        most = most.max(n as u32);
        let Some((hits, radiance)) = *end_of else {
            errors.push(f64::INFINITY);
            continue;
        };
        errors.push(relative(*length, t * d.length()));
        errors.push(if f64::from(hits) == n { relative(radiance, 0.9f64.powf(n)) } else { f64::INFINITY });
    }
    Ok(Measured::new(worst(errors), format!("{} paths, up to {most} reflections", starts.len())))
}

fn roulette(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = crate::check::scenes::room();
    scene.size(32, lab.size(128, 4096) as u32);
    let without = lab.render_with(&scene, &independent_pixels(lab, &scene))?.channel(0);
    scene.integrator.russian_roulette = Some(2);
    let settings = RenderSettings { seed: 1, ..independent_pixels(lab, &scene) };
    let with = lab.render_with(&scene, &settings)?.channel(0);
    let difference: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
    let (bias, error) = mean_and_error(&difference);
    let mean = without.iter().sum::<f64>() / without.len() as f64;
    let detail = format!("bias {:+.1e} ± {:.1e} relative", bias / mean, error / mean);
    Ok(Measured::new(welch(&difference, &[0.0, 0.0]), detail))
}
