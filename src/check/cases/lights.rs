//! The functions that sample lights: where they point, with what density, and which light they choose.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::check::probe::{Density, DensityQuery, Kernel, LightPoint, LightQuery};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, emitter, empty, icosphere, v};
use crate::check::statistics::{chi_squared_p, least, relative, worst, z_score};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::render::space::RenderSpace;
use crate::render::{Mutation, RenderSettings, Reuse};
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "lights/density",
        what: "points sampled on spheres (from outside, from inside, far), a triangle, a parallelogram and a rectangle; u from 0 to \
               1 − 2^-24",
        oracle: "on the emitter; density per solid angle in f64, and the one that a ray which hits the point assumes",
        quantity: "worst relative error of a density × cosine at the emitter (infinite: not on the emitter)",
        threshold: 1e-5,
        full_only: false,
        measure: density,
    },
    Case {
        name: "lights/chi-squared",
        what: "directions to spheres and rectangles, points on triangles and parallelograms, the choice among 40 lights",
        oracle: "χ² against the density, α = 0.01 over all (Šidák)",
        quantity: "least p-value needed over the least found (infinite: a light is lost)",
        threshold: 1.0,
        full_only: false,
        measure: chi_squared,
    },
    Case {
        name: "lights/resampled",
        what: "one of two candidates among 3 and 300 point lights, at surfaces between and far from them",
        oracle: "the sum over all lights in f64",
        quantity: "distance of the mean from it, in standard errors",
        threshold: 4.0,
        full_only: false,
        measure: resampled,
    },
    Case {
        name: "lights/hidden",
        what: "a ball that a light in front of it lights, and a much stronger one is behind it, or behind a wall: 10⁴ to 10²⁰ times as strong",
        oracle: "Φρ/(4π²d²) of the one in front",
        quantity: "worst root mean square error of a pixel of 64 samples, relative",
        threshold: 0.15,
        full_only: false,
        measure: hidden,
    },
    Case {
        name: "lights/weak-among-strong",
        what: "a thousand weak point lights, each of which some thirty numbers of 24 bits choose, among 3,000 strong ones",
        oracle: "the probability that their light is divided by; all such numbers, with 64 further ones each",
        quantity: "root mean square of the numbers that choose one too often or too seldom",
        threshold: 0.15,
        full_only: false,
        measure: weak_among_strong,
    },
    Case {
        name: "lights/zero-area",
        what: "a point light among emitters without area: points, lines, triangles and spheres too small for single precision",
        oracle: "the point light alone; densities are finite",
        quantity: "relative difference of the image's mean (infinite: a number that is not finite)",
        threshold: 0.01,
        full_only: false,
        measure: zero_area,
    },
];

/// 1 − 2^-24: the largest number that the sampler gives.
const LAST: f32 = 1.0 - 5.960_464_5e-8;

#[derive(Clone, Copy)]
enum Emitter {
    Sphere {
        center: DVec3,
        radius: f64,
        inward: bool,
    },
    /// A corner and its neighbours; all of them, or half of them.
    Flat {
        corner: DVec3,
        edges: [DVec3; 2],
        half: bool,
    },
    /// Likewise, sampled by solid angle.
    Rectangle {
        corner: DVec3,
        edges: [DVec3; 2],
    },
}

/// Solid angle of a rectangle between `lo` and `hi` of the plane at distance `depth`: its angles on the sphere, less 2π (Girard).
fn solid_angle(lo: [f64; 2], hi: [f64; 2], depth: f64) -> f64 {
    let corners = [(lo[0], lo[1]), (hi[0], lo[1]), (hi[0], hi[1]), (lo[0], hi[1])].map(|(x, y)| v(x, y, depth));
    let side = |i: usize| corners[i % 4].cross(corners[(i + 1) % 4]);
    (0..4).map(|i| PI - side(i).angle_between(side(i + 1))).sum::<f64>() - TAU
}

