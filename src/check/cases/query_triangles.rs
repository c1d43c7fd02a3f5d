//! Ray queries in which the device tests triangles itself: what it finds, how far that is from our own test, and how it is built.

use glam::DVec3;

use crate::check::cases::bvh::{aimed, differ};
use crate::check::cases::query::{by_bvh, by_queries_as, paths_by, rooms, scenes};
use crate::check::cases::triangles::edge_leaks;
use crate::check::probe::{HitRecord, RayInput, audit};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, empty, icosphere, v};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::gpu::{AccelerationStructure, GpuError};
use crate::oracle::Primitive;
use crate::render::{Accel, QueryBuild, RenderSettings, Reuse, SampleMap};
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "query/triangles",
        what: "rays at inner points of triangles, which the device tests itself: of a soup with spheres, a mesh, specks, surfaces with alpha",
        oracle: "the software BVH",
        quantity: "rays that meet another triangle at another distance, by 16 ulp",
        threshold: 0.0,
        full_only: false,
        measure: inner_points,
    },
    Case {
        name: "query/triangle-leaks",
        what: "rays from within closed meshes at their edges, of triangles that the device tests, from 1 to 1e4 times their size away from the camera",
        oracle: "closed: every ray hits, up to what the specification lets drivers do at edges",
        quantity: "share of rays that leak",
        threshold: 1e-3,
        full_only: false,
        measure: leaks,
    },
    Case {
        name: "query/triangle-paths",
        what: "paths of 6 hits among glass, mirrors and emitters, by triangles that the device tests",
        oracle: "the same paths by the software BVH",
        quantity: "share of hits with their shadow ray and the next ray that differ in any bit",
        threshold: 1e-3,
        full_only: false,
        measure: |lab| {
            let [wrong, traced] = paths_by(lab, Accel::RayQueryTriangles)?;
            Ok(Measured::new(wrong as f64 / traced as f64, format!("{wrong} of {traced} hits, 2 scenes")))
        },
    },
    Case {
        name: "query/triangle-images",
        what: "images of rooms with spheres, meshes, emitters, glass and mirrors, by triangles that the device tests",
        oracle: "the image by the software BVH",
        quantity: "share of pixels that differ",
        threshold: 0.01,
        full_only: false,
        measure: images,
    },
    Case {
        name: "query/triangles-left",
        what: "rays from behind the triangle that they leave: of any hit, of the nearest",
        oracle: "the software BVH",
        quantity: "rays that meet the triangle they leave, or another than the BVH has",
        threshold: 0.0,
        full_only: false,
        measure: left,
    },
    Case {
        name: "query/audit",
        what: "all triangles that rays meet, at vertices, edges and inner points of meshes near and far",
        oracle: "our own test of each triangle",
        quantity: "triangles that only one of both says are met, farther from edges than rounding moves them",
        threshold: 0.0,
        full_only: false,
        measure: audited,
    },
    Case {
        name: "query/build",
        what: "structures that are compacted, of leaves in a random order, in scratch memory that is just aligned; of 1e5 equal triangles, of triangles without area; too many",
        oracle: "the same hits; too many are refused, by the limit",
        quantity: "rays whose t or primitive differs, and refusals that are lacking",
        threshold: 0.0,
        full_only: false,
        measure: builds,
    },
];

/// Units in the last place by which distances may differ where triangles meet.
const CLOSE: i64 = 16;

fn are_close(a: f32, b: f32) -> bool {
    (i64::from(a.to_bits()) - i64::from(b.to_bits())).abs() <= CLOSE
}

/// Whether two hits are not even of neighbours.
fn are_apart(a: &HitRecord, b: &HitRecord) -> bool {
    differ(a, b) && (a.id < 0 || b.id < 0 || !are_close(a.t, b.t))
}

/// Points well within triangles of the first mesh, and whose they are.
fn inner_point(scene: &Scene, rng: &mut Rng) -> (DVec3, usize) {
    let mesh = &scene.meshes[0];
    let triangle = rng.below(mesh.triangles.len());
    let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.positions[i as usize]);
    (a.lerp(b, rng.between(0.2, 0.8)).lerp(c, rng.between(0.2, 0.8)), triangle)
}

/// Rays at such points, from a cube around the camera.
fn aimed_within(scene: &Scene, from: f64, scale: f64, rng: &mut Rng, count: usize) -> Vec<(RayInput, usize)> {
    let ray = |rng: &mut Rng| {
        let origin = (scale * from * rng.in_cube(2.0)).as_vec3();
        let (target, triangle) = inner_point(scene, rng);
        let direction = (scale * target - origin.as_dvec3()).normalize().as_vec3();
        (RayInput::new(origin, direction), triangle)
    };
    (0..count).map(|_| ray(rng)).collect()
}

