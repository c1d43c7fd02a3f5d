//! Rays that leave triangles: they must not hit what they leave, and must hit what is near.

use glam::DVec3;

use crate::check::cases::bvh::soup;
use crate::check::probe::{PathInput, RayInput};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, empty, grid, icosphere, v};
use crate::check::statistics::relative;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::oracle;
use crate::oracle::Ray;
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "triangles/spawn-flat",
        what: "rays scattered from tilted flat meshes, half of them from edges, scales 1e-8 to 1e8",
        oracle: "flat: nothing is above it",
        quantity: "rays that hit the mesh again",
        threshold: 0.0,
        full_only: false,
        measure: spawn_flat,
    },
    Case {
        name: "triangles/spawn-own",
        what: "rays scattered from triangles of all sizes and attitudes",
        oracle: "a triangle is flat",
        quantity: "rays that hit the triangle they leave",
        threshold: 0.0,
        full_only: false,
        measure: spawn_own,
    },
    Case {
        name: "triangles/spawn-convex",
        what: "rays scattered from the outside of closed convex meshes",
        oracle: "convex: nothing is above it",
        quantity: "rays out of the body that hit it again",
        threshold: 0.0,
        full_only: false,
        measure: spawn_convex,
    },
    Case {
        name: "triangles/spawn-inside",
        what: "paths of 6 hits inside a closed mesh",
        oracle: "closed: every ray hits",
        quantity: "rays that escape",
        threshold: 0.0,
        full_only: false,
        measure: spawn_inside,
    },
    Case {
        name: "triangles/close-corner",
        what: "rays scattered between plates that are 1e-4 of the scene apart",
        oracle: "f64 distance to the other plate",
        quantity: "rays that miss it, or whose t is off by more than 1e-6 and 1%",
        threshold: 0.0,
        full_only: false,
        measure: close_corner,
    },
];

/// Traces rays at a mesh, and counts which of the scattered ones meet it again, but for those `but` is true of (start
/// and direction in the scene). Every other ray is aimed at an edge, if so asked: there a triangle's neighbour is as near as it is
/// itself. Returns that, and how many rays were scattered.
fn again(
    lab: &Lab,
    scene: &Scene,
    rng: &mut Rng,
    total: usize,
    at_edges: bool,
    mut but: impl FnMut(DVec3, DVec3) -> bool,
) -> Result<(usize, usize), CheckError> {
    let mesh = &scene.meshes[0];
    let mut probe = lab.scatter(scene)?;
    let (mut again, mut traced) = (0usize, 0usize);
    while traced < total {
        let paths: Vec<_> = (0..total.min(1 << 18))
            .map(|i| {
                let [a, b, c] = mesh.triangles[rng.below(mesh.triangles.len())].map(|i| mesh.positions[i as usize]);
                let (mut p, mut q) = (rng.uniform(), rng.uniform());
                if p + q > 1.0 {
                    (p, q) = (1.0 - p, 1.0 - q);
                }
                if at_edges && i % 2 == 0 {
                    q = 0.0;
                }
                let target = a + p * (b - a) + q * (c - a) - scene.camera.position;
                PathInput::new(
                    RayInput::new(glam::Vec3::ZERO, target.normalize().as_vec3()),
                    rng.bits() & 4095,
                    i as u32,
                )
            })
            .collect();
        let first = probe.run(&paths)?;
        let next: Vec<_> = paths.iter().zip(&first).filter(|p| p.1.alive != 0).map(|(p, r)| r.next(p)).collect();
        for (path, hit) in next.iter().zip(&probe.run(&next)?) {
            let direction = DVec3::from(path.ray.direction.map(f64::from));
            again += usize::from(hit.id >= 0 && !but(probe.scene_point(path.ray.origin), direction));
        }
        traced += next.len().max(1);
    }
    Ok((again, traced))
}

fn spawn_flat(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(30);
    let (mut hits, mut rays) = (0, 0);
    let planes = lab.size(3, 60);
    for i in 0.. {
        if rays >= lab.size(1 << 18, 100_000_000) {
            break;
        }
        // About 1e-8, 1 and 1e8.
        let scale = [2f64.powi(-26), 1.0, 2f64.powi(26)][i % 3];
        // Everything on a lattice, so that the mesh is flat in single precision too.
        let mut lattice = || v(8.0, 8.0, 8.0) - DVec3::from([0; 3].map(|_| rng.below(17) as f64));
        let (x, y) = (lattice() / 8.0, lattice() / 8.0);
        let center = lattice() / 2.0;
        let normal = x.cross(y);
        if normal.length() < 0.1 || center.dot(normal.normalize()).abs() < 0.1 {
            continue;
        }
        let (positions, triangles) = grid(center, x, y, 8);
        let mut scene = empty();
        let scaled: Vec<_> = positions.iter().map(|p| scale * *p).collect();
        scene.mesh(&scaled, &triangles, diffuse(0.9));
        let (again, traced) =
            again(lab, &scene, &mut rng, lab.size(1 << 18, 100_000_000) / planes, true, |_, _| false)?;
        hits += again;
        rays += traced;
    }
    Ok(Measured::new(hits as f64, format!("{rays} rays, {planes} planes")))
}

