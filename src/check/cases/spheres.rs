//! Rays against analytic spheres, huge, small and far away.

use glam::{DVec3, Vec3};

use crate::check::probe::{PathInput, RayInput};
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, empty, glass, v};
use crate::check::statistics::{relative, worst};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::oracle;
use crate::oracle::Ray;
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "spheres/walls",
        what: "walls of radius 1000 and 1e5, rays within 5 units of them",
        oracle: "f64 roots",
        quantity: "mean relative error of t",
        threshold: 1e-7,
        full_only: false,
        measure: |lab| walls(lab).map(|(mean, _, detail)| Measured::new(mean, detail)),
    },
    Case {
        name: "spheres/walls-worst",
        what: "the same rays",
        oracle: "f64 roots",
        quantity: "worst relative error of t (1: hit or miss is wrong)",
        threshold: 1e-4,
        full_only: false,
        measure: |lab| walls(lab).map(|(_, worst, detail)| Measured::new(worst, detail)),
    },
    Case {
        name: "spheres/far-small",
        what: "a sphere of radius 1 at distance 1e4",
        oracle: "f64 discriminant",
        quantity: "share of rays that are misclassified",
        threshold: 2e-6,
        full_only: false,
        measure: far_small,
    },
    Case {
        name: "spheres/far-small-bvh",
        what: "spheres of radius 1 at distance 1e4, in the BVH",
        oracle: "f64 discriminant",
        quantity: "share of rays that are misclassified",
        threshold: 2e-6,
        full_only: false,
        measure: far_small_bvh,
    },
    Case {
        name: "spheres/self-hit",
        what: "rays scattered by spheres in constants and in the BVH, from outside",
        oracle: "a sphere is convex",
        quantity: "rays that hit the sphere they leave",
        threshold: 0.0,
        full_only: false,
        measure: self_hit,
    },
    Case {
        name: "spheres/cavity",
        what: "paths of 8 hits inside a closed sphere, radii 1e-6 to 1e6",
        oracle: "closed: every ray hits",
        quantity: "rays that escape",
        threshold: 0.0,
        full_only: false,
        measure: cavity,
    },
    Case {
        name: "spheres/chords",
        what: "rays that cross a glass sphere from one side to the other",
        oracle: "f64 roots",
        quantity: "worst error of t over the radius",
        threshold: 1e-6,
        full_only: false,
        measure: chords,
    },
];

fn walls(lab: &Lab) -> Result<(f64, f64, String), CheckError> {
    let mut rng = Rng::new(23);
    let (mut sum, mut hits, mut largest) = (0.0, 0usize, 0.0f64);
    for radius in [1e3, 1e5] {
        for inside in [false, true] {
            let mut scene = empty();
            let distance = if inside { radius - 5.0 } else { radius + 5.0 };
            scene.sphere(v(0.0, -distance, 0.0), radius, diffuse(0.5));
            // Sets the size of what is seen.
            scene.sphere(v(20.0, 0.0, 0.0), 1.0, diffuse(0.5));
            let mut probe = lab.closest(&scene)?;
            let scale = probe.scale();
            let rays: Vec<RayInput> = (0..lab.size(1 << 16, 1 << 22))
                .map(|_| RayInput::new((scale * rng.in_cube(2.5)).as_vec3(), rng.direction32()))
                .collect();
            for (ray, hit) in rays.iter().zip(probe.run(&rays)?) {
                let exact = trace(&scene, probe.scene_point(ray.origin), ray.direction);
                let error = match (hit.id >= 0, exact) {
                    (true, Some(t)) => relative(f64::from(hit.t) / scale, t),
                    (false, None) => continue,
                    // Rays that graze the other end of a wall of 1000 units may go either way.
                    _ if grazing(&scene, &probe.scene_point(ray.origin), ray.direction) => continue,
                    _ => 1.0,
                };
                sum += error;
                hits += 1;
                largest = worst([largest, error]);
            }
        }
    }
    Ok((sum / hits as f64, largest, format!("{hits} hits, radii 1e3 and 1e5, from both sides")))
}

