//! Emitters in the plane of what they are fixed to: an emitter flush with a ceiling.
//!
//! Shadow rays end before an emitter, so that nothing in its plane hides it from them; other rays meet whichever of the two surfaces
//! rounding puts first. Such emitters are moved off the plane, to the front, by more than rounding amounts to. Then all rays agree.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::accel::{self, Aabb, Child, Tree};
use crate::scene::{Mesh, Scene};

use crate::render::space::RenderSpace;

/// What single precision rounds by, relative.
const ROUNDING: f64 = 1.0 / 16_777_216.0;
/// Planes no further apart than that are one, in units of `ROUNDING` times the scene's reach.
const SAME_PLANE: f64 = 64.0;
/// By how much an emitter is moved, in the same units. Of the distance to a surface, the errors that two tests do not share amount to
/// 22 roundings each along its normal (4 of corners projected along the ray, 18 of the sum and its factors, see
/// shaders/lib/intersect/bvh/slab.glsl), however flat the ray; the distance is at most 4 where the reach is 1.
const LIFT: f64 = SAME_PLANE + 2.0 * 22.0 * 4.0 + 16.0;
/// Errors of edge functions are relative to the squares of edges: of a triangle of length s and height h they move the hit by so many
/// roundings of s²/h.
const OF_EDGES: f64 = 8.0;
/// The largest s²/h that is allowed for, over the reach.
const MOST_SLENDER: f64 = 1024.0;
/// Overlaps narrower than that are none, over the reach.
const NARROW: f64 = 1e-6;

/// By how much emitting triangles are moved, in scene units: by the indices of the mesh and of the triangle in it.
#[derive(Debug, Default, Clone, PartialEq)]
pub(crate) struct Lifts(BTreeMap<(usize, usize), DVec3>);

/// A triangle in render space.
struct Face {
    corners: [DVec3; 3],
    normal: DVec3,
    /// s²/h.
    slender: f64,
}

impl Face {
    fn of(mesh: &Mesh, triangle: usize, space: &RenderSpace) -> Option<Self> {
        let corners = mesh.triangles[triangle].map(|i| space.point(mesh.positions[i as usize]));
        let [a, b, c] = corners;
        let across = (b - a).cross(c - a);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let slender = (longest.powi(3) / across.length()).min(MOST_SLENDER * space.reach);
        Some(Self { corners, normal: across.try_normalize()?, slender })
    }

    fn bounds(&self, margin: f32) -> Aabb {
        let Aabb { lo, hi } = Aabb::around(self.corners.map(|corner| corner.as_vec3()));
        Aabb { lo: lo - margin, hi: hi + margin }
    }

    /// The largest distance of another one's corners from the plane.
    fn distance_to(&self, other: &Self) -> f64 {
        other.corners.iter().map(|p| self.normal.dot(*p - self.corners[0]).abs()).fold(0.0, f64::max)
    }

    /// Whether the two overlap by more than `margin`, seen along an axis: no edge of either has the other on its outer side.
    fn overlaps(&self, other: &Self, margin: f64) -> bool {
        let axis = self.normal.abs().max_position();
        let flat = |p: &DVec3| DVec2::new(p[(axis + 1) % 3], p[(axis + 2) % 3]);
        let [ours, theirs] = [self, other].map(|face| face.corners.each_ref().map(flat));
        let separates = |of: &[DVec2; 3], from: &[DVec2; 3]| {
            (0..3).any(|i| {
                let (p, q, inner) = (of[i], of[(i + 1) % 3], of[(i + 2) % 3]);
                let inward = (q - p).perp().normalize_or_zero();
                let inward = if inward.dot(inner - p) < 0.0 { -inward } else { inward };
                from.iter().all(|x| inward.dot(*x - p) <= margin)
            })
        };
        !separates(&ours, &theirs) && !separates(&theirs, &ours)
    }
}