fn spawn_own(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(29);
    let mut scene = soup(&mut rng, 500);
    scene.materials[0].surface = diffuse(0.9);
    let mesh = &scene.meshes[0];
    let mut probe = lab.scatter(&scene)?;
    let scale = probe.scale();
    let (mut again, mut traced) = (0usize, 0usize);
    let total = lab.size(1 << 19, 100_000_000);
    while traced < total {
        let paths: Vec<_> = (0..1 << 18)
            .map(|i| {
                let [a, b, c] = mesh.triangles[rng.below(mesh.triangles.len())].map(|i| mesh.positions[i as usize]);
                let target = a.lerp(b, rng.uniform()).lerp(c, rng.uniform());
                let origin = (scale * rng.in_cube(4.0)).as_vec3();
                let direction = (scale * target - origin.as_dvec3()).normalize().as_vec3();
                PathInput::new(RayInput::new(origin, direction), rng.bits() & 4095, i as u32)
            })
            .collect();
        let first = probe.run(&paths)?;
        let alive = paths.iter().zip(&first).filter(|p| p.1.alive != 0);
        let (ids, next): (Vec<_>, Vec<_>) = alive.map(|(p, r)| (r.id, r.next(p))).unzip();
        again += ids.iter().zip(&probe.run(&next)?).filter(|(id, hit)| hit.id == **id).count();
        traced += next.len().max(1);
    }
    Ok(Measured::new(again as f64, format!("{traced} rays, 500 triangles")))
}

fn spawn_convex(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(31);
    let (mut hits, mut rays, mut entered) = (0, 0, 0);
    for (levels, radius) in [(0, 1.0), (2, 3.0), (3, 0.25)] {
        let (positions, triangles) = icosphere(v(1.5, -0.5, -4.0), radius, levels);
        let mut scene = empty();
        scene.mesh(&positions, &triangles, diffuse(0.9));
        let planes: Vec<_> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| positions[i as usize]);
                let normal = (b - a).cross(c - a).normalize();
                (normal, normal.dot(a))
            })
            .collect();
        // At an edge of the outline, front and back are hit at one distance but for rounding; a path that takes the
        // back scatters into the body, which is no fault of its start.
        let enters = |start: DVec3, direction: DVec3| {
            let height = |&(normal, distance): &(DVec3, f64)| normal.dot(start) - distance;
            let highest = planes.iter().map(height).fold(f64::NEG_INFINITY, f64::max);
            let inward = planes
                .iter()
                .filter(|plane| height(plane) > highest - 1e-5 * radius)
                .all(|(normal, _)| normal.dot(direction) < 0.0);
            entered += usize::from(inward);
            inward
        };
        let (again, traced) = again(lab, &scene, &mut rng, lab.size(3 << 15, 100_000_000) / 3, false, enters)?;
        hits += again;
        rays += traced;
    }
    Ok(Measured::new(hits as f64, format!("{rays} rays, 3 meshes; {entered} into the body at its outline")))
}

fn spawn_inside(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(32);
    let (positions, triangles) = icosphere(v(0.25, -0.125, 0.5), 1.0, 3);
    let mut scene = empty();
    scene.mesh(&positions, &triangles, diffuse(0.9));
    scene.integrator.max_depth = 16;
    let mut probe = lab.scatter(&scene)?;
    let mut paths: Vec<_> = (0..lab.size(1 << 15, 100_000_000 / 6))
        .map(|i| PathInput::new(RayInput::new(glam::Vec3::ZERO, rng.direction32()), rng.bits() & 4095, i as u32))
        .collect();
    let (mut escaped, mut traced) = (0usize, 0usize);
    for _ in 0..6 {
        let records = probe.run(&paths)?;
        escaped += records.iter().filter(|r| r.id < 0 || r.alive == 0).count();
        traced += records.len();
        paths = paths.iter().zip(&records).filter(|p| p.1.alive != 0).map(|(p, r)| r.next(p)).collect();
    }
    Ok(Measured::new(escaped as f64, format!("{traced} rays")))
}

fn close_corner(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(33);
    let gap = 1.0 / 8192.0;
    let mut scene = empty();
    // The camera looks into the gap from its middle.
    scene.camera.target = DVec3::NEG_Z;
    for side in [-0.5, 0.5] {
        // Enough triangles that they are traced through the BVH.
        let (positions, triangles) = grid(v(0.0, side * gap, 0.0), DVec3::X, DVec3::Z, 8);
        scene.mesh(&positions, &triangles, diffuse(0.9));
    }
    let mut probe = lab.scatter(&scene)?;
    let scale = probe.scale();
    let paths: Vec<_> = (0..lab.size(1 << 14, 1 << 20))
        .map(|i| {
            // Steep, so that the plates' rims play no part.
            let d = (v(rng.between(-1.0, 1.0), rng.between(0.05, 1.0), rng.between(-1.0, 1.0))).normalize();
            PathInput::new(RayInput::new(glam::Vec3::ZERO, d.as_vec3()), rng.bits() & 4095, i as u32)
        })
        .collect();
    let first = probe.run(&paths)?;
    let next: Vec<_> = paths.iter().zip(&first).filter(|p| p.1.alive != 0).map(|(p, r)| r.next(p)).collect();
    let second = probe.run(&next)?;
    let wrong = next
        .iter()
        .zip(&second)
        .filter(|(path, hit)| {
            let direction = DVec3::from(path.ray.direction.map(f64::from));
            let self_id = probe.surface_left(path.ray.self_id);
            let ray = Ray { leaving: self_id, ..Ray::new(probe.scene_point(path.ray.origin), direction) };
            match oracle::trace::closest_hit(&scene, &ray) {
                Some(exact) => {
                    let t = f64::from(hit.t) / scale;
                    hit.id < 0 || (relative(t, exact.t) > 0.01 && (t - exact.t).abs() > 1e-6)
                }
                None => hit.id >= 0,
            }
        })
        .count();
    Ok(Measured::new((wrong + paths.len() - next.len()) as f64, format!("{} rays", next.len())))
}