/// A rectangle as seen from a point: its extent along its edges, and the distance of its plane.
fn seen_from(corner: DVec3, [e, f]: [DVec3; 2], from: DVec3) -> ([f64; 2], [f64; 2], f64) {
    let lo = [e, f].map(|edge| (corner - from).dot(edge.normalize()));
    let hi = [lo[0] + e.length(), lo[1] + f.length()];
    (lo, hi, (corner - from).dot(e.cross(f).normalize()).abs())
}

impl Emitter {
    fn scene(self) -> Scene {
        let mut scene = empty();
        // Sets the size of render space.
        scene.sphere(v(0.0, 0.0, 5.0), 1.0, diffuse(0.5));
        match self {
            Self::Sphere { center, radius, inward } => {
                scene.sphere(center, radius, emitter(1.0));
                scene.spheres[1].inward = inward;
            }
            Self::Flat { corner, edges: [e, f], half: true } => {
                scene.mesh(&[corner, corner + e, corner + f], &[[0, 1, 2]], emitter(1.0));
            }
            Self::Flat { corner, edges: [e, f], half: false } | Self::Rectangle { corner, edges: [e, f] } => {
                scene.quad([corner, corner + e, corner + e + f, corner + f], emitter(1.0));
            }
        }
        scene
    }

    /// Where the ray to the end of a shadow ray meets the emitter's plane, if it has one. Flat emitters are met only just behind that end.
    fn met_at(self, p: DVec3, from: DVec3) -> DVec3 {
        match self {
            Self::Sphere { .. } => p,
            Self::Flat { corner, edges: [e, f], .. } | Self::Rectangle { corner, edges: [e, f] } => {
                let n = e.cross(f);
                from + (corner - from).dot(n) / (p - from).dot(n) * (p - from)
            }
        }
    }

    /// Distance of `p` from the emitter's surface, the cosine of the way from there to `from`, and the density per solid
    /// angle of the point, as seen from `from`.
    fn density(self, p: DVec3, from: DVec3) -> (f64, f64, f64) {
        let way = from - p;
        match self {
            Self::Sphere { center, radius, inward } => {
                let n = (p - center).normalize() * if inward { -1.0 } else { 1.0 };
                let cosine = way.normalize().dot(n);
                let sin2 = radius * radius / center.distance_squared(from);
                let pdf = if inward {
                    way.length_squared() / (4.0 * PI * radius * radius * cosine)
                } else {
                    1.0 / (TAU * (sin2 / (1.0 + (1.0 - sin2).sqrt())))
                };
                ((p.distance(center) - radius).abs(), cosine, pdf)
            }
            Self::Flat { corner, edges: [e, f], half } => {
                let n = e.cross(f);
                let area = n.length() / if half { 2.0 } else { 1.0 };
                let cosine = way.normalize().dot(n.normalize());
                ((p - corner).dot(n.normalize()).abs(), cosine, way.length_squared() / (area * cosine))
            }
            Self::Rectangle { corner, edges } => {
                let n = edges[0].cross(edges[1]).normalize();
                let (lo, hi, depth) = seen_from(corner, edges, from);
                ((p - corner).dot(n).abs(), way.normalize().dot(n), 1.0 / solid_angle(lo, hi, depth))
            }
        }
    }
}

fn flat(half: bool) -> Emitter {
    Emitter::Flat { corner: v(-0.5, 1.0, -2.0), edges: [v(1.5, 0.25, 0.5), v(0.25, -0.5, 1.25)], half }
}

fn emitters() -> [Emitter; 6] {
    let ball = |center, radius, inward| Emitter::Sphere { center, radius, inward };
    [
        ball(v(0.5, 1.0, -3.0), 1.0, false),
        ball(v(-2.0, 1.0, -3.0), 1e-3, false),
        ball(v(0.25, 0.0, 0.5), 4.0, true),
        flat(true),
        flat(false),
        // Large as seen from everywhere in the scene.
        Emitter::Rectangle { corner: v(-0.25, -1.125, -3.25), edges: [v(3.0, 0.0, 1.5), v(-1.0, 4.0, 2.0)] },
    ]
}

