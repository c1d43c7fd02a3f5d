//! Light of emitting spheres and meshes, where it is known in closed form.

use std::f64::consts::PI;

use glam::DVec3;

use crate::check::lab::Rendered;
use crate::check::probe::{Kernel, LightPoint, LightQuery, PathInput, RayInput};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, emitter, empty, glass, grid, icosphere, mirror, v};
use crate::check::statistics::{mean_and_error, worst, z_score};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::render::space::RenderSpace;
use crate::render::{RenderSettings, Renderer, SampleMap};
use crate::scene::{Scene, Surface};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "emitters/seen",
        what: "emitters (a sphere, an inward sphere, a polygon, a mesh) seen from their front and from behind",
        oracle: "their radiance, and 0",
        quantity: "pixels with another value",
        threshold: 0.0,
        full_only: false,
        measure: seen,
    },
    Case {
        name: "emitters/furnace",
        what: "mirrors and glass of reflectance 1 inside an emitter of radiance 1, a sphere and a box",
        oracle: "1",
        quantity: "worst error of a pixel",
        threshold: 1e-5,
        full_only: false,
        measure: furnace,
    },
    Case {
        name: "emitters/spheres",
        what: "a floor under spherical emitters: near, touching it, tiny and close by, and of a millionth of the distance",
        oracle: "Lρ (r/d)² cosθ",
        quantity: "worst deviation of a mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: spheres,
    },
    Case {
        name: "emitters/polygons",
        what: "a floor under emitters of triangles: a parallelogram, a large rectangle, a triangle almost on it, a box, a tessellated \
               sphere",
        oracle: "Lambert's formula: Lρ/2π Σ Θ Γ·n over the edges of what faces the floor",
        quantity: "worst deviation of a mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: polygons,
    },
    Case {
        name: "emitters/copies",
        what: "emitters each of whose faces is there twice, and two equal spheres",
        oracle: "the emitter once: of copies the first is met",
        quantity: "worst deviation of a mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: copies,
    },
    Case {
        name: "emitters/enclosed-body",
        what: "a sphere of reflectance 0.75 inside an emitter of radiance 1, a sphere and a box",
        oracle: "the reflectance",
        quantity: "worst deviation of a mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: enclosed_body,
    },
    Case {
        name: "emitters/flush",
        what: "emitters in the plane of a ceiling, each of one face or of many, as polygons and in the BVH, seen at all angles",
        oracle: "their radiance, wherever the emitter is",
        quantity: "rays that see another one",
        threshold: 0.0,
        full_only: false,
        measure: flush,
    },
    Case {
        name: "emitters/limb",
        what: "shadow rays to points at the limb of spheres (near, far, tiny, in the BVH, from inside) and to grazed polygons and triangles",
        oracle: "the emitter does not hide itself",
        quantity: "points that are hidden",
        threshold: 0.0,
        full_only: false,
        measure: limb,
    },
    Case {
        name: "emitters/two-sided",
        what: "a floor and a ceiling, a plate that shines on both sides between them; a sphere inside of one that does",
        oracle: "Lambert's formula for both; the sphere's reflectance",
        quantity: "worst deviation of a mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: two_sided,
    },
    Case {
        name: "emitters/edges",
        what: "edges of small emitters, seen directly and in mirrors and glass, which get more samples",
        oracle: "the same without",
        quantity: "deviation of the image's mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: edges,
    },
    Case {
        name: "emitters/edges-of-glass",
        what: "edges of small balls of glass and mirror, where first hits of other samples decide how many pixels get",
        oracle: "the same without",
        quantity: "deviation of the image's mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: edges_of_glass,
    },
    Case {
        name: "emitters/mirrored",
        what: "an emitter in a mirror box, seen after thousands of reflections, whose edges get more samples",
        oracle: "the same without",
        quantity: "deviation of the image's mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: mirrored,
    },
    Case {
        name: "emitters/flux",
        what: "a closed diffuse sphere around emitters: off centre with depth 1, and at the centre with depth 64",
        oracle: "all flux arrives: Lρ r²/R², and the geometric series of what the emitter does not absorb",
        quantity: "worst deviation of a mean in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: flux,
    },
];

