//! Rays against closed meshes, aimed where they could leak.

use glam::DVec3;

use crate::check::probe::RayInput;
use crate::check::rng::Rng;
use crate::check::scenes::{Build, cuboid, diffuse, empty, grid, icosphere, v};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::render::{RenderSettings, TriangleTest};
use crate::scene::Scene;

use crate::check::cases::bvh::{differ, point_of, soup};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "triangles/edges",
        what: "rays from inside closed meshes at points of their edges",
        oracle: "closed: every ray hits",
        quantity: "rays that leak",
        threshold: 0.0,
        full_only: false,
        measure: |lab| leaks(lab, &closed(DVec3::ZERO, 1.0), Aim::Edges, lab.size(1 << 18, 100_000_000)),
    },
    Case {
        name: "triangles/vertices",
        what: "the same, at their vertices",
        oracle: "closed: every ray hits",
        quantity: "rays that leak",
        threshold: 0.0,
        full_only: false,
        measure: |lab| leaks(lab, &closed(DVec3::ZERO, 1.0), Aim::Vertices, lab.size(1 << 18, 100_000_000)),
    },
    Case {
        name: "triangles/far-offset",
        what: "a tessellated sphere of radius 2 at (148376, 1234, −223423), camera at the origin",
        oracle: "closed: every ray hits",
        quantity: "rays that leak",
        threshold: 0.0,
        full_only: false,
        measure: |lab| {
            let far = v(148_376.0, 1234.0, -223_423.0);
            // Rounding is a third of the body: rays meet most of its boxes, and take fifty times as long as others.
            leaks(lab, &[(icosphere(far, 2.0, 4), far, 0.5)], Aim::Edges, lab.size(1 << 18, 10_000_000))
        },
    },
    Case {
        name: "triangles/subdivided",
        what: "rays through a tilted square of 2048 triangles",
        oracle: "every ray through it hits",
        quantity: "rays that leak",
        threshold: 0.0,
        full_only: false,
        measure: subdivided,
    },
    Case {
        name: "triangles/two-tests",
        what: "the watertight test against Möller–Trumbore, away from edges",
        oracle: "another algorithm",
        quantity: "share of rays whose triangle, or whose t beyond 1e-5, differs",
        threshold: 1e-5,
        full_only: false,
        measure: two_tests,
    },
    Case {
        name: "triangles/degenerate",
        what: "closed meshes (in constants, and in the BVH) among triangles without area in single precision",
        oracle: "the mesh alone",
        quantity: "rays that hit something else, or at another t beyond 1e-5",
        threshold: 0.0,
        full_only: false,
        measure: degenerate,
    },
    Case {
        name: "triangles/non-finite",
        what: "scenes with NaN or infinite vertices, spheres and lights",
        oracle: "all are refused",
        quantity: "scenes that are accepted",
        threshold: 0.0,
        full_only: false,
        measure: non_finite,
    },
    Case {
        name: "triangles/quick-polygons",
        what: "rays at and along the edges of boxes, slivers and triangles in constants, from near and far",
        oracle: "their exact test on the device",
        quantity: "rays whose t or polygon differs",
        threshold: 0.0,
        full_only: false,
        measure: quick_polygons,
    },
    Case {
        name: "triangles/duplicates",
        what: "coplanar copies of a triangle, alone and among others",
        oracle: "the first of them in the scene is hit",
        quantity: "rays that hit another copy",
        threshold: 0.0,
        full_only: false,
        measure: duplicates,
    },
];

type Mesh = (Vec<DVec3>, Vec<[u32; 3]>);

#[derive(Clone, Copy, PartialEq)]
enum Aim {
    Edges,
    Vertices,
}

/// Closed meshes, each with a point inside and the radius of a ball around it that is inside too.
fn closed(center: DVec3, scale: f64) -> Vec<(Mesh, DVec3, f64)> {
    let box_center = center + scale * v(0.1, -0.2, 0.3);
    let (lo, hi) = (box_center - scale * v(0.7, 0.9, 1.1), box_center + scale * v(0.8, 1.3, 0.6));
    let single = |(positions, triangles): Mesh| -> Mesh {
        (positions.iter().map(|p| p.as_vec3().as_dvec3()).collect(), triangles)
    };
    vec![
        (icosphere(center, scale, 0), center, 0.5 * scale),
        (icosphere(center + scale * v(0.3, 0.1, -0.2), 1.3 * scale, 4), center, 0.5 * scale),
        (single(cuboid(lo, hi)), box_center, 0.5 * scale),
    ]
}