/// Whether the ray passes a sphere of the scene at its rim, within 1e-6 of the radius.
fn grazing(scene: &Scene, origin: &DVec3, direction: [f32; 3]) -> bool {
    let d = DVec3::from(direction.map(f64::from)).normalize();
    scene.spheres.iter().any(|s| {
        let f = s.center - *origin;
        let distance = (f - f.dot(d) * d).length();
        (distance / s.radius - 1.0).abs() < 1e-6
    })
}

/// Distance in scene units by the oracle, along the direction as it is (its length is 1 but for rounding).
fn trace(scene: &Scene, origin: DVec3, direction: [f32; 3]) -> Option<f64> {
    let direction = DVec3::from(direction.map(f64::from));
    oracle::trace::closest_hit(scene, &Ray::new(origin, direction)).map(|hit| hit.t)
}

fn far_small(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = empty();
    scene.sphere(v(6000.0, 0.0, -8000.0), 1.0, diffuse(0.5));
    misclassified(lab, &scene)
}

fn far_small_bvh(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = empty();
    // The largest sixteen become constants.
    for i in 0..16 {
        scene.sphere(v(0.0, 8000.0, 100.0 * f64::from(i)), 2.0, diffuse(0.5));
    }
    for i in 0..16 {
        scene.sphere(v(6000.0, 16.0 * f64::from(i), -8000.0), 1.0, diffuse(0.5));
    }
    misclassified(lab, &scene)
}

/// Rays from the origin at spheres of radius 1, half of which miss.
fn misclassified(lab: &Lab, scene: &Scene) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(24);
    let targets: Vec<DVec3> = scene.spheres.iter().filter(|s| s.radius == 1.0).map(|s| s.center).collect();
    let mut probe = lab.closest(scene)?;
    let rays: Vec<RayInput> = (0..lab.size(1 << 20, 100_000_000 / 8))
        .map(|i| {
            let axis = targets[i % targets.len()];
            let side = axis.normalize().cross(rng.direction()).normalize();
            let at = axis + rng.between(0.0, 2.0) * side;
            RayInput::new(Vec3::ZERO, at.normalize().as_vec3())
        })
        .collect();
    let hits = probe.run(&rays)?;
    let wrong = rays
        .iter()
        .zip(&hits)
        .filter(|(ray, hit)| (hit.id >= 0) != trace_hits(&targets, DVec3::from(ray.direction.map(f64::from))))
        .count();
    Ok(Measured::new(wrong as f64 / rays.len() as f64, format!("{wrong} of {} rays", rays.len())))
}

fn trace_hits(centers: &[DVec3], d: DVec3) -> bool {
    centers.iter().any(|c| c.cross(d).length_squared() <= d.length_squared())
}

fn self_hit(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(25);
    let mut scene = empty();
    for i in 0..40 {
        let radius = 10f64.powf(rng.between(-3.0, 0.5));
        let center = (4.0 * rng.direction() * (1.0 + f64::from(i % 4))).as_vec3().as_dvec3();
        scene.sphere(center, radius, if i % 5 == 0 { glass(1.5) } else { diffuse(0.9) });
    }
    let centers: Vec<_> = scene.spheres.iter().map(|s| (s.center, s.radius)).collect();
    let outside = |p: DVec3| centers.iter().all(|(c, r)| p.distance(*c) > *r);
    let mut probe = lab.scatter(&scene)?;
    let (mut again, mut traced) = (0usize, 0usize);
    let total = lab.size(1 << 17, 100_000_000);
    let scale = probe.scale();
    while traced < total {
        let paths: Vec<_> = (0..total.min(1 << 18))
            .map(|i| {
                let target = centers[rng.below(centers.len())];
                let mut origin = DVec3::ZERO;
                // Opaque spheres of constants are traced from where the camera is: outside.
                for _ in 0..8 {
                    origin = 20.0 * rng.in_ball();
                    if outside(origin) {
                        break;
                    }
                    origin = DVec3::ZERO;
                }
                let to = target.0 + target.1 * rng.in_ball() - origin;
                let ray = RayInput::new((scale * origin).as_vec3(), to.normalize().as_vec3());
                PathInput::new(ray, rng.bits() & 4095, i as u32)
            })
            .collect();
        let first = probe.run(&paths)?;
        let next: Vec<_> =
            paths.iter().zip(&first).filter(|p| p.1.alive != 0).map(|(p, r)| (r.id, r.next(p))).collect();
        let second = probe.run(&next.iter().map(|n| n.1).collect::<Vec<_>>())?;
        // Inside of glass the same sphere is met again, rightly.
        let leaves = |path: &PathInput| path.ray.self_id & crate::check::probe::INSIDE == 0;
        again += next.iter().zip(&second).filter(|((id, path), hit)| leaves(path) && hit.id == *id).count();
        traced += next.len().max(1);
    }
    Ok(Measured::new(again as f64, format!("{traced} rays, 40 spheres")))
}