fn seen(lab: &Lab) -> Result<Measured, CheckError> {
    let radiance = 4.75;
    let at = v(0.25, -0.125, -4.0);
    let square = |scene: &mut Scene, n: u32, back: bool| {
        let x = if back { v(-2.0, 0.0, 0.5) } else { v(2.0, 0.0, -0.5) };
        let (positions, triangles) = grid(at, x, v(0.0, 2.0, 0.25), n);
        scene.mesh(&positions, &triangles, emitter(radiance));
    };
    type Emitter<'a> = (f64, &'a dyn Fn(&mut Scene));
    let emitters: [Emitter; 8] = [
        (radiance, &|s| s.sphere(at, 1.5, emitter(radiance))),
        (0.0, &|s| {
            s.sphere(at, 1.5, emitter(radiance));
            s.spheres[0].inward = true;
        }),
        (0.0, &|s| s.sphere(at, 5.0, emitter(radiance))),
        (radiance, &|s| {
            s.sphere(at, 5.0, emitter(radiance));
            s.spheres[0].inward = true;
        }),
        (radiance, &|s| square(s, 1, false)),
        (0.0, &|s| square(s, 1, true)),
        (radiance, &|s| square(s, 8, false)),
        (0.0, &|s| square(s, 8, true)),
    ];
    let mut wrong = 0;
    for (expected, build) in emitters {
        let mut scene = empty();
        build(&mut scene);
        scene.camera.target = at;
        scene.camera.horizontal_fov = 20.0;
        scene.size(8, 16);
        wrong += lab.render(&scene)?.film.mean().iter().filter(|x| **x != [expected as f32; 3]).count();
    }
    Ok(Measured::new(wrong as f64, "8 emitters, 64 pixels each"))
}

