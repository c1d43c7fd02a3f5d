//! The device's ray queries against the software BVH, under the same tests of primitives and the same shading: what a query does not
//! propose is missed.

use glam::Vec3;

use crate::check::cases::bvh::{aimed, axis_rays, differ, lattice, soup};
use crate::check::cases::materials::coverage;
use crate::check::cases::triangles::edge_leaks;
use crate::check::lab::pixels_that_differ;
use crate::check::probe::{HitRecord, OcclusionRecord, PathInput, PathRecord, RayInput};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, divided_room, emitters, empty, glass, icosphere, mirror, v};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::render::{Accel, RenderSettings};
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "query/closest",
        what: "rays at vertices, edges and inner points: of a soup with spheres, a mesh, specks near and far, what is far from the start of rays, surfaces with alpha",
        oracle: "the software BVH",
        quantity: "rays whose t or primitive differs",
        threshold: 0.0,
        full_only: false,
        measure: closest,
    },
    Case {
        name: "query/axis-aligned",
        what: "axis-aligned rays with components +0 and −0 on the faces of boxes, and 1 or 2 ulp beside them",
        oracle: "the software BVH",
        quantity: "rays whose t or primitive differs",
        threshold: 0.0,
        full_only: false,
        measure: axis_aligned,
    },
    Case {
        name: "query/leaks",
        what: "rays from within closed meshes at their edges, from 1 to 1e4 times their size away from the camera",
        oracle: "closed: every ray hits",
        quantity: "rays that leak",
        threshold: 0.0,
        full_only: false,
        measure: |lab| edge_leaks(&by_queries(lab)?, &[1.0, 1e2, 1e4], lab.size(3 << 16, 100_000_000)),
    },
    Case {
        name: "query/interval",
        what: "shadow rays that end at a hit, 1 ulp before or behind it, at 0, anywhere and nowhere",
        oracle: "the software BVH",
        quantity: "rays that one finds hidden and the other not",
        threshold: 0.0,
        full_only: false,
        measure: interval,
    },
    Case {
        name: "query/paths",
        what: "paths of 6 hits among glass, mirrors and emitters",
        oracle: "the same paths by the software BVH",
        quantity: "hits with their shadow ray and the next ray that differ in any bit",
        threshold: 0.0,
        full_only: false,
        measure: paths,
    },
    Case {
        name: "query/lanes",
        what: "subgroups of which any lanes query: the others have rays that are not finite, or miss all; dispatches of 1 to 70 rays",
        oracle: "the software BVH",
        quantity: "rays whose t or primitive differs",
        threshold: 0.0,
        full_only: false,
        measure: lanes,
    },
    Case {
        name: "query/image",
        what: "images of rooms with spheres, meshes, emitters, glass and mirrors, with and without shared paths",
        oracle: "the image by the software BVH",
        quantity: "pixels that differ",
        threshold: 0.0,
        full_only: false,
        measure: image,
    },
];

/// The same lab with ray queries.
fn by_queries(lab: &Lab) -> Result<Lab, CheckError> {
    by_queries_as(lab, Accel::RayQuery)
}

/// The same lab with ray queries of some kind.
pub(super) fn by_queries_as(lab: &Lab, accel: Accel) -> Result<Lab, CheckError> {
    lab.context.check_ray_queries().map_err(|_| CheckError::NotSupported("it has no ray queries".to_owned()))?;
    Ok(Lab { accel, ..lab.clone() })
}

/// The same lab without any error, and with the software BVH.
pub(super) fn by_bvh(lab: &Lab) -> Lab {
    Lab { accel: Accel::Bvh, mutation: None, ..lab.clone() }
}

/// Rays by queries and by the BVH that differ, and rays.
fn compare(lab: &Lab, scene: &Scene, rays: &dyn Fn(f64) -> Vec<RayInput>) -> Result<[usize; 2], CheckError> {
    let mut queried = by_queries(lab)?.closest(scene)?;
    let mut traversed = by_bvh(lab).closest(scene)?;
    let rays = rays(queried.scale());
    Ok([count_different(&queried.run(&rays)?, &traversed.run(&rays)?), rays.len()])
}