fn cavity(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(26);
    let (mut escaped, mut traced) = (0usize, 0usize);
    for radius in [1e-6, 1.0, 1e6] {
        let mut scene = empty();
        scene.camera.position = v(0.25, 0.5, -0.125) * radius;
        scene.camera.target = DVec3::ZERO;
        scene.sphere(DVec3::ZERO, radius, diffuse(0.9));
        scene.integrator.max_depth = 16;
        let mut probe = lab.scatter(&scene)?;
        let mut paths: Vec<_> = (0..lab.size(1 << 14, 1 << 21))
            .map(|i| PathInput::new(RayInput::new(Vec3::ZERO, rng.direction32()), rng.bits() & 4095, i as u32))
            .collect();
        for _ in 0..8 {
            let records = probe.run(&paths)?;
            escaped += records.iter().filter(|r| r.id < 0 || r.alive == 0).count();
            traced += records.len();
            paths = paths.iter().zip(&records).filter(|p| p.1.alive != 0).map(|(p, r)| r.next(p)).collect();
        }
    }
    Ok(Measured::new(escaped as f64, format!("{traced} rays")))
}

fn chords(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(27);
    let mut scene = empty();
    let center = v(0.5, 0.25, -4.0);
    scene.sphere(center, 2.0, glass(1.5));
    let mut probe = lab.scatter(&scene)?;
    let scale = probe.scale();
    let paths: Vec<_> = (0..lab.size(1 << 16, 1 << 22))
        .map(|i| {
            let to = (center + 1.999 * rng.in_ball()).normalize().as_vec3();
            PathInput::new(RayInput::new(Vec3::ZERO, to), rng.bits() & 4095, i as u32)
        })
        .collect();
    let first = probe.run(&paths)?;
    let inside: Vec<_> = paths
        .iter()
        .zip(&first)
        .map(|(p, r)| r.next(p))
        .filter(|p| p.ray.self_id & crate::check::probe::INSIDE != 0 && p.ray.self_id >= 0)
        .collect();
    let second = probe.run(&inside)?;
    let error = |(path, hit): (&PathInput, &crate::check::probe::PathRecord)| {
        let o = probe.scene_point(path.ray.origin) - center;
        let d = DVec3::from(path.ray.direction.map(f64::from));
        // The far root, from a point that lies on the sphere but for rounding.
        let b = -o.dot(d) / d.length_squared();
        let exact = b + (b * b - (o.length_squared() - 4.0) / d.length_squared()).max(0.0).sqrt();
        if hit.id < 0 { f64::INFINITY } else { (f64::from(hit.t) / scale - exact).abs() / 2.0 }
    };
    if inside.len() < 1000 {
        return Ok(Measured::new(f64::INFINITY, format!("only {} paths enter", inside.len())));
    }
    let off = worst(inside.iter().zip(&second).map(error));
    Ok(Measured::new(off, format!("{} chords", inside.len())))
}