fn sampled(lab: &Lab, scene: &Scene, queries: &[LightQuery]) -> Result<Vec<LightPoint>, CheckError> {
    lab.kernel(scene, Kernel::LIGHT_SAMPLE, 1)?.run(queries)
}

fn query(from: DVec3, normal: DVec3, choice: f32, point: [f32; 2]) -> LightQuery {
    let [from, normal] = [from, normal].map(|x| x.as_vec3().to_array());
    LightQuery { from, choice, normal, candidate: 0.5, point, unused2: [0.0; 2] }
}

/// With which probabilities the first `lights` are chosen at a point of render space.
fn probabilities(lab: &Lab, scene: &Scene, from: DVec3, lights: usize) -> Result<Vec<Density>, CheckError> {
    let of_light = |light: usize| DensityQuery {
        from: from.as_vec3().to_array(),
        light: light as i32,
        distance: 1.0,
        cosine: 1.0,
        unused: [0.0; 6],
    };
    let queries: Vec<_> = (0..lights).map(of_light).collect();
    lab.kernel(scene, Kernel::LIGHT_PDF, 1)?.run(&queries)
}

fn position(p: [f32; 3]) -> DVec3 {
    DVec3::from(p.map(f64::from))
}

fn density(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(71);
    let mut errors = Vec::new();
    let mut lit = 0;
    for area_light in emitters() {
        let scene = area_light.scene();
        let scale = RenderSpace::of(&scene).length(1.0);
        let queries: Vec<_> = (0..lab.size(1 << 14, 1 << 20))
            .map(|_| {
                let mut u = || [0.0, LAST, 0.5, 5.960_464_5e-8, rng.uniform() as f32][rng.below(5)];
                let (choice, point) = (u(), [u(), u()]);
                query(scale * rng.in_ball(), rng.direction(), choice, point)
            })
            .collect();
        let points = sampled(lab, &scene, &queries)?;
        let (mut expected, mut hits) = (Vec::new(), Vec::new());
        for (q, s) in queries.iter().zip(&points).filter(|(_, s)| s.radiance[0] > 0.0) {
            let (from, p) = (position(q.from), position(s.point));
            let (off, ..) = area_light.density(p / scale, from / scale);
            let p = scale * area_light.met_at(p / scale, from / scale);
            let (_, cosine, pdf) = area_light.density(p / scale, from / scale);
            let size = p.length() + from.length() + scale * 4.0;
            if !s.pdf.is_finite() || s.light != 0 || off * scale > 1e-5 * size || cosine <= 0.0 {
                errors.push(f64::INFINITY);
                continue;
            }
            errors.push(relative(f64::from(s.pdf), pdf) * cosine);
            expected.push((pdf, cosine));
            hits.push(DensityQuery {
                from: q.from,
                light: s.light,
                distance: p.distance(from) as f32,
                cosine: cosine as f32,
                unused: [0.0; 6],
            });
        }
        let densities: Vec<Density> = lab.kernel(&scene, Kernel::LIGHT_PDF, 1)?.run(&hits)?;
        errors.extend(densities.iter().zip(&expected).map(|(d, e)| relative(f64::from(d.pdf), e.0) * e.1));
        lit += hits.len();
    }
    if lit < 5000 {
        errors.push(f64::INFINITY);
    }
    Ok(Measured::new(worst(errors), format!("6 emitters, {lit} points")))
}

fn bin(u: f64) -> usize {
    ((u * 16.0) as usize).min(15)
}