/// A closed emitter around the origin that shines inward: a sphere, or a box of triangles.
fn enclose(scene: &mut Scene, boxed: bool, radiance: f64) {
    let center = v(0.25, -0.125, -2.0);
    if boxed {
        scene.cuboid(center - 6.0, center + v(5.0, 7.0, 6.0), emitter(radiance));
        if let Some(mesh) = scene.meshes.last_mut() {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
    } else {
        scene.sphere(center, 9.0, emitter(radiance));
        scene.spheres[0].inward = true;
    }
}

fn furnace(lab: &Lab) -> Result<Measured, CheckError> {
    let mut off = 0.0;
    for boxed in [false, true] {
        let mut scene = empty();
        enclose(&mut scene, boxed, 1.0);
        scene.integrator.max_depth = 256;
        scene.sphere(v(-1.0, 0.0, -5.0), 1.0, mirror(1.0));
        scene.sphere(v(1.0, 0.5, -5.0), 1.0, glass(1.5));
        let (positions, triangles) = icosphere(v(0.0, -1.5, -5.0), 0.75, 2);
        scene.mesh(&positions, &triangles, mirror(1.0));
        scene.size(32, lab.size(16, 1024) as u32);
        off = worst(lab.render(&scene)?.channel(1).iter().map(|x| (x - 1.0).abs()).chain([off]));
    }
    Ok(Measured::new(off, "2 × 1024 pixels"))
}

/// How far the means of a scene with a sample map and without are apart, from images of several seeds.
fn with_and_without(lab: &Lab, scene: &Scene) -> Result<Measured, CheckError> {
    let mut multiplied = 0;
    let mut means = |sample_map: SampleMap| -> Result<Vec<f64>, CheckError> {
        let settings = RenderSettings { sample_map, ..lab.settings(scene) };
        let mut renderer = Renderer::new(&lab.context, scene, &settings)?;
        let mut mean = |seed: u32| {
            renderer.set_seed(seed);
            let rendered = Rendered::by(&mut renderer)?;
            multiplied += rendered.statistics.multiplied_pixels;
            Ok(rendered.mean()[1])
        };
        (0..12).map(&mut mean).collect()
    };
    let (with, without) = (means(SampleMap::Auto)?, means(SampleMap::Off)?);
    if multiplied == 0 {
        return Ok(Measured::new(f64::INFINITY, "no pixel gets more samples"));
    }
    let differences: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
    Ok(Measured::new(
        z_score(&differences, 0.0).abs(),
        format!("12 seeds, {} pixels with more samples", multiplied / 12),
    ))
}

fn edges(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = empty();
    scene.quad([v(-4.0, -2.0, 1.0), v(4.0, -2.0, 1.0), v(4.0, -2.0, -9.0), v(-4.0, -2.0, -9.0)], diffuse(0.5));
    scene.quad([v(-4.0, -2.0, -9.0), v(4.0, -2.0, -9.0), v(4.0, 3.0, -9.0), v(-4.0, 3.0, -9.0)], mirror(0.75));
    scene.sphere(v(-1.5, -0.5, -6.0), 1.25, mirror(0.875));
    scene.sphere(v(1.5, -0.5, -5.0), 1.0, glass(1.5));
    for i in 0..5 {
        let x = -2.0 + f64::from(i);
        scene.quad([v(x, 0.75, -5.5), v(x + 0.3, 0.75, -5.5), v(x + 0.3, 1.0, -5.5), v(x, 1.0, -5.5)], emitter(20.0));
        scene.sphere(v(x, 1.5, -4.5), 0.05, emitter(50.0));
    }
    scene.integrator.russian_roulette = Some(2);
    scene.size(32, lab.size(32, 1024) as u32);
    with_and_without(lab, &scene)
}

fn edges_of_glass(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = empty();
    scene.background = [1.0; 3];
    let mut rng = Rng::new(7);
    for i in 0..400 {
        let surface = if i % 8 == 0 { glass(1.5) } else { mirror(0.0) };
        scene.sphere(v(rng.between(-1.7, 1.7), rng.between(-1.7, 1.7), -5.0), 0.06, surface);
    }
    // Behind the camera: that light is traced from emitters.
    scene.sphere(v(0.0, 3.0, 3.0), 0.5, emitter(10.0));
    scene.sphere(v(3.0, 3.0, 4.0), 0.5, diffuse(0.5));
    scene.size(32, lab.size(4, 16) as u32);
    with_and_without(lab, &scene)
}

fn mirrored(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = empty();
    scene.cuboid(v(-2.0, -2.0, -4.0), v(2.0, 2.0, 1.0), mirror(0.9375));
    scene.sphere(v(0.5, 0.25, -3.0), 0.125, emitter(8.0));
    scene.integrator.max_depth = 4000;
    scene.size(16, lab.size(16, 1024) as u32);
    with_and_without(lab, &scene)
}

/// Radiance of `scene` along rays that start near each point and run against its normal.
fn looking_at(lab: &Lab, scene: &Scene, points: &[(DVec3, DVec3)], height: f64) -> Result<Vec<f64>, CheckError> {
    let mut rng = Rng::new(61);
    let scale = lab.scatter(scene)?.scale();
    let paths: Vec<_> = points
        .iter()
        .enumerate()
        .map(|(i, (point, normal))| {
            let start = (scale * (*point + height * *normal - scene.camera.position)).as_vec3();
            PathInput::new(RayInput::new(start, -normal.as_vec3()), rng.bits() & 4095, i as u32)
        })
        .collect();
    Ok(lab.radiance(scene, &paths)?.iter().map(|r| r.y).collect())
}

const FLOOR: f64 = 0.75;

/// A floor at y = −1, wide enough that it is met under every emitter of these cases.
fn floor() -> Scene {
    let mut scene = empty();
    scene.quad([v(-8.0, -1.0, 8.0), v(8.0, -1.0, 8.0), v(8.0, -1.0, -8.0), v(-8.0, -1.0, -8.0)], diffuse(FLOOR));
    scene.integrator.max_depth = 1;
    // The tables are made for a camera outside of all emitters.
    scene.camera.position = v(0.0, 4.0, 8.0);
    scene
}

/// Deviation of what the floor shows at `point`, in standard errors.
fn floor_deviation(lab: &Lab, scene: &Scene, point: DVec3, exact: f64) -> Result<f64, CheckError> {
    let n = lab.size(1 << 13, 1 << 18);
    // From so near that no emitter is in between.
    let seen = looking_at(lab, scene, &vec![(point, DVec3::Y); n], 1e-4)?;
    Ok(z_score(&seen, exact))
}

fn spheres(lab: &Lab) -> Result<Measured, CheckError> {
    let mut deviations = Vec::new();
    let point = v(0.5, -1.0, -0.25);
    // Where the emitter is, seen from the point, and its radius: all of it above the floor.
    for (to, radius, radiance) in [
        (v(1.0, 3.0, -0.5), 1.0, 2.0),
        (v(0.0, 1.001, 0.0), 1.0, 3.0),
        (v(0.25, 1.0, 0.125), 1.0, 1.0),
        (v(-3.0, 2.0, 1.0), 1e-6, 1e12),
        (v(0.01, 0.02, 0.0), 0.015, 1.0),
    ] {
        let mut scene = floor();
        scene.sphere(point + to, radius, emitter(radiance));
        let exact = radiance * FLOOR * (radius / to.length()).powi(2) * to.y / to.length();
        deviations.push(floor_deviation(lab, &scene, point, exact)?);
    }
    Ok(Measured::new(worst(deviations.iter().copied()), format!("{} emitters", deviations.len())))
}

/// Irradiance at `point`, normal +y, of radiance 1 from the front of triangles that are wholly above it (Lambert 1760;
/// Baum, Rushmeier and Winget, SIGGRAPH 1989). What faces the point must not hide itself.
fn lambert(point: DVec3, positions: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    let mut sum = 0.0;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| positions[i as usize] - point);
        if (b - a).cross(c - a).dot(a) >= 0.0 {
            continue;
        }
        for (p, q) in [(a, b), (b, c), (c, a)] {
            // Counter-clockwise from the point, so that the edges' normals point inward.
            sum += p.angle_between(q) * q.cross(p).normalize_or_zero().y;
        }
    }
    sum.abs() / 2.0
}

