//! Small meshes as flat polygons that are written out in the shaders; see shaders/lib/intersect/polygon.glsl.

use glam::DVec3;

use crate::scene::{Material, Scene};

use crate::render::kernel::layout::constant::MAX_POLYGONS;
use crate::render::scene::coplanar::Lifts;
use crate::render::settings::TriangleTest;
use crate::render::space::RenderSpace;

/// A triangle (last corner repeated) or a convex quadrilateral, in render space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct InlinePolygon {
    pub corners: [DVec3; 4],
    /// Unit normal, towards the front.
    pub normal: DVec3,
    pub material: u32,
    /// Emitters are sampled uniformly: of quadrilaterals only parallelograms can be.
    pub emits: bool,
    /// By how much it has been moved off the plane of what it is fixed to.
    pub lift: DVec3,
}

impl InlinePolygon {
    /// Whether the last corner is that of a triangle, repeated.
    pub fn is_triangle(&self) -> bool {
        self.corners[2] == self.corners[3]
    }

    /// The axis that the normal is closest to.
    pub fn axis(&self) -> usize {
        self.normal.abs().max_position()
    }

    /// The polygon's constants for the simpler test in place of its corners: `QuickPolygon` of polygon.glsl.
    pub fn edges(&self) -> [DVec3; 4] {
        let c = &self.corners;
        let length = |i: usize| c[i].distance(c[(i + 1) % 4]);
        let shortest = (0..4).map(length).filter(|&l| l > 0.0).fold(f64::INFINITY, f64::min);
        let size = [c[0].distance(c[2]), c[1].distance(c[3])].into_iter().chain((0..4).map(length)).fold(0.0, f64::max);
        let unit = 48.0 * 2f64.powi(-24) * size / shortest;
        let axis = self.axis();
        let (u, v) = [(1, 2), (0, 2), (0, 1)][axis];
        [0, 1, 2, 3].map(|i| {
            let Some(inward) = self.normal.cross(c[(i + 1) % 4] - c[i]).try_normalize() else {
                return DVec3::new(0.0, 0.0, 1e30);
            };
            // The third coordinate follows from the plane.
            let tilt = inward[axis] / self.normal[axis];
            let across = inward - tilt * self.normal;
            DVec3::new(across[u], across[v], -across.dot(c[i])) / unit
        })
    }
}

/// Bit i: polygon i may lie between two points that paths can reach. A polygon with all of the scene on one side of its
/// plane cannot: it bounds the convex hull.
pub(crate) fn occluders(polygons: &[InlinePolygon], scene: &Scene, space: &RenderSpace) -> u32 {
    if polygons.is_empty() {
        return 0;
    }
    // Rays to a light from afar leave the hull.
    if scene.lights.iter().any(|light| light.position().is_none()) || scene.environment.is_some() {
        return u32::MAX;
    }
    let mut points = vec![DVec3::ZERO];
    points.extend(scene.meshes.iter().flat_map(|m| m.positions.iter().map(|&p| space.point(p))));
    points.extend(scene.lights.iter().filter_map(|light| Some(space.point(light.position()?))));
    let balls: Vec<_> = scene.spheres.iter().map(|s| (space.point(s.center), space.length(s.radius))).collect();
    let bounds_hull = |f: &InlinePolygon| {
        let d = f.normal.dot(f.corners[0]);
        // Single precision moves points by that much.
        let slack = 1e-6 * (space.reach + d.abs()) + f.lift.length();
        let side = |sign: f64| {
            points.iter().all(|p| sign * (f.normal.dot(*p) - d) >= -slack)
                && balls.iter().all(|(c, r)| sign * (f.normal.dot(*c) - d) - r >= -slack)
        };
        side(1.0) || side(-1.0)
    };
    polygons.iter().enumerate().map(|(i, f)| u32::from(!bounds_hull(f)) << i).sum()
}

