//! The hierarchy against testing every primitive.

use glam::{DVec3, Vec3};

use crate::check::probe::{HitRecord, RayInput};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, empty, icosphere, v};
use crate::check::statistics::worst;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::render::{Accel, RenderSettings, TriangleTest};
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "bvh/brute-force",
        what: "rays at vertices, edges, inner points of triangles and spheres, of a mesh, and of specks near and far",
        oracle: "every primitive tested on the device",
        quantity: "rays whose t or primitive differs",
        threshold: 0.0,
        full_only: false,
        measure: brute_force,
    },
    Case {
        name: "bvh/axis-aligned",
        what: "axis-aligned rays with components +0 and −0 on the faces of boxes, and 1 or 2 ulp beside them",
        oracle: "every primitive tested on the device",
        quantity: "rays whose t or primitive differs",
        threshold: 0.0,
        full_only: false,
        measure: axis_aligned,
    },
    Case {
        name: "bvh/shuffled",
        what: "a soup of triangles in another order",
        oracle: "the same triangles in order",
        quantity: "rays whose t differs",
        threshold: 0.0,
        full_only: false,
        measure: shuffled,
    },
    Case {
        name: "bvh/worst-depth",
        what: "triangles whose sizes and distances halve, so that the best bvh is a list",
        oracle: "every primitive tested; the stack's bound of 62",
        quantity: "rays that differ (infinite: too deep)",
        threshold: 0.0,
        full_only: false,
        measure: worst_depth,
    },
    Case {
        name: "bvh/identical",
        what: "image of 1e5 (full: 1e6) identical triangles",
        oracle: "the image of one of them",
        quantity: "pixels that differ",
        threshold: 0.0,
        full_only: false,
        measure: identical,
    },
    Case {
        name: "bvh/large",
        what: "a sphere of 1e7 triangles",
        oracle: "closed: every ray hits; or an error that names the limit",
        quantity: "rays that leak",
        threshold: 0.0,
        full_only: true,
        measure: large,
    },
    Case {
        name: "bvh/non-finite-rays",
        what: "rays with NaN, infinite or zero direction, or NaN origin",
        oracle: "a miss",
        quantity: "rays that hit",
        threshold: 0.0,
        full_only: false,
        measure: |lab| non_finite_rays(lab).map(|(hits, _, detail)| Measured::new(hits, detail)),
    },
    Case {
        name: "bvh/non-finite-steps",
        what: "the same rays",
        oracle: "steps of ordinary rays",
        quantity: "steps over those of ordinary rays",
        threshold: 2.5,
        full_only: false,
        measure: |lab| non_finite_rays(lab).map(|(_, steps, detail)| Measured::new(steps, detail)),
    },
];