/// Rays from within closed meshes at their edges, so many times their size away from the camera.
pub(super) fn edge_leaks(lab: &Lab, distances: &[f64], total: usize) -> Result<Measured, CheckError> {
    let meshes: Vec<_> = distances.iter().flat_map(|distance| closed(*distance * v(0.6, 0.3, -0.7), 1.0)).collect();
    leaks(lab, &meshes, Aim::Edges, total)
}

fn leaks(lab: &Lab, meshes: &[(Mesh, DVec3, f64)], aim: Aim, total: usize) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(26);
    let (mut missed, mut traced) = (0usize, 0usize);
    for ((positions, triangles), center, ball) in meshes {
        let mut scene = empty();
        scene.mesh(positions, triangles, diffuse(0.5));
        let mut probe = lab.closest(&scene)?;
        let scale = probe.scale();
        let mut left = total / meshes.len();
        while left > 0 {
            let rays: Vec<RayInput> = (0..left.min(1 << 20))
                .map(|_| {
                    let [a, b, _] = triangles[rng.below(triangles.len())].map(|i| positions[i as usize]);
                    let target = if aim == Aim::Edges { a.lerp(b, rng.uniform()) } else { a };
                    let origin = (scale * (*center + *ball * rng.in_ball())).as_vec3();
                    let direction = (scale * target - origin.as_dvec3()).normalize().as_vec3();
                    RayInput::new(origin, direction)
                })
                .collect();
            missed += probe.run(&rays)?.iter().filter(|hit| hit.id < 0).count();
            traced += rays.len();
            left -= rays.len();
        }
    }
    Ok(Measured::new(missed as f64, format!("{traced} rays, {} mesh(es)", meshes.len())))
}

fn subdivided(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(29);
    let (x, y, center) = (v(1.0, 0.3, -0.2), v(-0.1, 0.9, 0.45), v(0.3, -0.2, -5.0));
    let (positions, triangles) = grid(center, x, y, 32);
    let mut scene = empty();
    scene.mesh(&positions, &triangles, diffuse(0.5));
    let mut probe = lab.closest(&scene)?;
    let scale = probe.scale();
    let step = |rng: &mut Rng| f64::from(rng.below(65) as u32) / 32.0 - 1.0;
    let rays: Vec<RayInput> = (0..lab.size(1 << 18, 1 << 24))
        .map(|i| {
            // Half of them at vertices and edge middles of the grid, well inside of the square.
            let inner = 0.96875;
            let (a, b) = if i % 2 == 0 {
                (inner * step(&mut rng), inner * step(&mut rng))
            } else {
                (rng.between(-inner, inner), rng.between(-inner, inner))
            };
            let origin = (scale * rng.in_cube(1.0)).as_vec3();
            let target = scale * (center + a * x + b * y);
            RayInput::new(origin, (target - origin.as_dvec3()).normalize().as_vec3())
        })
        .collect();
    let missed = probe.run(&rays)?.iter().filter(|hit| hit.id < 0).count();
    Ok(Measured::new(missed as f64, format!("{} rays", rays.len())))
}

fn two_tests(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(30);
    let (positions, triangles) = icosphere(v(0.0, 0.0, -3.0), 1.0, 3);
    let mut scene = empty();
    scene.mesh(&positions, &triangles, diffuse(0.5));
    let settings = lab.settings(&scene);
    let other = RenderSettings { triangle_test: TriangleTest::MollerTrumbore, ..settings.clone() };
    let mut probes = [lab.closest_with(&scene, &settings)?, lab.closest_with(&scene, &other)?];
    let scale = probes[0].scale();
    let rays: Vec<RayInput> = (0..lab.size(1 << 18, 1 << 22))
        .map(|_| {
            // A point well inside of a triangle that faces the origin: the sphere is convex, so that it is the hit.
            let origin = (scale * rng.in_cube(1.0)).as_vec3();
            let target = loop {
                let corners = triangles[rng.below(triangles.len())].map(|i| positions[i as usize]);
                let [a, b] = [rng.between(0.05, 0.45), rng.between(0.05, 0.45)];
                let target = corners[0] * (1.0 - a - b) + corners[1] * a + corners[2] * b;
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
                let to = scale * target - origin.as_dvec3();
                if to.normalize().dot(normal) < -0.05 {
                    break target;
                }
            };
            RayInput::new(origin, (scale * target - origin.as_dvec3()).normalize().as_vec3())
        })
        .collect();
    let [ours, theirs] = &mut probes;
    let differ = ours
        .run(&rays)?
        .iter()
        .zip(theirs.run(&rays)?)
        .filter(|(a, b)| a.id != b.id || (a.t - b.t).abs() > 1e-5 * a.t)
        .count();
    Ok(Measured::new(differ as f64 / rays.len() as f64, format!("{differ} of {} rays", rays.len())))
}