/// Emitters above the floor, each with the point beneath it.
fn emitters(copies: usize) -> Vec<(Scene, DVec3, f64)> {
    let square = grid(v(0.0, 1.0, 0.0), v(0.75, 0.25, 0.0), v(0.0, 0.25, 1.0), 1);
    let ceiling = grid(v(0.0, 0.5, 0.0), v(6.0, 0.0, 0.0), v(0.0, 0.0, 6.0), 1);
    let low = (vec![v(-0.5, -0.99, 0.5), v(0.75, -0.95, 0.25), v(0.0, -0.98, -0.75)], vec![[0, 1, 2]]);
    let cuboid = crate::check::scenes::cuboid(v(-0.5, 0.0, -0.5), v(1.0, 0.75, 0.25));
    let ball = icosphere(v(0.25, 0.25, 0.5), 1.0, 2);
    // The ball is so large a mesh that it is traced through the BVH.
    [square, ceiling, low, cuboid, ball]
        .into_iter()
        .map(|(positions, mut triangles)| {
            let point = v(0.125, -1.0, -0.25);
            let positions: Vec<_> = positions.iter().map(|p| p.as_vec3().as_dvec3()).collect();
            let exact = FLOOR / PI * 3.0;
            // The front of flat emitters is below.
            if triangles.len() != 12 && triangles.len() != 320 {
                let n = triangles[0].map(|i| positions[i as usize]);
                if (n[1] - n[0]).cross(n[2] - n[0]).y > 0.0 {
                    triangles.iter_mut().for_each(|t| t.swap(1, 2));
                }
            }
            let irradiance = lambert(point, &positions, &triangles);
            let mut scene = floor();
            scene.mesh(&positions, &triangles.repeat(copies), emitter(3.0));
            (scene, point, exact * irradiance)
        })
        .collect()
}

fn polygons(lab: &Lab) -> Result<Measured, CheckError> {
    let mut deviations = Vec::new();
    for (scene, point, exact) in emitters(1) {
        deviations.push(floor_deviation(lab, &scene, point, exact)?);
    }
    Ok(Measured::new(worst(deviations.iter().copied()), format!("{} emitters", deviations.len())))
}