/// The polygons of the meshes that become constants, and for each mesh whether it did.
///
/// The smallest meshes come first, as long as all polygons fit. Interpolated normals need vertices, hence the BVH; and
/// a caller who asks for Möller–Trumbore is to get it. Of the polygons that do, emitters come first: of surfaces that lie on each other
/// rays meet the first one, and a copy of an emitter is to be seen.
pub(crate) fn select(
    scene: &Scene,
    space: &RenderSpace,
    lifts: &Lifts,
    test: TriangleTest,
) -> (Vec<InlinePolygon>, Vec<bool>) {
    let mut order: Vec<usize> = (0..scene.meshes.len()).collect();
    order.sort_by_key(|&i| scene.meshes[i].triangles.len());
    let mut polygons = Vec::new();
    let mut constant = vec![false; scene.meshes.len()];
    for i in order {
        let mesh = &scene.meshes[i];
        if test != TriangleTest::Watertight
            || mesh.triangles.len() > 2 * MAX_POLYGONS
            || !mesh.vertex_normals.is_empty()
            || !mesh.colors.is_empty()
            || !mesh.triangle_materials.iter().all(|&material| is_plain(&scene.materials[material as usize]))
        {
            continue;
        }
        let own = join(i, scene, space, lifts);
        if polygons.len() + own.len() <= MAX_POLYGONS {
            polygons.extend(own);
            constant[i] = true;
        }
    }
    polygons.sort_by_key(|polygon| !polygon.emits);
    (polygons, constant)
}

/// Whether a material is the same all over a surface, and stops all rays.
fn is_plain(material: &Material) -> bool {
    material.textures.is_empty() && !material.lets_rays_pass() && !material.is_anisotropic()
}

/// The triangles of a mesh, pairs of which become quadrilaterals where they can.
fn join(index: usize, scene: &Scene, space: &RenderSpace, lifts: &Lifts) -> Vec<InlinePolygon> {
    let mesh = &scene.meshes[index];
    let mut polygons: Vec<InlinePolygon> = Vec::new();
    for (i, (triangle, &material)) in mesh.triangles.iter().zip(&mesh.triangle_materials).enumerate() {
        let corners = triangle.map(|i| mesh.positions[i as usize]);
        if space.triangle32(corners).is_none() {
            continue;
        }
        let [a, b, c] = corners.map(|p| space.point(p));
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
        let emits = scene.surface(material).emits();
        let lift = space.length(1.0) * lifts.offset(index, i);
        let next = InlinePolygon { corners: [a, b, c, c], normal, material, emits, lift };
        match polygons.iter_mut().find_map(|f| quadrilateral(f, &next).map(|q| (f, q))) {
            Some((polygon, joined)) => *polygon = joined,
            None => polygons.push(next),
        }
    }
    for polygon in &mut polygons {
        polygon.corners = polygon.corners.map(|corner| corner + polygon.lift);
    }
    polygons
}