fn degenerate(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(32);
    let (mut differ, mut traced) = (0, 0);
    // A mesh that is held in constants and one in the BVH.
    for (levels, flat) in [(0, 40), (2, 300)] {
        let (positions, triangles) = icosphere(v(0.0, 0.0, -3.0), 1.0, levels);
        let mut alone = empty();
        alone.mesh(&positions, &triangles, diffuse(0.5));
        let mut among = alone.clone();
        let mesh = &mut among.meshes[0];
        for i in 0..flat {
            add_degenerate(mesh, i, v(0.0, 0.0, -3.0) + 1.5 * rng.in_ball());
        }
        let mut probes = [lab.closest(&alone)?, lab.closest(&among)?];
        let points = &among.meshes[0].positions;
        let rays: Vec<(DVec3, DVec3)> = (0..lab.size(1 << 16, 1 << 22))
            .map(|_| {
                let origin = rng.in_cube(0.5).as_vec3().as_dvec3();
                (origin, (points[rng.below(points.len())] - origin).normalize())
            })
            .collect();
        let mut hits = Vec::new();
        for probe in &mut probes {
            let scale = probe.scale();
            let inputs: Vec<_> = rays.iter().map(|(o, d)| RayInput::new((scale * *o).as_vec3(), d.as_vec3())).collect();
            let records = probe.run(&inputs)?;
            hits.push(records.iter().map(|r| (f64::from(r.t) / scale, r.id < 0)).collect::<Vec<_>>());
            let added =
                |primitive| matches!(primitive, Some(crate::oracle::Primitive::Triangle(_, t)) if t >= triangles.len());
            if records.iter().any(|r| added(probe.primitive(r.id))) {
                return Ok(Measured::new(f64::INFINITY, "a degenerate triangle was hit"));
            }
        }
        // Two programs, in which a driver may contract products and sums in different ways.
        let differs = |a: &(f64, bool), b: &(f64, bool)| a.1 != b.1 || (!a.1 && (a.0 - b.0).abs() > 1e-5 * a.0);
        differ += hits[0].iter().zip(&hits[1]).filter(|(a, b)| differs(a, b)).count();
        traced += rays.len();
    }
    Ok(Measured::new(differ as f64, format!("{traced} rays, 40 and 300 degenerate triangles")))
}

/// Adds a triangle that has no area, or none in single precision.
fn add_degenerate(mesh: &mut crate::scene::Mesh, i: u32, at: DVec3) {
    let n = mesh.positions.len() as u32;
    let at = at.as_vec3().as_dvec3();
    let corners = match i % 4 {
        // A point, and a line with a point twice.
        0 => [i % 12; 3],
        1 => [i % 12, i % 12, (i + 5) % 12],
        // Three points of a line along an axis.
        2 => {
            mesh.positions.extend([at, at + v(0.25, 0.0, 0.0), at + v(0.5, 0.0, 0.0)]);
            [n, n + 1, n + 2]
        }
        // Smaller than what single precision tells apart, by itself or from where rays start.
        _ => {
            let at = if i % 8 == 3 { at } else { 1e-12 * at };
            mesh.positions.extend([at, at + v(1e-12, 0.0, 0.0), at + v(0.0, 1e-12, 0.0)]);
            [n, n + 1, n + 2]
        }
    };
    mesh.triangles.push(corners);
    mesh.triangle_materials.push(0);
}

fn non_finite(_lab: &Lab) -> Result<Measured, CheckError> {
    let mut accepted = 0;
    let mut tried = 0;
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308] {
        let edits: [fn(&mut Scene, f64); 6] = [
            |s, x| s.meshes[0].positions[1].y = x,
            |s, x| s.spheres[0].center.z = x,
            |s, x| s.spheres[0].radius = x,
            |s, x| s.camera.position.x = x,
            |s, x| s.lights[0] = crate::scene::Light::Point { position: v(x, 0.0, 0.0), power: [1.0; 3] },
            |s, x| s.background[2] = x,
        ];
        for edit in edits {
            let mut scene = crate::check::scenes::room();
            edit(&mut scene, bad);
            tried += 1;
            accepted += usize::from(scene.validate().is_ok());
        }
    }
    Ok(Measured::new(f64::from(accepted as u32), format!("{tried} scenes")))
}