fn copies(lab: &Lab) -> Result<Measured, CheckError> {
    let mut deviations = Vec::new();
    for (i, (scene, point, exact)) in emitters(2).into_iter().enumerate() {
        // Polygons, and a mesh in the BVH.
        if i >= 3 {
            deviations.push(floor_deviation(lab, &scene, point, exact)?);
        }
    }
    let mut scene = floor();
    let (point, to) = (v(0.5, -1.0, -0.25), v(1.0, 3.0, -0.5));
    scene.sphere(point + to, 1.0, emitter(2.0));
    scene.sphere(point + to, 1.0, emitter(2.0));
    deviations.push(floor_deviation(lab, &scene, point, 2.0 * FLOOR * to.y / to.length().powi(3))?);
    Ok(Measured::new(worst(deviations.iter().copied()), format!("{} emitters", deviations.len())))
}

fn flush(lab: &Lab) -> Result<Measured, CheckError> {
    let (mut wrong, mut rays) = (0, 0);
    let mut rng = Rng::new(64);
    for (of_ceiling, of_emitter) in [(1, 1), (6, 8), (1, 8), (24, 1)] {
        for tilt in [0.0, 0.37] {
            let turned = |p: DVec3| {
                v(p.x * f64::cos(tilt) - p.y * f64::sin(tilt), p.x * f64::sin(tilt) + p.y * f64::cos(tilt), p.z)
            };
            let mut scene = empty();
            scene.integrator.max_depth = 1;
            scene.camera.position = turned(v(0.25, -1.5, 0.5));
            scene.camera.target = DVec3::ZERO;
            for (half, n, surface) in [(3.0, of_ceiling, diffuse(0.5)), (2.0, of_emitter, emitter(4.75))] {
                let (positions, triangles) = grid(DVec3::ZERO, turned(v(half, 0.0, 0.0)), v(0.0, 0.0, half), n);
                scene.mesh(&positions, &triangles, surface);
            }
            let space = RenderSpace::of(&scene);
            // From where the emitter's front is: below.
            let paths: Vec<_> = (0..lab.size(1 << 14, 1 << 20) as u32)
                .map(|i| {
                    let height = -10f64.powf(rng.between(-2.0, 0.5));
                    let from = space.point(turned(v(rng.between(-3.0, 3.0), height, rng.between(-3.0, 3.0)))).as_vec3();
                    let to = space.point(turned(v(rng.between(-1.99, 1.99), 0.0, rng.between(-1.99, 1.99)))).as_vec3();
                    PathInput::new(RayInput::new(from, (to - from).normalize()), rng.bits() & 4095, i)
                })
                .collect();
            rays += paths.len();
            wrong += lab.scatter(&scene)?.run(&paths)?.iter().filter(|path| path.radiance != [4.75; 3]).count();
        }
    }
    Ok(Measured::new(wrong as f64, format!("{rays} rays")))
}