fn rays_within(scene: &Scene, from: f64, scale: f64, rng: &mut Rng, count: usize) -> Vec<RayInput> {
    aimed_within(scene, from, scale, rng, count).into_iter().map(|(ray, _)| ray).collect()
}

fn inner_points(lab: &Lab) -> Result<Measured, CheckError> {
    let count = lab.size(1 << 15, 1 << 20);
    let [mut wrong, mut traced] = [0; 2];
    for (scene, from) in scenes() {
        let mut queried = by_queries_as(lab, Accel::RayQueryTriangles)?.closest(&scene)?;
        let mut traversed = by_bvh(lab).closest(&scene)?;
        let aimed = aimed_within(&scene, from, queried.scale(), &mut Rng::new(55), count);
        let rays: Vec<_> = aimed.iter().map(|(ray, _)| *ray).collect();
        let (found, expected) = (queried.run(&rays)?, traversed.run(&rays)?);
        for ((found, expected), (_, triangle)) in found.iter().zip(&expected).zip(&aimed) {
            // What lies before the triangle may be met at an edge.
            if traversed.primitive(expected.id) == Some(Primitive::Triangle(0, *triangle)) {
                wrong += usize::from(are_apart(found, expected));
                traced += 1;
            }
        }
    }
    Ok(Measured::new(wrong as f64, format!("{traced} rays, 6 scenes")))
}

fn leaks(lab: &Lab) -> Result<Measured, CheckError> {
    let count = lab.size(3 << 16, 100_000_000);
    let leaks = edge_leaks(&by_queries_as(lab, Accel::RayQueryTriangles)?, &[1.0, 1e2, 1e4], count)?;
    Ok(Measured::new(leaks.value / count as f64, format!("{} of {}", leaks.value, leaks.detail)))
}

fn images(lab: &Lab) -> Result<Measured, CheckError> {
    let [queries, traverses] = [by_queries_as(lab, Accel::RayQueryTriangles)?, by_bvh(lab)];
    let (mut wrong, mut pixels) = (0, 0);
    for mut scene in rooms() {
        scene.size(lab.size(32, 128) as u32, 4);
        let [queried, traversed] = [&queries, &traverses].map(|lab| {
            // What pixels have in common spreads differences.
            let own = RenderSettings { reuse: Reuse::Off, sample_map: SampleMap::Off, ..lab.settings(&scene) };
            lab.render_with(&scene, &RenderSettings { samples: 4, ..own })
        });
        let (queried, traversed) = (queried?, traversed?);
        wrong += queried.differing(&traversed);
        pixels += traversed.film.counts().len();
    }
    Ok(Measured::new(wrong as f64 / pixels as f64, format!("{wrong} of {pixels} pixels, 2 scenes")))
}

fn left(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(57);
    // A mesh within another: there is something behind each triangle.
    let mut scene = empty();
    for radius in [0.5, 1.0] {
        let (positions, triangles) = icosphere(v(0.1, 0.2, -0.5), radius, 2);
        scene.mesh(&positions, &triangles, diffuse(0.5));
    }
    let queries = by_queries_as(lab, Accel::RayQueryTriangles)?;
    let (mut queried, mut traversed) = (queries.closest(&scene)?, by_bvh(lab).closest(&scene)?);
    let at = rays_within(&scene, 0.1, queried.scale(), &mut rng, lab.size(1 << 15, 1 << 20));
    // They start at what a first ray meets, a little before it.
    let rays: Vec<_> = at
        .iter()
        .zip(&traversed.run(&at)?)
        .filter(|(_, hit)| hit.id >= 0)
        .map(|(ray, hit)| {
            let along = 0.99 * hit.t;
            let origin = std::array::from_fn(|i| ray.origin[i] + along * ray.direction[i]);
            RayInput { origin, self_id: hit.self_id, t_max: 4.0 * (rng.uniform() as f32), ..*ray }
        })
        .collect();
    let (found, expected) = (queried.run(&rays)?, traversed.run(&rays)?);
    let mut wrong = found
        .iter()
        .zip(&expected)
        .zip(&rays)
        .filter(|((a, b), ray)| are_apart(a, b) || (a.id >= 0 && a.self_id == ray.self_id))
        .count();
    let (hidden, expected) = (queries.occluded(&scene)?.run(&rays)?, by_bvh(lab).occluded(&scene)?.run(&rays)?);
    wrong += hidden.iter().zip(&expected).filter(|(a, b)| a.hidden != b.hidden).count();
    let count = expected.iter().filter(|record| record.hidden != 0).count();
    Ok(Measured::new(wrong as f64, format!("{} rays, twice; {count} hidden", rays.len())))
}