fn count_different(queried: &[HitRecord], traversed: &[HitRecord]) -> usize {
    queried.iter().zip(traversed).filter(|(a, b)| differ(a, b)).count()
}

fn sum(all: impl IntoIterator<Item = Result<[usize; 2], CheckError>>) -> Result<[usize; 2], CheckError> {
    all.into_iter().try_fold([0; 2], |[wrong, traced], one| one.map(|[w, n]| [wrong + w, traced + n]))
}

/// Scenes of which rounding asks most, and one with alpha; and how far from the camera rays at them start.
pub(super) fn scenes() -> [(Scene, f64); 6] {
    let mut rng = Rng::new(35);
    let mut spheres = soup(&mut rng, 300);
    for _ in 0..60 {
        let radius = 10f64.powf(rng.between(-2.0, -0.5));
        spheres.sphere((v(0.0, 0.0, -1.0) + rng.in_cube(1.0)).as_vec3().as_dvec3(), radius, diffuse(0.5));
    }
    let of = |center, radius, levels| {
        let mut scene = empty();
        let (positions, triangles) = icosphere(center, radius, levels);
        scene.mesh(&positions, &triangles, diffuse(0.5));
        scene
    };
    let speck = |center| {
        let mut scene = of(center, 1e-3, 3);
        scene.light(v(2.0, 1.0, 3.0), 1.0);
        scene
    };
    // Rays may start anywhere on a wall.
    let mut walled = of(v(0.1, 0.2, -0.25), 0.5, 3);
    walled.sphere(v(0.0, 0.0, -1000.0), 999.0, diffuse(0.5));
    [
        (spheres, 1.0),
        (walled, 250.0),
        (of(v(0.1, 0.2, -0.5), 1.0, 2), 0.5),
        (speck(v(1e-5, 2e-5, -3e-5)), 0.8),
        (speck(v(2.5, -1.5, -2.0)), 1e-3),
        (coverage(), 0.5),
    ]
}

fn closest(lab: &Lab) -> Result<Measured, CheckError> {
    let count = lab.size(1 << 16, 1 << 18);
    let batches = lab.size(1, 100);
    let of_scene = |(scene, from): &(Scene, f64), batch: usize| {
        compare(lab, scene, &|scale| aimed(scene, *from, scale, &mut Rng::new(50 + batch as u64), count))
    };
    let scenes = scenes();
    let [wrong, traced] = sum((0..batches).flat_map(|batch| scenes.iter().map(move |s| of_scene(s, batch))))?;
    Ok(Measured::new(wrong as f64, format!("{traced} rays, 6 scenes")))
}

fn axis_aligned(lab: &Lab) -> Result<Measured, CheckError> {
    let scene = lattice(&mut Rng::new(34));
    let batch = |batch: usize| compare(lab, &scene, &|scale| axis_rays(scale, 35 + batch as u64, 1 << 17));
    let [wrong, traced] = sum((0..lab.size(1, 64)).map(batch))?;
    Ok(Measured::new(wrong as f64, format!("{traced} rays, 40 boxes")))
}

fn interval(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(51);
    let (scene, from) = &scenes()[0];
    let mut closest = by_bvh(lab).closest(scene)?;
    let rays = aimed(scene, *from, closest.scale(), &mut rng, lab.size(1 << 16, 1 << 20));
    let ended = |(ray, hit): (&RayInput, &HitRecord)| {
        let t_max = match rng.below(6) {
            0 => hit.t,
            1 => hit.t.next_down(),
            2 => hit.t.next_up(),
            3 => 0.0,
            4 => (4.0 * rng.uniform()) as f32,
            _ => f32::INFINITY,
        };
        RayInput { t_max, ..*ray }
    };
    let rays: Vec<_> = rays.iter().zip(&closest.run(&rays)?).map(ended).collect();
    let hidden = |lab: &Lab| lab.occluded(scene)?.run(&rays);
    let is_hidden = |record: &OcclusionRecord| record.hidden;
    let (queried, traversed) = (hidden(&by_queries(lab)?)?, hidden(&by_bvh(lab))?);
    let wrong = queried.iter().zip(&traversed).filter(|(a, b)| is_hidden(a) != is_hidden(b)).count();
    let count = traversed.iter().filter(|record| record.hidden != 0).count();
    Ok(Measured::new(wrong as f64, format!("{} rays, {count} of them hidden", rays.len())))
}