fn chi_squared(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(72);
    let n = lab.size(1 << 16, 1 << 22);
    let mut p_values = Vec::new();
    for area_light in emitters() {
        let scene = area_light.scene();
        let scale = RenderSpace::of(&scene).length(1.0);
        let from = v(0.125, -0.25, 0.375);
        let queries: Vec<_> = (0..n)
            .map(|_| query(scale * from, v(0.0, 0.8, -0.6), 0.5, [rng.uniform() as f32, rng.uniform() as f32]))
            .collect();
        let mut counts = vec![0.0; 256];
        for s in sampled(lab, &scene, &queries)? {
            let p = position(s.point) / scale;
            // Two numbers that are uniform if the density is what it should be.
            let (a, b) = match area_light {
                Emitter::Sphere { center, inward: true, .. } => {
                    let m = (p - center).normalize();
                    (m.z / 2.0 + 0.5, m.y.atan2(m.x) / TAU + 0.5)
                }
                Emitter::Sphere { center, radius, .. } => {
                    let axis = (center - from).normalize();
                    let (tangent, bitangent) = axis.any_orthonormal_pair();
                    let d = (p - from).normalize();
                    let sin2_max = radius * radius / center.distance_squared(from);
                    let sin2 = axis.cross(d).length_squared();
                    let depth = |sin2: f64| sin2 / (1.0 + (1.0 - sin2).sqrt());
                    (depth(sin2) / depth(sin2_max), d.dot(bitangent).atan2(d.dot(tangent)) / TAU + 0.5)
                }
                Emitter::Flat { corner, edges: [e, f], half } => {
                    let normal = e.cross(f);
                    let along = |x: DVec3, y: DVec3| x.cross(y).dot(normal) / normal.length_squared();
                    let (a, b) = (along(p - corner, f), along(e, p - corner));
                    if half { ((a + b) * (a + b), b / (a + b)) } else { (a, b) }
                }
                Emitter::Rectangle { corner, edges } => {
                    let (lo, hi, depth) = seen_from(corner, edges, from);
                    let [x, y] = edges.map(|edge| (p - from).dot(edge.normalize()));
                    let below = |y: f64| y / (x * x + y * y + depth * depth).sqrt();
                    let share = solid_angle(lo, [x, hi[1]], depth) / solid_angle(lo, hi, depth);
                    (share, (below(y) - below(lo[1])) / (below(hi[1]) - below(lo[1])))
                }
            };
            counts[bin(a) * 16 + bin(b)] += 1.0;
        }
        p_values.push(chi_squared_p(&counts, &vec![n as f64 / 256.0; 256]));
    }

    let scene = many();
    let scale = RenderSpace::of(&scene).length(1.0);
    let mut lost = 0;
    for (from, normal) in [(v(0.0, -1.0, -3.0), DVec3::Y), (v(2.0, 1.0, -6.0), v(-0.6, 0.0, 0.8))] {
        let queries: Vec<_> = (0..n)
            .map(|_| {
                let [choice, candidate] = [(); 2].map(|()| rng.uniform() as f32);
                LightQuery { candidate, ..query(scale * from, normal, choice, [0.25, 0.75]) }
            })
            .collect();
        let lights = scene.lights.len() + scene.spheres.len() + scene.triangle_count();
        let mut counts = vec![0.0; lights];
        for s in sampled(lab, &scene, &queries)? {
            if let Ok(light) = usize::try_from(s.light) {
                counts[light] += 1.0;
            }
        }
        let probabilities = probabilities(lab, &scene, scale * from, lights)?;
        let probabilities: Vec<_> = probabilities.iter().map(|d| f64::from(d.probability)).collect();
        let expected: Vec<f64> = probabilities.iter().map(|p| p * n as f64).collect();
        p_values.push(chi_squared_p(&counts, &expected));
        // Point lights come first, spheres that are no constants last: what is above the surface must have a chance.
        let above = |p: DVec3| (p - from).dot(normal) > 0.0;
        let points = scene.lights.iter().map(|light| light.position().is_some_and(above));
        let balls = scene.spheres.iter().map(|s| above(s.center));
        let last = probabilities.iter().skip(lights - scene.spheres.len());
        let all = points.zip(&probabilities).chain(balls.zip(last));
        lost += all.filter(|(above, p)| *above && **p == 0.0).count();
    }
    if lost > 0 {
        return Ok(Measured::new(f64::INFINITY, format!("{lost} lights cannot be chosen")));
    }
    let least = least(&p_values);
    let needed = 1.0 - 0.99f64.powf(1.0 / p_values.len() as f64);
    Ok(Measured::new(needed / least, format!("{} tests of {n} samples, least p {least:.2e}", p_values.len())))
}

