//! Where in the picture emitters may be seen: directly, or in mirrors that the camera sees.

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::{Mesh, Scene};

use crate::render::light::emitter::{Light, LightShape};
use crate::render::space::RenderSpace;
use crate::render::space::bounds::{Corners, joined};
use crate::render::space::view::{Rectangle, View};

/// Rectangles of pixels outside of which the camera, a pinhole, sees no emitter, neither directly nor by mirrors; of what it sees through glass
/// nothing is said. `emitters` are all emitters with a surface.
pub(crate) fn emitter_bounds(scene: &Scene, space: &RenderSpace, view: &View, emitters: &[Light]) -> Vec<Rectangle> {
    let direct = emitters.iter().filter_map(|emitter| pixels_of(emitter, view));
    let boxes = if emitters.is_empty() { Vec::new() } else { mirrors(scene, space) };
    direct.chain(boxes.into_iter().filter_map(|[lo, hi]| view.pixels_of_box(lo, hi))).collect()
}

/// The pixels that may show a light's surface, or a little more; none if it is turned away or beyond one of the picture's sides.
fn pixels_of(light: &Light, view: &View) -> Option<Rectangle> {
    let faces = match light.shape {
        LightShape::Point(_) | LightShape::Spot { .. } | LightShape::Directional { .. } => false,
        LightShape::Triangle([a, b, c]) | LightShape::Parallelogram([a, b, c]) => (b - a).cross(c - a).dot(a) < 0.0,
        LightShape::Sphere { .. } => true,
    };
    let (lo, hi) = light.bounds();
    if faces { view.pixels_of_box(lo, hi) } else { None }
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

    /// Of a scene whose only emitter is behind the camera, which looks along −z.
    fn places(scene: &Scene) -> Vec<Rectangle> {
        let shape = LightShape::Sphere { center: v(0.0, 0.0, 9.0), radius: 1.0, inward: false };
        emitter_bounds(scene, &RenderSpace::of(scene), &View::of(scene, 1.0), &[Light::new(shape, [1.0; 3])])
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
        assert!(emitter_bounds(&ahead, &RenderSpace::of(&ahead), &View::of(&ahead, 1.0), &[]).is_empty());
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

    fn square(center: DVec3, half: f64) -> Light {
        // Faces +z.
        let corner = center - v(half, half, 0.0);
        let shape = LightShape::Parallelogram([corner, corner + 2.0 * half * DVec3::X, corner + 2.0 * half * DVec3::Y]);
        Light::new(shape, [1.0; 3])
    }

    #[test]
    fn emitters_beyond_a_side_are_not_shown() {
        let view = View {
            right: DVec3::X,
            up: 0.5 * DVec3::Y,
            forward: DVec3::NEG_Z,
            orthographic: false,
            size: [200.0, 100.0],
        };
        // At a distance of 10 the image reaches 10 to the sides and 5 up and down.
        for (x, y, shown) in [
            (0.0, 0.0, true),
            (10.5, 0.0, true),
            (-10.5, 0.0, true),
            (12.5, 0.0, false),
            (-12.5, 0.0, false),
            (0.0, 5.5, true),
            (0.0, -5.5, true),
            (0.0, 7.5, false),
            (0.0, -7.5, false),
        ] {
            assert_eq!(pixels_of(&square(v(x, y, -10.0), 1.0), &view).is_some(), shown, "{x} {y}");
            let sphere = LightShape::Sphere { center: v(x, y, -10.0), radius: 1.0, inward: false };
            assert_eq!(pixels_of(&Light::new(sphere, [1.0; 3]), &view).is_some(), shown, "{x} {y}");
        }
        // Behind the camera, and seen from behind.
        assert!(pixels_of(&square(v(0.0, 0.0, 10.0), 1.0), &view).is_none());
        let mut turned = square(v(0.0, 0.0, -10.0), 1.0);
        if let LightShape::Parallelogram([_, b, c]) = &mut turned.shape {
            std::mem::swap(b, c);
        }
        assert!(pixels_of(&turned, &view).is_none());
        // All around it.
        let around = LightShape::Sphere { center: DVec3::ZERO, radius: 3.0, inward: true };
        assert!(pixels_of(&Light::new(around, [1.0; 3]), &view).is_some());
        assert!(pixels_of(&Light::new(LightShape::Point(v(0.0, 0.0, -1.0)), [1.0; 3]), &view).is_none());
    }

    #[test]
    fn the_pixels_of_an_emitter_are_around_it() {
        let view = View {
            right: DVec3::X,
            up: 0.5 * DVec3::Y,
            forward: DVec3::NEG_Z,
            orthographic: false,
            size: [200.0, 100.0],
        };
        // At a distance of 10 a unit is 10 pixels; row 0 is the highest.
        assert_eq!(pixels_of(&square(v(5.0, 2.0, -10.0), 1.0), &view), Some([137..163, 17..43]));
        assert_eq!(pixels_of(&square(v(9.5, -4.5, -10.0), 1.0), &view), Some([182..200, 82..100]));
        assert_eq!(pixels_of(&square(v(12.5, 0.0, -10.0), 1.0), &view), None);
        // What is nearer is larger.
        let tilted = [v(-0.99, 0.0, -10.0), v(0.99, 0.0, -10.0), v(-0.99, 0.99, -20.0)];
        let tilted = Light::new(LightShape::Parallelogram(tilted), [1.0; 3]);
        assert_eq!(pixels_of(&tilted, &view), Some([87..113, 37..53]));
        // Beside the camera, and all around it.
        for z in [0.0, 0.5] {
            let beside = LightShape::Sphere { center: v(0.5, 0.0, z), radius: 1.0, inward: false };
            assert_eq!(pixels_of(&Light::new(beside, [1.0; 3]), &view), Some([0..200, 0..100]));
        }
    }
}