/// Scenes with a BVH and surfaces of all kinds.
pub(super) fn rooms() -> [Scene; 2] {
    let mut crowded = divided_room();
    let (positions, triangles) = icosphere(v(1.5, 0.5, -6.0), 0.5, 2);
    crowded.mesh(&positions, &triangles, glass(1.5));
    let (positions, triangles) = icosphere(v(-1.5, -0.5, -6.5), 0.4, 2);
    crowded.mesh(&positions, &triangles, mirror(0.9));
    [crowded, emitters()]
}

fn paths(lab: &Lab) -> Result<Measured, CheckError> {
    let [wrong, traced] = paths_by(lab, Accel::RayQuery)?;
    Ok(Measured::new(wrong as f64, format!("{traced} hits, 2 scenes")))
}

/// Hits of paths that differ from those by the BVH, and hits.
pub(super) fn paths_by(lab: &Lab, accel: Accel) -> Result<[usize; 2], CheckError> {
    let mut rng = Rng::new(52);
    let queries = by_queries_as(lab, accel)?;
    let (mut wrong, mut traced) = (0, 0);
    for scene in rooms() {
        let (mut queried, mut traversed) = (queries.scatter(&scene)?, by_bvh(lab).scatter(&scene)?);
        let mut paths: Vec<_> = (0..lab.size(1 << 14, 1 << 20))
            .map(|i| PathInput::new(RayInput::new(Vec3::ZERO, rng.direction32()), rng.bits() & 4095, i as u32))
            .collect();
        for _ in 0..6 {
            let (found, expected) = (queried.run(&paths)?, traversed.run(&paths)?);
            let bytes = |record: &PathRecord| bytemuck::bytes_of(record).to_vec();
            wrong += found.iter().zip(&expected).filter(|(a, b)| bytes(a) != bytes(b)).count();
            traced += paths.len();
            paths = paths.iter().zip(&expected).filter(|p| p.1.alive != 0).map(|(p, r)| r.next(p)).collect();
        }
    }
    Ok([wrong, traced])
}

fn lanes(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(53);
    let (scene, from) = &scenes()[0];
    let (mut queried, mut traversed) = (by_queries(lab)?.closest(scene)?, by_bvh(lab).closest(scene)?);
    let scale = queried.scale();
    let (mut wrong, mut traced) = (0, 0);
    let dispatches = lab.size(210, 7000);
    for count in (1..=70).cycle().take(dispatches) {
        let mut rays = aimed(scene, *from, scale, &mut rng, count);
        let share = rng.below(9);
        for ray in &mut rays {
            if rng.below(8) < share {
                let broken = [[f32::NAN; 3], [0.0; 3], [f32::INFINITY, 0.0, 0.0], [0.6, 0.0, 0.8]];
                ray.direction = broken[rng.below(4)];
            }
        }
        wrong += count_different(&queried.run(&rays)?, &traversed.run(&rays)?);
        traced += count;
    }
    Ok(Measured::new(wrong as f64, format!("{traced} rays in {dispatches} dispatches")))
}

fn image(lab: &Lab) -> Result<Measured, CheckError> {
    let queries = by_queries(lab)?;
    let traverses = by_bvh(lab);
    let mut images = Vec::new();
    for mut scene in rooms() {
        let side = lab.size(32, 128) as u32;
        scene.size(side, 4);
        let [queried, traversed] = [&queries, &traverses]
            .map(|lab| lab.render_with(&scene, &RenderSettings { samples: 4, ..lab.settings(&scene) }));
        images.push((queried?, traversed?));
    }
    let differ = images.iter().map(|(queried, traversed)| queried.differing(traversed)).sum();
    let pixels: usize = images.iter().map(|(queried, _)| queried.film.counts().len()).sum();
    Ok(pixels_that_differ(&images[0].1.film, differ, format!("{pixels} pixels, {} scenes", images.len())))
}