fn resampled(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(75);
    let n = lab.size(1 << 15, 1 << 20);
    let mut distances = Vec::new();
    for count in [3, 300] {
        let mut scene = empty();
        for i in 0..count {
            let at = v(rng.between(-4.0, 4.0), rng.between(-2.0, 4.0), rng.between(-9.0, 0.0));
            scene.light(at, 10f64.powi(i % 3));
        }
        let space = RenderSpace::of(&scene);
        let mut kernel = lab.kernel(&scene, Kernel::LIGHT_RESAMPLED, 1)?;
        for _ in 0..lab.size(8, 64) {
            let (from, normal) = (v(0.0, 0.5, -4.0) + rng.between(1.0, 20.0) * rng.in_ball(), rng.direction());
            let expected: f64 = scene
                .lights
                .iter()
                .map(|light| {
                    let position = light.position().unwrap_or_default();
                    let power = light.color();
                    let to = position - from;
                    let cosine = to.normalize().dot(normal).max(0.0);
                    power[0] * cosine / (4.0 * PI * PI * to.length_squared())
                })
                .sum();
            let queries: Vec<_> = (0..n)
                .map(|_| {
                    let [choice, candidate] = [(); 2].map(|()| rng.uniform() as f32);
                    let q = query(space.point(from), normal, choice, [0.5; 2]);
                    LightQuery { candidate, ..q }
                })
                .collect();
            let points: Vec<LightPoint> = kernel.run(&queries)?;
            let values: Vec<_> = points.iter().map(|s| f64::from(s.radiance[0])).collect();
            let false_light = expected == 0.0 && values.iter().any(|x| *x != 0.0);
            distances.push(if false_light { f64::INFINITY } else { z_score(&values, expected) });
        }
    }
    let tests = distances.len();
    Ok(Measured::new(worst(distances), format!("{tests} places, {n} samples each")))
}

fn hidden(lab: &Lab) -> Result<Measured, CheckError> {
    let mut errors = Vec::new();
    for walled in [false, true] {
        for power in [1e2, 1e6, 1e11, 1e22] {
            let mut scene = empty();
            scene.camera.position = v(0.0, 0.0, 5.0);
            scene.camera.target = DVec3::ZERO;
            scene.camera.horizontal_fov = 1.0;
            scene.integrator.max_depth = 1;
            scene.size(16, 64);
            scene.sphere(DVec3::ZERO, 1.0, diffuse(0.5));
            scene.light(v(0.0, 0.0, 5.0), 100.0);
            scene.light(v(0.0, if walled { 20.0 } else { 0.0 }, if walled { 20.0 } else { -5.0 }), power);
            if walled {
                scene.quad([v(-9.0, 4.0, -9.0), v(9.0, 4.0, -9.0), v(9.0, 4.0, 9.0), v(-9.0, 4.0, 9.0)], diffuse(0.0));
            }
            let exact = 100.0 * 0.5 / (4.0 * PI * PI * 16.0);
            let image = lab.render(&scene)?.channel(0);
            let squares: f64 = image.iter().map(|x| (x / exact - 1.0).powi(2)).sum();
            errors.push((squares / image.len() as f64).sqrt());
        }
    }
    let detail = errors.iter().map(|e| format!("{e:.3}")).collect::<Vec<_>>().join(", ");
    Ok(Measured::new(worst(errors), detail))
}

