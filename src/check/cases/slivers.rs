//! Triangles a million times longer than wide.

use glam::{DVec2, DVec3};

use crate::check::facts::ulp;
use crate::check::probe::RayInput;
use crate::check::rng::Rng;
use crate::check::scenes::{Build, diffuse, empty};
use crate::check::{Case, CheckError, Lab, Measured};

pub(super) const CASES: &[Case] = &[Case {
    name: "triangles/slivers",
    what: "rays at and beside triangles of aspect 1e4 to 1e6",
    oracle: "f64 edge functions, outside a band of 4 ulp",
    quantity: "rays that are misclassified",
    threshold: 0.0,
    full_only: false,
    measure: slivers,
}];

fn slivers(lab: &Lab) -> Result<Measured, CheckError> {
    let mut rng = Rng::new(31);
    let (mut wrong, mut judged, mut hits) = (0usize, 0usize, 0usize);
    // One alone is held in constants, many are in the BVH.
    for count in [1, 1, 100] {
        let (mut positions, mut triangles, mut frames) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..count as u32 {
            let along = rng.direction();
            let across = along.cross(rng.direction()).normalize();
            let center = DVec3::NEG_Z * 3.0 + 0.5 * rng.in_ball();
            let width = [2e-6, 2e-5, 2e-4][rng.below(3)];
            let corners = [center - along, center + along, center + width * across];
            positions.extend(corners.map(|p| p.as_vec3().as_dvec3()));
            triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
            frames.push((center, along, across, width));
        }
        let mut scene = empty();
        scene.mesh(&positions, &triangles, diffuse(0.5));
        let mut probe = lab.closest(&scene)?;
        let scale = probe.scale();
        let rays: Vec<_> = (0..lab.size(1 << 14, 1 << 20))
            .map(|_| {
                let (center, along, across, width) = frames[rng.below(count)];
                let target = center
                    + rng.between(-0.9, 0.9) * along
                    + (rng.between(-1.0, 2.0) * width + rng.between(-2e-6, 2e-6)) * across;
                let origin = (scale * 0.5 * rng.in_ball()).as_vec3();
                RayInput::new(origin, (scale * target - origin.as_dvec3()).normalize().as_vec3())
            })
            .collect();
        for (ray, hit) in rays.iter().zip(probe.run(&rays)?) {
            let origin = probe.scene_point(ray.origin);
            let direction = DVec3::from(ray.direction.map(f64::from));
            let mut sides = triangles.iter().map(|t| classify(t.map(|i| positions[i as usize]), origin, direction));
            let inside = sides.try_fold(false, |any, side| side.map(|inside| any || inside));
            let Some(inside) = inside else { continue };
            judged += 1;
            hits += usize::from(inside);
            wrong += usize::from(inside != (hit.id >= 0));
        }
    }
    Ok(Measured::new(wrong as f64, format!("{judged} rays outside the band, {hits} of them hits")))
}

/// Whether the ray passes between the edges, seen along the axis of its largest component; `None` if it passes
/// within 4 ulp (of the coordinates) of an edge.
fn classify(corners: [DVec3; 3], origin: DVec3, direction: DVec3) -> Option<bool> {
    let z = direction.abs().max_position();
    let (x, y) = ((z + 1) % 3, (z + 2) % 3);
    let largest = corners.iter().map(|c| (*c - origin).abs().max_element()).fold(0.0, f64::max);
    let flat = corners.map(|c| {
        let p = c - origin;
        DVec2::new(p[x] - direction[x] / direction[z] * p[z], p[y] - direction[y] / direction[z] * p[z])
    });
    let distance = |i: usize| {
        let (a, b) = (flat[i], flat[(i + 1) % 3]);
        (a.perp_dot(b)) / (b - a).length()
    };
    let distances = [distance(0), distance(1), distance(2)];
    if distances.iter().any(|d| d.abs() < 4.0 * ulp(largest)) {
        return None;
    }
    Some(distances.iter().all(|&d| d > 0.0) || distances.iter().all(|&d| d < 0.0))
}
