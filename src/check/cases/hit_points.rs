//! Hit points against the planes of what is hit: what rays that leave them rely upon.

use glam::DVec3;

use crate::check::probe::RayInput;
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, empty, icosphere, v};
use crate::check::statistics::worst;
use crate::check::{Case, CheckError, Lab, Measured};
use crate::oracle::trace::closest_hit;
use crate::oracle::{Primitive, Ray};
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "triangles/hit-points",
        what: "rays at triangles of the BVH near the camera, from 1 to 1e4 units away",
        oracle: "f64 distance of the hit point from the triangle's plane",
        quantity: "worst distance over the bound that rays are offset by",
        threshold: 1.0,
        full_only: false,
        measure: |lab| off_plane(lab, 2),
    },
    Case {
        name: "triangles/polygon-points",
        what: "rays at triangles in constants near the camera, from 1 to 1e4 units away",
        oracle: "f64 distance of the hit point from the triangle's plane",
        quantity: "worst distance over the bound that rays are offset by",
        threshold: 1.0,
        full_only: false,
        measure: |lab| off_plane(lab, 0),
    },
];

/// Rays at the inner parts of the triangles of a convex mesh, from the triangles' front.
fn off_plane(lab: &Lab, levels: u32) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(19);
    let center = v(0.75, -0.5, -2.0);
    let (positions, triangles) = icosphere(center, 1.0, levels);
    let mut scene = empty();
    scene.mesh(&positions, &triangles, diffuse(0.5));
    let mut probe = lab.closest(&scene)?;
    let scale = probe.scale();
    let (mut rays, mut far) = (0, Vec::new());
    for distance in [1.0, 1e2, 1e4] {
        let inputs: Vec<_> = (0..lab.size(1 << 12, 1 << 18))
            .map(|_| {
                let [a, b, c] = triangles[rng.below(triangles.len())].map(|i| positions[i as usize]);
                let (s, t) = (rng.between(0.1, 0.4), rng.between(0.1, 0.4));
                let target = a + s * (b - a) + t * (c - a);
                let normal = (b - a).cross(c - a).normalize();
                let towards = loop {
                    let towards = rng.direction();
                    // Not so flat that rounding of the direction carries the ray past the triangle.
                    if towards.dot(normal) > 0.1 {
                        break towards;
                    }
                };
                let origin = (scale * (target + distance * towards)).as_vec3();
                RayInput::new(origin, (scale * target - origin.as_dvec3()).normalize().as_vec3())
            })
            .collect();
        let mut ratios = Vec::with_capacity(inputs.len());
        for (ray, hit) in inputs.iter().zip(probe.run(&inputs)?) {
            let origin = probe.scene_point(ray.origin);
            let exact = Ray::new(origin, DVec3::from(ray.direction.map(f64::from)));
            let Some((point, normal)) = plane(&scene, &exact).filter(|_| hit.id >= 0) else {
                return Ok(Measured::new(f64::INFINITY, "a ray misses"));
            };
            let off = (probe.scene_point(hit.position) - point).dot(normal).abs();
            ratios.push(if off == 0.0 { 0.0 } else { off * scale / f64::from(hit.offset) });
        }
        rays += inputs.len();
        far.push(worst(ratios));
    }
    let detail = format!("{rays} rays; from 1, 1e2 and 1e4: {:.2}, {:.2} and {:.2}", far[0], far[1], far[2]);
    Ok(Measured::new(worst(far), detail))
}

/// A corner and the unit normal of the triangle that is hit.
fn plane(scene: &Scene, ray: &Ray) -> Option<(DVec3, DVec3)> {
    let Primitive::Triangle(mesh, triangle) = closest_hit(scene, ray)?.primitive else { return None };
    let mesh = &scene.meshes[mesh];
    let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.positions[i as usize]);
    Some((a, (b - a).cross(c - a).normalize()))
}