fn audited(lab: &Lab) -> Result<Measured, CheckError> {
    let queries = by_queries_as(lab, Accel::RayQueryTriangles)?;
    let of = |center: DVec3, radius: f64| {
        let mut scene = empty();
        let (positions, triangles) = icosphere(center, radius, 2);
        scene.mesh(&positions, &triangles, diffuse(0.5));
        scene.light(v(2.0, 1.0, 3.0), 1.0);
        scene
    };
    let scenes = [
        (of(v(0.1, 0.2, -0.5), 1.0), 1.0),
        (of(v(2.5, -1.5, -2.0), 1e-2), 1e-3),
        (of(v(1e-5, 2e-5, -3e-5), 1e-3), 0.8),
    ];
    let count = lab.size(1 << 13, 1 << 20);
    let [mut met, mut at_edges, mut extra, mut missed] = [0u64; 4];
    let (mut worst_t, mut worst_barycentric) = (0, 0f32);
    for (scene, from) in &scenes {
        let rays = |scale| aimed(scene, *from, scale, &mut Rng::new(58), count);
        for record in audit(&queries.context, scene, &queries.settings(scene), &rays)? {
            met += u64::from(record.proposed);
            at_edges += u64::from(record.at_edges);
            extra += u64::from(record.extra);
            missed += u64::from(record.missed);
            worst_t = worst_t.max(record.worst_t);
            worst_barycentric = worst_barycentric.max(record.worst_barycentric);
        }
    }
    let detail = format!(
        "{met} triangles proposed, {at_edges} of them at edges; {extra} extra, {missed} missed; t differs by up to {worst_t} ulp, \
         barycentrics by {worst_barycentric:.1e}"
    );
    Ok(Measured::new((extra + missed) as f64, detail))
}

fn builds(lab: &Lab) -> Result<Measured, CheckError> {
    let (mut wrong, mut traced) = (0, 0);
    let count = lab.size(1 << 14, 1 << 20);
    // What lies on top of each other, and what has no area.
    let mut heap = empty();
    let corners = [v(-1.0, -1.0, -3.0), v(1.0, -0.75, -3.5), v(0.25, 1.0, -2.5), v(0.0, 0.0, -4.0)];
    let mut triangles = vec![[0, 1, 2]; 100_000];
    triangles.extend((0..1000).map(|i| [[0, 1, 1], [2, 2, 2], [3, 3, 1], [1, 0, 3]][i % 4]));
    heap.mesh(&corners, &triangles, diffuse(0.5));
    let scenes = scenes();
    let compared = [
        (Accel::RayQuery, &heap, 1.0, 64),
        (Accel::RayQuery, &scenes[0].0, 1.0, count),
        (Accel::RayQueryTriangles, &scenes[1].0, 0.5, count),
    ];
    for (accel, scene, from, count) in compared {
        let queries = by_queries_as(lab, accel)?;
        let found = |build: QueryBuild| {
            let mut probe =
                queries.closest_with(scene, &RenderSettings { query_build: build, ..queries.settings(scene) })?;
            probe.run(&rays_within(scene, from, probe.scale(), &mut Rng::new(59), count))
        };
        // By the BVH, and as suits the device: of triangles, which of those at one distance is found is the device's.
        let expected = match accel {
            Accel::RayQuery => {
                let mut probe = by_bvh(lab).closest(scene)?;
                probe.run(&rays_within(scene, from, probe.scale(), &mut Rng::new(59), count))?
            }
            _ => found(QueryBuild::Plain)?,
        };
        for build in [QueryBuild::Plain, QueryBuild::Compacted, QueryBuild::Shuffled, QueryBuild::ShiftedScratch] {
            wrong += found(build)?.iter().zip(&expected).filter(|(a, b)| are_apart(a, b)).count();
            traced += count;
        }
    }
    let device = &lab.context.0;
    let limit = device.ray_queries()?.limits.max_primitives;
    let refused = AccelerationStructure::check_count(device, "boxes", limit + 1);
    let is_named = matches!(&refused, Err(GpuError::TooManyPrimitives { limit: told, .. }) if *told == limit);
    let is_lacking = !is_named || AccelerationStructure::check_count(device, "boxes", limit).is_err();
    wrong += usize::from(is_lacking);
    Ok(Measured::new(wrong as f64, format!("{traced} rays; at most {limit} primitives")))
}