fn weak_among_strong(lab: &Lab) -> Result<Measured, CheckError> {
    const STRONG: usize = 3000;
    const WEAK: usize = 1000;
    const FURTHER: usize = 64;
    let mut rng = Rng::new(76);
    let mut scene = empty();
    for _ in 0..STRONG {
        scene.light(v(rng.between(-4.0, 4.0), rng.between(4.0, 6.0), rng.between(-9.0, -5.0)), 1.0);
    }
    for _ in 0..WEAK {
        let at = v(3.0, 5.0, 3.0) + 0.01 * rng.in_ball();
        scene.light(at, STRONG as f64 / WEAK as f64 / 1024.0);
    }
    let (from, normal) = (RenderSpace::of(&scene).point(v(0.0, 0.0, -2.0)), DVec3::Y);
    let probabilities = probabilities(lab, &scene, from, STRONG + WEAK)?.split_off(STRONG);
    let probabilities: Vec<_> = probabilities.iter().map(|d| f64::from(d.by_table)).collect();
    let numbers = f64::from(1u32 << 24);
    let mut kernel = lab.kernel(&scene, Kernel::LIGHT_SAMPLE, 1)?;
    let is_weak = |s: &LightPoint| s.light >= STRONG as i32;
    // Where weak lights are chosen, as far as one number of 64 tells.
    let chosen_by = |number: u32, candidate: f32| LightQuery {
        candidate,
        ..query(from, normal, (f64::from(number) / numbers) as f32, [0.5; 2])
    };
    let scan: Vec<_> = (0..1 << 18).map(|i| chosen_by(i << 6, 0.5)).collect();
    let weak: Vec<bool> = kernel.run(&scan)?.iter().map(is_weak).collect();
    let near = |i: usize| weak[i.saturating_sub(1)..weak.len().min(i + 2)].contains(&true);
    let found: Vec<u32> =
        (0..weak.len()).filter(|i| near(*i)).flat_map(|i| (0..64).map(move |j| (i as u32) << 6 | j)).collect();
    let mut counts = vec![0.0; WEAK];
    for some in found.chunks(1 << 12) {
        let queries: Vec<_> = some
            .iter()
            .flat_map(|&number| [number; FURTHER])
            .map(|number| chosen_by(number, rng.between(1.0 / 16.0, 1.0) as f32))
            .collect();
        for s in kernel.run(&queries)?.iter().filter(|s| is_weak(s)) {
            counts[s.light as usize - STRONG] += 1.0 / FURTHER as f64;
        }
    }
    let fewest = numbers * probabilities.iter().copied().fold(f64::INFINITY, f64::min);
    let errors: Vec<f64> = counts.iter().zip(&probabilities).map(|(count, p)| count - numbers * p).collect();
    let error = (errors.iter().map(|e| e * e).sum::<f64>() / WEAK as f64).sqrt();
    Ok(Measured::new(error, format!("{fewest:.1} numbers at least choose each of {WEAK} lights")))
}

/// Points, spheres and triangles that shine.
fn many() -> Scene {
    let mut rng = Rng::new(73);
    let mut scene = empty();
    for i in 0..10 {
        let mut at = || v(rng.between(-4.0, 4.0), rng.between(-2.0, 4.0), rng.between(-9.0, 0.0));
        scene.light(at(), 10f64.powi(i % 3));
        let center = at();
        scene.sphere(center, 0.125, emitter(f64::from(1 + i)));
    }
    let (positions, triangles) = icosphere(v(0.5, 2.0, -4.0), 0.75, 0);
    scene.mesh(&positions, &triangles, emitter(5.0));
    scene
}