fn limb(lab: &Lab) -> Result<Measured, CheckError> {
    type Place<'a> = (&'a dyn Fn(&mut Scene), &'a dyn Fn(&mut Rng) -> DVec3);
    let outside = |center: DVec3, radius: f64| {
        move |rng: &mut Rng| {
            // Near, and far away.
            let distance = radius * (1.0 + 10f64.powf(rng.between(-4.0, 3.0)));
            center + distance.min(4.0).max(1.0001 * radius) * rng.direction()
        }
    };
    let at = v(0.5, -0.25, -2.0);
    let (large, small, tiny) = (outside(at, 1.0), outside(at, 0.01), outside(at, 1e-4));
    let inside = |rng: &mut Rng| at + (1.0 - 10f64.powf(rng.between(-6.0, -0.01))) * 1.5 * rng.direction();
    // Down to a thousandth above the plane.
    let grazing =
        |rng: &mut Rng| at + v(rng.between(-3.0, 3.0), 10f64.powf(rng.between(-3.0, 0.0)), rng.between(-3.0, 3.0));
    let flat = |scene: &mut Scene, n: u32| {
        let (positions, triangles) = grid(at, v(0.0, 0.0, 1.0), v(1.0, 0.0, 0.0), n);
        scene.mesh(&positions, &triangles, emitter(1.0));
    };
    let ball = |scene: &mut Scene, radius: f64| scene.sphere(at, radius, emitter(1.0));
    let places: [Place; 6] = [
        (&|s| ball(s, 1.0), &large),
        (&|s| ball(s, 0.01), &small),
        (&|s| ball(s, 1e-4), &tiny),
        (
            &|s| {
                ball(s, 1.5);
                s.spheres[0].inward = true;
            },
            &inside,
        ),
        (&|s| flat(s, 1), &grazing),
        (&|s| flat(s, 8), &grazing),
    ];
    let mut rng = Rng::new(65);
    let (mut hidden, mut lit) = (0, 0);
    for (build, place) in places {
        let mut scene = empty();
        scene.camera.position = v(0.25, 0.5, -2.5);
        build(&mut scene);
        // Sets the size of render space.
        scene.light(v(0.0, 0.0, 4.0), 0.0);
        let space = RenderSpace::of(&scene);
        let queries: Vec<_> = (0..lab.size(1 << 15, 1 << 20))
            .map(|_| {
                let last = 1.0 - f64::powf(2.0, -rng.between(0.0, 24.0));
                LightQuery {
                    from: space.point(place(&mut rng)).as_vec3().to_array(),
                    choice: rng.uniform() as f32,
                    normal: [0.0, 1.0, 0.0],
                    candidate: 0.5,
                    point: [rng.uniform() as f32, last.min(1.0 - 5.960_464_5e-8) as f32],
                    unused2: [0.0; 2],
                }
            })
            .collect();
        let points: Vec<LightPoint> = lab.kernel(&scene, Kernel::LIGHT_SAMPLE, 1)?.run(&queries)?;
        let rays: Vec<_> = queries
            .iter()
            .zip(&points)
            .filter(|(_, p)| p.radiance[1] != 0.0 || p.pdf > 1.0)
            .filter_map(|(q, p)| {
                let (from, to) = (glam::Vec3::from(q.from), glam::Vec3::from(p.point));
                let direction = (to - from).try_normalize()?;
                Some(RayInput { t_max: from.distance(to), ..RayInput::new(from, direction) })
            })
            .collect();
        lit += rays.len();
        hidden += lab.occluded(&scene)?.run(&rays)?.iter().filter(|record| record.hidden != 0).count();
    }
    if lit < 50_000 {
        return Ok(Measured::new(f64::INFINITY, format!("only {lit} points are lit")));
    }
    Ok(Measured::new(hidden as f64, format!("{lit} points")))
}