pub(super) fn soup(rng: &mut Rng, triangles: usize) -> Scene {
    let mut scene = empty();
    let mut positions = Vec::new();
    let mut indices = Vec::new();
    for i in 0..triangles as u32 {
        let center = rng.in_cube(1.0) + v(0.0, 0.0, -1.0);
        let size = 10f64.powf(rng.between(-3.0, -0.3));
        for _ in 0..3 {
            positions.push((center + size * rng.direction()).as_vec3().as_dvec3());
        }
        indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    scene.mesh(&positions, &indices, diffuse(0.5));
    scene
}

/// A vertex, a point of an edge, or an inner point of the first mesh.
pub(super) fn point_of(scene: &Scene, rng: &mut Rng) -> DVec3 {
    let mesh = &scene.meshes[0];
    let [a, b, c] = mesh.triangles[rng.below(mesh.triangles.len())].map(|i| mesh.positions[i as usize]);
    match rng.below(3) {
        0 => a,
        1 => a.lerp(b, rng.uniform()),
        _ => a.lerp(b, rng.uniform()).lerp(c, rng.uniform()),
    }
}

/// Rays at points of the first mesh, from a cube around the camera.
pub(super) fn aimed(scene: &Scene, from: f64, scale: f64, rng: &mut Rng, count: usize) -> Vec<RayInput> {
    (0..count)
        .map(|_| {
            let target = point_of(scene, rng);
            let origin = (scale * from * rng.in_cube(2.0)).as_vec3();
            RayInput::new(origin, (scale * target - origin.as_dvec3()).normalize().as_vec3())
        })
        .collect()
}

fn with_brute_force(lab: &Lab, scene: &Scene) -> RenderSettings {
    RenderSettings { accel: Accel::None, ..lab.settings(scene) }
}

pub(super) fn differ(a: &HitRecord, b: &HitRecord) -> bool {
    a.id != b.id || (a.id >= 0 && a.t.to_bits() != b.t.to_bits())
}

fn compare(lab: &Lab, scene: &Scene, rays: &dyn Fn(f64) -> Vec<RayInput>) -> Result<(usize, usize), CheckError> {
    let mut bvh = lab.closest(scene)?;
    let mut brute = lab.closest_with(scene, &with_brute_force(lab, scene))?;
    let rays = rays(bvh.scale());
    let wrong = bvh.run(&rays)?.iter().zip(&brute.run(&rays)?).filter(|(a, b)| differ(a, b)).count();
    Ok((wrong, rays.len()))
}

fn brute_force(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(35);
    let mut spheres = soup(&mut rng, 300);
    for _ in 0..60 {
        let radius = 10f64.powf(rng.between(-2.0, -0.5));
        spheres.sphere((v(0.0, 0.0, -1.0) + rng.in_cube(1.0)).as_vec3().as_dvec3(), radius, diffuse(0.5));
    }
    // A mesh: neighbours share vertices, so that many rays meet several triangles at one distance.
    let mut closed = empty();
    let (positions, triangles) = icosphere(v(0.1, 0.2, -0.5), 1.0, 2);
    closed.mesh(&positions, &triangles, diffuse(0.5));
    let seed = rng.bits();
    let (few, many) = (lab.size(1 << 16, 4_000_000), lab.size(1 << 16, 20_000_000));
    let (mut wrong, mut traced) = (0, 0);
    // A speck at the camera, in the middle of a large scene, and rays from all over that; a speck far from the camera,
    // and rays from beside the camera.
    let speck = |center: DVec3| {
        let mut scene = empty();
        let (positions, triangles) = icosphere(center, 1e-3, 3);
        scene.mesh(&positions, &triangles, diffuse(0.5));
        scene.light(v(2.0, 1.0, 3.0), 1.0);
        scene
    };
    let (near, far) = (speck(v(1e-5, 2e-5, -3e-5)), speck(v(2.5, -1.5, -2.0)));
    // Every ray is tested against every triangle: fewer of them for the specks, which have 1280.
    for (scene, from, count) in [(spheres, 1.0, many), (closed, 1.0, many), (near, 1.0, few), (far, 1e-3, few)] {
        let rays = |scale| aimed(&scene, from, scale, &mut Rng::new(u64::from(seed)), count);
        let (w, n) = compare(lab, &scene, &rays)?;
        wrong += w;
        traced += n;
    }
    Ok(Measured::new(wrong as f64, format!("{traced} rays, 4 scenes")))
}

/// Boxes on a lattice, whose faces, edges and corners fall together with those of the BVH's boxes.
pub(super) fn lattice(rng: &mut Rng) -> Scene {
    let mut scene = empty();
    let mut lattice = |n: usize| rng.below(n) as f64 / 4.0;
    for _ in 0..40 {
        let lo = v(lattice(16), lattice(16), lattice(16)) - 2.0;
        let size = v(lattice(4), lattice(4), lattice(4)) + 0.25;
        scene.cuboid(lo, lo + size, diffuse(0.5));
    }
    scene
}

/// Rays along the axes from points of that lattice, and from beside them.
pub(super) fn axis_rays(scale: f64, seed: u64, count: usize) -> Vec<RayInput> {
    let mut rng = Rng::new(seed);
    (0..count)
        .map(|_| {
            let axis = rng.below(3);
            let mut direction = [0f32; 3];
            for (i, d) in direction.iter_mut().enumerate() {
                let sign = if rng.bits() & 1 == 0 { 1.0 } else { -1.0 };
                *d = if i == axis { sign } else { 0.0 * sign };
            }
            let at = |rng: &mut Rng| (scale * (rng.below(40) as f64 / 4.0 - 4.5)) as f32;
            let origin = [at(&mut rng), at(&mut rng), at(&mut rng)].map(|x| beside(x, rng.below(8)));
            RayInput::new(Vec3::from(origin), Vec3::from(direction))
        })
        .collect()
}

fn axis_aligned(lab: &Lab) -> Result<Measured, CheckError> {
    let scene = lattice(&mut Rng::new(34));
    let (mut wrong, mut traced) = (0, 0);
    for batch in 0..lab.size(1, 8) {
        let rays = |scale| axis_rays(scale, 35 + batch as u64, lab.size(1 << 17, 12_500_000));
        let (w, n) = compare(lab, &scene, &rays)?;
        wrong += w;
        traced += n;
    }
    Ok(Measured::new(wrong as f64, format!("{traced} rays, 40 boxes")))
}

/// x, or for some `which` up to two units in the last place from it, or about 1e-20 where that is at 0.
fn beside(x: f32, which: usize) -> f32 {
    match which {
        0 if x == 0.0 => -1e-20,
        1 if x == 0.0 => 1e-20,
        0 => x.next_down(),
        1 => x.next_up(),
        2 => x.next_down().next_down(),
        3 => x.next_up().next_up(),
        _ => x,
    }
}

fn shuffled(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(40);
    let scene = soup(&mut rng, 2000);
    let mut other = scene.clone();
    let triangles = &mut other.meshes[0].triangles;
    for i in (1..triangles.len()).rev() {
        triangles.swap(i, rng.below(i + 1));
    }
    let mut probes = [lab.closest(&scene)?, lab.closest(&other)?];
    let rays = aimed(&scene, 1.0, probes[0].scale(), &mut rng, lab.size(1 << 18, 1 << 24));
    let [a, b] = &mut probes;
    let wrong = a.run(&rays)?.iter().zip(&b.run(&rays)?).filter(|(a, b)| a.t.to_bits() != b.t.to_bits()).count();
    Ok(Measured::new(wrong as f64, format!("{} rays, 2000 triangles", rays.len())))
}

fn worst_depth(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = empty();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..400u32 {
        let size = 2f64.powi(-(i as i32 % 20));
        let at = v(size, 0.25 * size * f64::from(i / 20), -1.0 - size);
        positions.extend(
            [at, at + v(0.3 * size, 0.0, 0.0), at + v(0.0, 0.2 * size, 0.05 * size)].map(|p| p.as_vec3().as_dvec3()),
        );
        triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    scene.mesh(&positions, &triangles, diffuse(0.5));
    let depth = lab.closest(&scene)?.bvh_depth();
    if depth > crate::accel::MAX_DEPTH {
        return Ok(Measured::new(f64::INFINITY, format!("depth {depth}")));
    }
    let rays = |scale| aimed(&scene, 1.0, scale, &mut Rng::new(38), lab.size(1 << 15, 1 << 22));
    let (wrong, traced) = compare(lab, &scene, &rays)?;
    Ok(Measured::new(wrong as f64, format!("{traced} rays, depth {depth}")))
}

fn identical(lab: &Lab) -> Result<Measured, CheckError> {
    let corners = [v(-1.0, -1.0, -3.0), v(1.0, -0.75, -3.5), v(0.25, 1.0, -2.5)];
    let copies = lab.size(100_000, 1_000_000);
    let scene = |n: usize| {
        let mut scene = empty();
        scene.mesh(&corners, &vec![[0, 1, 2]; n], diffuse(0.5));
        scene.light(v(1.0, 2.0, 1.0), 100.0);
        // One sample a pixel: 1e5 boxes on every ray's way.
        scene.size(8, 1);
        scene
    };
    // Few watertight triangles would be held in constants instead of the BVH.
    let render = |n: usize| {
        let scene = scene(n);
        lab.render_with(&scene, &RenderSettings { triangle_test: TriangleTest::MollerTrumbore, ..lab.settings(&scene) })
    };
    let one = render(1)?;
    let many = render(copies)?;
    let lit = one.channel(0).iter().filter(|&&x| x > 0.0).count();
    if lit == 0 {
        return Ok(Measured::new(f64::INFINITY, "the triangle is not in the image"));
    }
    Ok(Measured::new(one.differing(&many) as f64, format!("{copies} triangles, {lit} lit pixels")))
}

fn large(lab: &Lab) -> Result<Measured, CheckError> {
    let (positions, triangles) = icosphere(v(0.0, 0.0, 0.0), 1.0, 9);
    // Two of them are 1.05e7 triangles.
    let mut scene = empty();
    scene.mesh(&positions, &triangles, diffuse(0.5));
    let outer: Vec<DVec3> = positions.iter().map(|p| 2.0 * *p).collect();
    scene.mesh(&outer, &triangles, diffuse(0.5));
    let mut probe = match lab.closest(&scene) {
        Ok(probe) => probe,
        Err(CheckError::Gpu(error @ (crate::GpuError::TooLarge { .. } | crate::GpuError::OutOfMemory { .. }))) => {
            return Ok(Measured::new(0.0, error.to_string()));
        }
        Err(error) => return Err(error),
    };
    let mut rng = Rng::new(39);
    let rays: Vec<_> = (0..1 << 20).map(|_| RayInput::new(Vec3::ZERO, rng.direction32())).collect();
    let missed = probe.run(&rays)?.iter().filter(|hit| hit.id < 0).count();
    Ok(Measured::new(missed as f64, format!("{} rays, {} triangles", rays.len(), scene.triangle_count())))
}

fn non_finite_rays(lab: &Lab) -> Result<(f64, f64, String), CheckError> {
    let mut rng = Rng::new(37);
    let scene = soup(&mut rng, 4000);
    let mut probe = lab.closest(&scene)?;
    let ordinary = aimed(&scene, 1.0, probe.scale(), &mut rng, 1 << 12);
    let mean = |hits: &[HitRecord]| hits.iter().map(|h| f64::from(h.steps)).sum::<f64>() / hits.len() as f64;
    let usual = mean(&probe.run(&ordinary)?);
    let (mut hits, mut most) = (0usize, 0.0f64);
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let directions = [[nan; 3], [nan, 1.0, 0.0], [inf, 0.0, 0.0], [inf; 3], [-inf, inf, 1.0]];
    let mut kinds: Vec<(Vec3, Vec3)> = directions.iter().map(|d| (Vec3::ZERO, Vec3::from(*d))).collect();
    // Zeros of both signs: their reciprocals, were they infinite, would have every box of an octant met at infinity.
    let zero = |signs: u32| Vec3::from([0, 1, 2].map(|i| if signs >> i & 1 == 0 { 0.0 } else { -0.0 }));
    kinds.extend((0..8).map(|signs| (Vec3::ZERO, zero(signs))));
    kinds.extend([(Vec3::splat(nan), Vec3::X), (Vec3::new(0.0, nan, 0.0), Vec3::new(0.6, 0.0, -0.8))]);
    for &(origin, direction) in &kinds {
        let records = probe.run(&vec![RayInput::new(origin, direction); 64])?;
        hits += records.iter().filter(|r| r.id >= 0).count();
        most = worst([most, mean(&records) / usual]);
    }
    Ok((hits as f64, most, format!("{} kinds; ordinary rays take {usual:.0} steps", kinds.len())))
}