fn quick_polygons(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(47);
    // One mesh: a room, a box on its floor, and a plate.
    let mut boxes = empty();
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    for (lo, hi) in [
        (v(-1.0, -1.0, -1.0), v(1.5, 1.0, 2.0)),
        (v(-0.5, -1.0, 0.25), v(0.25, 0.125, 0.75)),
        (v(0.5, -0.5, 0.5), v(0.501, 0.5, 1.0)),
    ] {
        let (corners, triangles) = cuboid(lo, hi);
        indices.extend(triangles.iter().map(|t| t.map(|i| i + positions.len() as u32)));
        positions.extend(corners);
    }
    boxes.mesh(&positions, &indices, diffuse(0.5));
    let (mut wrong, mut traced, mut hits) = (0, 0, 0);
    for scene in [boxes, soup(&mut rng, 30)] {
        let mut quick = lab.closest(&scene)?;
        let mut exact = lab.closest_polygons(&scene)?;
        let scale = quick.scale();
        let rays: Vec<_> = (0..lab.size(1 << 17, 1 << 24))
            .map(|i| {
                // From anywhere; from afar; and from points of the polygons, so that rays run along planes and edges.
                let origin = match i % 4 {
                    0 => rng.in_cube(2.0),
                    1 => 10f64.powf(rng.between(1.0, 5.0)) * rng.direction(),
                    2 => point_of(&scene, &mut rng),
                    _ => point_of(&scene, &mut rng) + 10f64.powf(rng.between(-8.0, -2.0)) * rng.direction(),
                };
                let origin = (scale * origin).as_vec3();
                let target = scale * point_of(&scene, &mut rng);
                let to = target - origin.as_dvec3();
                RayInput::new(origin, to.try_normalize().unwrap_or(DVec3::X).as_vec3())
            })
            .collect();
        let (a, b) = (quick.run(&rays)?, exact.run(&rays)?);
        wrong += a.iter().zip(&b).filter(|(a, b)| differ(a, b)).count();
        hits += b.iter().filter(|h| h.id >= 0).count();
        traced += rays.len();
    }
    if hits < traced / 8 {
        return Ok(Measured::new(f64::INFINITY, format!("only {hits} of {traced} rays hit")));
    }
    Ok(Measured::new(wrong as f64, format!("{traced} rays, 2 scenes, {hits} hits")))
}

fn duplicates(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(36);
    let (mut wrong, mut traced) = (0usize, 0usize);
    for copies in [2u32, 7, 64] {
        let mut scene = empty();
        let corners = [v(-1.0, -1.0, -4.0), v(1.0, -0.75, -4.5), v(0.25, 1.0, -3.5)];
        let others = icosphere(v(0.0, 0.0, -6.0), 0.5, 1);
        let mut triangles = others.1.clone();
        let mut positions = others.0.clone();
        let n = positions.len() as u32;
        positions.extend(corners);
        let first = triangles.len();
        triangles.extend(vec![[n, n + 1, n + 2]; copies as usize]);
        scene.mesh(&positions, &triangles, diffuse(0.5));
        let mut probe = lab.closest(&scene)?;
        let scale = probe.scale();
        let rays: Vec<_> = (0..1 << 12)
            .map(|_| {
                let (a, b) = (rng.between(0.05, 0.45), rng.between(0.05, 0.45));
                let target = corners[0] * (1.0 - a - b) + corners[1] * a + corners[2] * b;
                let origin = (scale * rng.in_cube(0.25)).as_vec3();
                RayInput::new(origin, (scale * target - origin.as_dvec3()).normalize().as_vec3())
            })
            .collect();
        let hits = probe.run(&rays)?;
        traced += rays.len();
        let expected = Some(crate::oracle::Primitive::Triangle(0, first));
        wrong += hits.iter().filter(|hit| probe.primitive(hit.id) != expected).count();
    }
    Ok(Measured::new(wrong as f64, format!("{traced} rays, 2 to 64 copies")))
}