fn two_sided(lab: &Lab) -> Result<Measured, CheckError> {
    let both = Surface { two_sided: true, ..emitter(3.0) };
    let n = lab.size(1 << 13, 1 << 18);
    let mut deviations = Vec::new();
    for (parts, turned) in [(1, false), (1, true), (8, false)] {
        let (positions, mut triangles) = grid(v(0.0, 0.25, 0.0), v(0.75, 0.0, 0.0), v(0.0, 0.0, 1.0), parts);
        let mut scene = floor();
        scene.quad([v(-8.0, 2.0, -8.0), v(8.0, 2.0, -8.0), v(8.0, 2.0, 8.0), v(-8.0, 2.0, 8.0)], diffuse(FLOOR));
        scene.camera.position = v(0.0, 1.5, 8.0);
        if turned {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        scene.mesh(&positions, &triangles, both);
        for (point, normal) in [(v(0.125, -1.0, -0.25), DVec3::Y), (v(0.5, 2.0, 0.25), -DVec3::Y)] {
            // The formula for what is above, mirrored for what is below; of the faces one or the other looks there.
            let seen = |p: &DVec3| point + v(p.x - point.x, normal.y * (p.y - point.y), p.z - point.z);
            let mirrored: Vec<DVec3> = positions.iter().map(seen).collect();
            let reversed: Vec<_> = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
            let irradiance = lambert(point, &mirrored, &triangles) + lambert(point, &mirrored, &reversed);
            let seen = looking_at(lab, &scene, &vec![(point, normal); n], 1e-4)?;
            deviations.push(z_score(&seen, FLOOR / PI * 3.0 * irradiance));
        }
    }
    // From within, whatever the normal.
    let center = v(0.25, 0.5, -3.0);
    let mut rng = Rng::new(66);
    let points: Vec<_> = (0..n)
        .map(|_| {
            let n = rng.direction();
            (center + n, n)
        })
        .collect();
    for inward in [false, true] {
        let mut scene = empty();
        scene.sphere(v(0.25, -0.125, -2.0), 9.0, Surface { two_sided: true, ..emitter(1.0) });
        scene.spheres[0].inward = inward;
        scene.sphere(center, 1.0, diffuse(0.75));
        deviations.push(z_score(&looking_at(lab, &scene, &points, 0.125)?, 0.75));
    }
    Ok(Measured::new(worst(deviations), "6 places under and above plates, 2 spheres"))
}

fn enclosed_body(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(62);
    let center = v(0.25, 0.5, -3.0);
    let points: Vec<_> = (0..lab.size(1 << 15, 1 << 20))
        .map(|_| {
            let n = rng.direction();
            (center + n, n)
        })
        .collect();
    let mut deviations = Vec::new();
    for boxed in [false, true] {
        let mut scene = empty();
        enclose(&mut scene, boxed, 1.0);
        scene.sphere(center, 1.0, diffuse(0.75));
        deviations.push(z_score(&looking_at(lab, &scene, &points, 0.125)?, 0.75));
    }
    Ok(Measured::new(worst(deviations), format!("2 × {} points", points.len())))
}

fn flux(lab: &Lab) -> Result<Measured, CheckError> {
    let (rho, shell, radius, radiance) = (0.5, 3.0f64, 1.25f64, 7.0);
    let mut rng = Rng::new(63);
    // From just beneath the shell, at points uniform in area.
    let points: Vec<_> = (0..lab.size(1 << 15, 1 << 20))
        .map(|_| {
            let n = rng.direction();
            (shell * n, -n)
        })
        .collect();
    let absorbed = (radius / shell).powi(2);
    let series = |depth: i32, q: f64| (1.0 - q.powi(depth)) / (1.0 - q);
    let ball = icosphere(v(0.25, -0.5, 0.75), radius, 2);
    let area: f64 =
        ball.1.iter().map(|t| t.map(|i| ball.0[i as usize])).map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum();
    let (mut deviations, mut details) = (Vec::new(), Vec::new());
    for area_light in 0..3 {
        let mut scene = empty();
        scene.sphere(DVec3::ZERO, shell, diffuse(rho));
        let (area, gain) = match area_light {
            0 => {
                scene.sphere(v(1.0, 0.5, -0.25), radius, emitter(radiance));
                (4.0 * PI * radius * radius, 1.0)
            }
            1 => {
                scene.mesh(&ball.0, &ball.1, emitter(radiance));
                (area, 1.0)
            }
            _ => {
                scene.sphere(DVec3::ZERO, radius, emitter(radiance));
                // Of what the shell sends back, the emitter takes its share.
                (4.0 * PI * radius * radius, series(64, (1.0 - absorbed) * rho))
            }
        };
        scene.integrator.max_depth = if area_light == 2 { 64 } else { 1 };
        // The camera, which the tables are made for, is inside of the shell and outside of the emitters.
        scene.camera.position = v(-1.5, -1.0, -1.0);
        scene.camera.target = v(-2.0, -1.0, -1.0);
        let exact = rho / PI * radiance * PI * area / (4.0 * PI * shell * shell) * gain;
        let seen = looking_at(lab, &scene, &points, 0.0625)?;
        let (mean, error) = mean_and_error(&seen);
        deviations.push(z_score(&seen, exact));
        details.push(format!("{:+.1e} ± {:.1e}", mean / exact - 1.0, error / exact));
    }
    Ok(Measured::new(worst(deviations), details.join(", ")))
}