/// The convex, flat quadrilateral of two triangles with a common edge, if there is one.
fn quadrilateral(first: &InlinePolygon, second: &InlinePolygon) -> Option<InlinePolygon> {
    if first.material != second.material || !first.is_triangle() || !second.is_triangle() {
        return None;
    }
    for i in 0..3 {
        let (a, b, apex) = (first.corners[i], first.corners[(i + 1) % 3], first.corners[(i + 2) % 3]);
        for j in 0..3 {
            if second.corners[j] != b || second.corners[(j + 1) % 3] != a {
                continue;
            }
            // Around: a, the other triangle's apex, b, the apex.
            let corners = [a, second.corners[(j + 2) % 3], b, apex];
            let size = corners[0].distance(corners[2]).max(corners[1].distance(corners[3]));
            let flat = (corners[1] - a).dot(first.normal).abs() <= 1e-9 * size;
            let turn = |k: usize| {
                let (p, q, r) = (corners[k], corners[(k + 1) % 4], corners[(k + 2) % 4]);
                (q - p).cross(r - q).dot(first.normal)
            };
            let parallelogram = (corners[0] + corners[2] - corners[1] - corners[3]).length() <= 1e-9 * size;
            if first.emits && !parallelogram {
                return None;
            }
            if flat && (0..4).all(|k| turn(k) > 1e-9 * size * size) {
                let lift = if second.lift.length() > first.lift.length() { second.lift } else { first.lift };
                return Some(InlinePolygon { corners, lift, ..*first });
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> InlinePolygon {
        let [a, b, c] = [a, b, c].map(DVec3::from_array);
        let normal = (b - a).cross(c - a).normalize();
        InlinePolygon { corners: [a, b, c, c], normal, material: 0, emits: false, lift: DVec3::ZERO }
    }

    #[test]
    fn edges_tell_the_distance() {
        let polygons = [
            triangle([0.0, 0.0, 0.0], [1.0, 0.0, 0.25], [0.5, 1.0, 3.0]),
            triangle([1.0, 2.0, 3.0], [1.0, 2.5, 3.0], [1.25, 2.0, 4.0]),
            triangle([-1.0, 0.5, 0.0], [0.0, 0.5, 2.0], [1.0, 0.25, 0.0]),
        ];
        for f in polygons {
            let (u, v) = [(1, 2), (0, 2), (0, 1)][f.axis()];
            let [a, b, c, _] = f.corners;
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let shortest = a.distance(b).min(b.distance(c)).min(c.distance(a));
            let unit = 48.0 * 2f64.powi(-24) * longest / shortest;
            let value = |i: usize, p: DVec3| f.edges()[i].dot(DVec3::new(p[u], p[v], 1.0)) * unit;
            let height = (b - a).cross(c - a).length() / a.distance(b);
            assert!((value(0, c) - height).abs() < 1e-12 && value(0, a).abs() < 1e-12 && value(0, b).abs() < 1e-12);
            let middle = (a + b + c) / 3.0;
            assert!((0..3).all(|i| value(i, middle) > 0.0) && value(2, middle) > 1e20);
        }
    }

    #[test]
    fn emitters_come_before_what_they_lie_on() {
        let cornell = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/cornell.toml");
        let mut scene = Scene::load(std::path::Path::new(cornell)).unwrap().scene;
        for _ in 0..2 {
            let (polygons, _) = select(&scene, &RenderSpace::of(&scene), &Lifts::default(), TriangleTest::Watertight);
            let emitters = polygons.iter().take_while(|f| f.emits).count();
            assert!(
                emitters > 0 && emitters < polygons.len() && polygons[emitters..].iter().all(|f| !f.emits),
                "{emitters} emitters"
            );
            for mesh in &mut scene.meshes {
                mesh.triangles.reverse();
                mesh.triangle_materials.reverse();
            }
        }
    }

    #[test]
    fn only_flat_convex_pairs_are_joined() {
        let base = triangle([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]);
        let square = triangle([0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]);
        let q = quadrilateral(&base, &square).unwrap();
        let area: f64 = (0..4).map(|i| q.corners[i].cross(q.corners[(i + 1) % 4]).z / 2.0).sum();
        assert!((area - 1.0).abs() < 1e-12);
        let bent = triangle([0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.1]);
        assert!(quadrilateral(&base, &bent).is_none());
        let concave = triangle([0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.5, 2.0, 0.0]);
        assert!(quadrilateral(&triangle([0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 1.0, 0.0]), &concave).is_none());
        let turned = triangle([1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert!(quadrilateral(&base, &turned).is_none());
        let emitter = |f| InlinePolygon { emits: true, ..f };
        assert!(quadrilateral(&emitter(base), &emitter(square)).is_some());
        let kite = triangle([0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.5, 0.0]);
        assert!(quadrilateral(&base, &kite).is_some());
        assert!(quadrilateral(&emitter(base), &emitter(kite)).is_none());
    }
}
