//! Where in the picture emitters may be seen: directly, or in mirrors that the camera sees.

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::{Mesh, Scene};

use crate::render::light::table::Light;
use crate::render::space::RenderSpace;
use crate::render::space::bounds::{Corners, joined};
use crate::render::space::view::{Rectangle, View};

/// Rectangles of pixels outside of which the camera sees no emitter, neither directly nor by mirrors; of what it sees through glass
/// nothing is said. `emitters` are all emitters with a surface.
pub(crate) fn emitter_bounds(scene: &Scene, space: &RenderSpace, view: &View, emitters: &[Light]) -> Vec<Rectangle> {
    let direct = emitters.iter().filter_map(|emitter| view.pixels_of(emitter));
    let boxes = if emitters.is_empty() { Vec::new() } else { mirrors(scene, space) };
    direct.chain(boxes.into_iter().filter_map(|[lo, hi]| view.pixels_of_box(lo, hi))).collect()
}

/// Boxes around the mirrors of a scene, in render space: one for each sphere, and one for all those of a mesh.
fn mirrors(scene: &Scene, space: &RenderSpace) -> Vec<Corners> {
    let is_mirror = |material: u32| scene.surface(material).is_mirror();
    let spheres = scene.spheres.iter().filter(|sphere| is_mirror(sphere.material));
    let around = |center: DVec3, radius: f64| [space.point(center - radius), space.point(center + radius)];
    let of_spheres = spheres.map(|sphere| around(sphere.center, sphere.radius));
    let of_meshes = scene.meshes.iter().filter_map(|mesh| bounds_of(mesh, is_mirror));
    of_spheres.chain(of_meshes.map(|bounds| bounds.map(|corner| space.point(corner)))).collect()
}

/// The lowest and the highest corner of a mesh's triangles of some materials; `None` if there are none.
fn bounds_of(mesh: &Mesh, wanted: impl Fn(u32) -> bool + Sync) -> Option<Corners> {
    let triangles = mesh.triangles.par_iter().zip(&mesh.triangle_materials).filter(|(_, material)| wanted(**material));
    let corners = triangles.flat_map_iter(|(triangle, _)| triangle.map(|i| mesh.positions[i as usize]));
    corners.map(|p| [p, p]).reduce_with(joined)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::scenes::{Build, emitter, empty, mirror, v};
    use crate::render::light::table::LightShape;

    /// Of a scene whose only emitter is behind the camera, which looks along −z.
    fn places(scene: &Scene) -> Vec<Rectangle> {
        let shape = LightShape::Sphere { center: v(0.0, 0.0, 9.0), radius: 1.0, inward: false };
        emitter_bounds(scene, &RenderSpace::of(scene), &View::of(scene), &[Light { shape, radiance: [1.0; 3] }])
    }

    #[test]
    fn emitters_may_be_seen_where_mirrors_are() {
        let ball = |z: f64, radius: f64| {
            let mut scene = empty();
            scene.size(64, 1);
            scene.sphere(v(0.0, 0.0, z), radius, mirror(0.5));
            scene
        };
        // At a distance of 20 the picture reaches 11.5 to the sides; the nearest corner of the box is at 19.
        let ahead = ball(-20.0, 1.0);
        assert_eq!(places(&ahead), [[26..38, 26..38]]);
        assert!(places(&ball(20.0, 1.0)).is_empty());
        assert_eq!(places(&ball(-20.0, 30.0)), [[0..64, 0..64]]);
        assert!(places(&empty()).is_empty());
        // Of no emitters there is nothing to be seen.
        assert!(emitter_bounds(&ahead, &RenderSpace::of(&ahead), &View::of(&ahead), &[]).is_empty());
    }

    #[test]
    fn of_a_mesh_the_mirrors_count() {
        let mut scene = empty();
        scene.size(64, 1);
        let corners =
            [v(-9.0, 0.0, -20.0), v(-8.0, 0.0, -20.0), v(-8.0, 1.0, -20.0), v(1.0, 0.0, -20.0), v(0.0, -1.0, -20.0)];
        let mesh = scene.mesh(&corners, &[[0, 1, 2], [1, 3, 4]], mirror(1.0));
        mesh.triangle_materials[0] = 1;
        scene.material(emitter(0.0));
        // From the second triangle's -8 to 1, and from -1 to 0.
        assert_eq!(places(&scene), [[6..38, 29..38]]);
        scene.meshes[0].triangle_materials[1] = 1;
        assert!(places(&scene).is_empty());
    }
}