fn zero_area(lab: &Lab) -> Result<Measured, CheckError> {
    let mut with = empty();
    with.quad([v(-4.0, -1.0, 0.0), v(4.0, -1.0, 0.0), v(4.0, -1.0, -8.0), v(-4.0, -1.0, -8.0)], diffuse(0.75));
    with.sphere(v(0.5, 0.0, -5.0), 1.0, diffuse(0.5));
    with.integrator.max_depth = 2;
    with.size(32, 16);
    let mut without = with.clone();
    for scene in [&mut with, &mut without] {
        scene.light(v(1.0, 3.0, -2.0), 100.0);
    }
    let area_light = emitter(1.0);
    for (i, radius) in [1e-30, 1e-25, 1e-20, 1e-12].into_iter().enumerate() {
        with.sphere(v(-1.5 + i as f64, 0.5, -4.0), radius, area_light);
    }
    // Just above the floor, too.
    with.sphere(v(0.0, -1.0 + 1e-6, -3.0), 1e-30, area_light);
    let at = v(-0.5, 1.0, -4.0);
    for size in [1e-12, 1e-8] {
        with.mesh(&[at, at + v(size, 0.0, 0.0), at + v(0.0, size, size)], &[[0, 1, 2]], area_light);
    }
    let tiny = 1.2e-19;
    // Around the origin, where the camera is, coordinates can be that small.
    with.mesh(&[DVec3::ZERO, v(tiny, 0.0, 0.0), v(0.0, 0.0, tiny)], &[[0, 1, 2]], area_light);
    with.mesh(&[at, at + v(0.5, 0.0, 0.0), at + v(1.0, 0.0, 0.0)], &[[0, 1, 2], [0, 0, 1], [1, 1, 1]], area_light);
    let (positions, triangles) = (vec![at; 300], (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect::<Vec<_>>());
    with.mesh(&positions, &triangles, area_light);
    // The emitters put a BVH into the scene, for which paths would be reused.
    let plain = |scene: &Scene, mutation: Option<Mutation>| {
        let settings = RenderSettings { reuse: Reuse::Off, mutation, ..lab.settings(scene) };
        lab.render_with(scene, &settings)
    };
    let (image, expected) = (plain(&with, lab.mutation)?, plain(&without, lab.mutation)?);
    let mut off = relative(image.mean()[0], expected.mean()[0]);
    // Chosen by power alone, the emitters change no pixel.
    let by_power = plain(&with, lab.mutation.or(Some(Mutation::NoEvenShare)))?;
    if worst(by_power.channel(0).iter().zip(expected.channel(0)).map(|(a, b)| relative(*a, b))) > 1e-6 {
        off = f64::INFINITY;
    }
    // The emitters alone.
    with.lights.clear();
    let dark = lab.render(&with)?;
    let mut rng = Rng::new(74);
    let scale = RenderSpace::of(&with).length(1.0);
    let queries: Vec<_> = (0..lab.size(1 << 13, 1 << 18))
        .map(|i| {
            let from = scale * v(rng.between(-2.0, 2.0), -1.0, rng.between(-6.0, -1.0));
            let u = |i: usize| [0.0, 0.25, 0.5, 0.75, LAST][i % 5];
            query(from, DVec3::Y, rng.uniform() as f32, [u(i), u(i / 5)])
        })
        .collect();
    let points = sampled(lab, &with, &queries)?;
    let finite = |s: &&LightPoint| s.pdf.is_finite() && s.radiance.iter().chain(&s.point).all(|x| x.is_finite());
    let bad = points.len() - points.iter().filter(finite).count();
    let counted = image.statistics.bad_samples + dark.statistics.bad_samples;
    let light = worst(dark.channel(0));
    let detail = format!(
        "{bad} of {} densities and {counted} samples are not finite; alone the emitters give {light:.0e}; {off:.1e}",
        points.len()
    );
    if bad > 0 || counted > 0 || light > 1e-20 {
        off = f64::INFINITY;
    }
    Ok(Measured::new(off, detail))
}