impl Lifts {
    /// Of the emitters that lie on something that does not emit.
    pub fn of(scene: &Scene, space: &RenderSpace) -> Self {
        let emits: Vec<bool> = scene.materials.iter().map(|material| material.surface.emits()).collect();
        let all = |mesh: usize| (0..scene.meshes[mesh].triangles.len()).map(move |triangle| (mesh, triangle));
        let emitting =
            |&(mesh, triangle): &(usize, usize)| emits[scene.meshes[mesh].triangle_materials[triangle] as usize];
        let face = |(mesh, triangle): (usize, usize)| Face::of(&scene.meshes[mesh], triangle, space);
        let emitters: Vec<_> = (0..scene.meshes.len())
            .filter(|&mesh| scene.meshes[mesh].triangle_materials.iter().any(|&m| emits[m as usize]))
            .flat_map(all)
            .filter(emitting)
            .filter_map(|at| Some((at, face(at)?)))
            .collect();
        let unit = ROUNDING * space.reach;
        let margin = (2.0 * SAME_PLANE * unit) as f32;
        let boxes: Vec<_> = emitters.iter().map(|(_, face)| face.bounds(margin)).collect();
        let Some(tree) = accel::build(&boxes) else { return Self::default() };
        // The emitters that lie on a face, and how far each is moved for it.
        let flush_with = |other: Face| -> Vec<(usize, f64)> {
            let lift_of = |i: usize| {
                let emitter = &emitters[i].1;
                let apart = emitter.distance_to(&other).min(other.distance_to(emitter));
                let flush = apart <= SAME_PLANE * unit && emitter.overlaps(&other, NARROW * space.reach);
                let edges = OF_EDGES * ROUNDING * (emitter.slender + other.slender);
                flush.then_some((i, LIFT * unit + edges))
            };
            meeting(&tree, other.bounds(0.0)).into_iter().filter_map(lift_of).collect()
        };
        let touched: Vec<_> = (0..scene.meshes.len())
            .into_par_iter()
            .flat_map(|mesh| (0..scene.meshes[mesh].triangles.len()).into_par_iter().map(move |i| (mesh, i)))
            .filter(|at| !emitting(at))
            .filter_map(face)
            .flat_map_iter(flush_with)
            .collect();
        let mut lifts = BTreeMap::new();
        for (i, height) in touched {
            let (at, emitter) = &emitters[i];
            // One that shines to both sides is seen from where the camera is.
            let material = scene.meshes[at.0].triangle_materials[at.1];
            let back = scene.surface(material).two_sided && emitter.normal.dot(emitter.corners[0]) > 0.0;
            let offset = space.scene_length(if back { -height } else { height }) * emitter.normal;
            let most = lifts.entry(*at).or_insert(offset);
            if offset.length_squared() > most.length_squared() {
                *most = offset;
            }
        }
        Self(lifts)
    }

    /// Of the triangles of a mesh: their indices, and by how much each is moved.
    pub fn of_mesh(&self, mesh: usize) -> impl Iterator<Item = (usize, DVec3)> {
        self.0.range((mesh, 0)..(mesh + 1, 0)).map(|(&(_, triangle), &offset)| (triangle, offset))
    }

    /// By how much a triangle is moved.
    pub fn offset(&self, mesh: usize, triangle: usize) -> DVec3 {
        self.0.get(&(mesh, triangle)).copied().unwrap_or_default()
    }
}

/// The leaves whose boxes meet a box.
fn meeting(tree: &Tree, bounds: Aabb) -> Vec<usize> {
    let (mut found, mut open) = (Vec::new(), vec![0]);
    while let Some(node) = open.pop() {
        let node = &tree.nodes[node as usize];
        for (around, child) in node.bounds.iter().zip(node.children) {
            match child {
                _ if !around.meets(bounds) => {}
                Child::Inner(inner) => open.push(inner),
                Child::Leaf(leaf) => found.push(tree.order[leaf as usize] as usize),
            }
        }
    }
    // A tree of one leaf has it twice.
    found.sort_unstable();
    found.dedup();
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::scenes::{Build, diffuse, emitter, empty, grid, v};

    /// A ceiling of n×n squares and an emitter of m×m in its middle, `hung` below it.
    fn lifted(n: u32, m: u32, half: f64, hung: f64) -> (usize, f64) {
        let mut scene = empty();
        let (ceiling, light) = (v(0.0, 2.0, -3.0), v(0.0, 2.0 - hung, -3.0));
        let (positions, triangles) = grid(ceiling, v(3.0, 0.0, 0.0), v(0.0, 0.0, 3.0), n);
        scene.mesh(&positions, &triangles, diffuse(0.5));
        let (positions, triangles) = grid(light, v(half, 0.0, 0.0), v(0.0, 0.0, half), m);
        scene.mesh(&positions, &triangles, emitter(1.0));
        let lifts = Lifts::of(&scene, &RenderSpace::of(&scene));
        assert_eq!(lifts.of_mesh(0).count(), 0);
        let heights: Vec<f64> = lifts.of_mesh(1).map(|(_, offset)| -offset.y).collect();
        (heights.len(), heights.iter().copied().fold(f64::INFINITY, f64::min))
    }

    #[test]
    fn emitters_in_a_ceiling_are_moved_down() {
        for (n, m) in [(1, 1), (6, 8), (40, 1), (1, 40)] {
            let (count, least) = lifted(n, m, 2.0, 0.0);
            assert_eq!(count, 2 * (m * m) as usize, "{n} {m}");
            assert!((5e-5..2e-4).contains(&least), "by {least}");
        }
        assert_eq!(lifted(6, 8, 2.0, 1e-3).0, 0, "hung");
        assert_eq!(lifted(6, 8, 2.0, 1e-7).0, 128, "hung by less than single precision tells");
    }

    #[test]
    fn what_fills_a_hole_stays() {
        let mut scene = empty();
        let square = |x: f64| grid(v(x, 2.0, -3.0), v(1.0, 0.0, 0.0), v(0.0, 0.0, 1.0), 2);
        for x in [-2.0, 2.0] {
            let (positions, triangles) = square(x);
            scene.mesh(&positions, &triangles, diffuse(0.5));
        }
        let (positions, triangles) = square(0.0);
        scene.mesh(&positions, &triangles, emitter(1.0));
        assert_eq!(Lifts::of(&scene, &RenderSpace::of(&scene)), Lifts::default());
    }
}
