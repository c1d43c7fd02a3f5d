//! Emitters that are sampled by solid angle (shaders/lib/light/rectangle.glsl): rectangles that look large from what they light.

use glam::DVec3;

use crate::scene::Scene;

use crate::render::light::emitter::{Light, LightShape};
use crate::render::space::RenderSpace;

/// Mean solid angle, over places of the scene in front of an emitter, from which on it is sampled by that, sr. Below, it rarely
/// looks large enough for a gain, and all light that is sampled costs more (in a box of polygons 7 to 10% of the time).
const LOOKS_LARGE: f64 = 0.15;
/// Places of a mesh, and of all spheres, that are looked at.
const PLACES: usize = 64;

/// Whether a light is one of them.
pub(crate) fn looks_large(light: &Light, scene: &Scene, space: &RenderSpace) -> bool {
    match light.shape {
        LightShape::Parallelogram(corners) => {
            is_rectangle(corners) && mean_solid_angle(corners, scene, space) >= LOOKS_LARGE
        }
        _ => false,
    }
}

/// Of a corner and its two neighbours, as the shaders have them: hardly sheared, as measured by the shorter side.
fn is_rectangle(corners: [DVec3; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.as_vec3().as_dvec3());
    let (along, across) = (b - a, c - a);
    along.dot(across).abs() <= 1e-5 * along.length_squared().min(across.length_squared())
}

/// Over places in front of it.
fn mean_solid_angle(corners: [DVec3; 3], scene: &Scene, space: &RenderSpace) -> f64 {
    let [a, b, c] = corners;
    let center = 0.5 * (b + c);
    let normal = (b - a).cross(c - a);
    let step = |all: usize| all.div_ceil(PLACES).max(1);
    // Of a sphere, the place nearest to the emitter.
    let of_spheres = scene.spheres.iter().step_by(step(scene.spheres.len())).map(|sphere| {
        let middle = space.point(sphere.center);
        middle + space.length(sphere.radius) * (center - middle).normalize_or_zero()
    });
    let of_meshes = scene
        .meshes
        .iter()
        .flat_map(|mesh| mesh.positions.iter().step_by(step(mesh.positions.len())).map(|&p| space.point(p)));
    let (mut sum, mut count) = (0.0, 0);
    for place in of_spheres.chain(of_meshes) {
        let [a, b, c, d] = [a, b, c, b + c - a].map(|corner| corner - place);
        // The emitter's own corners have none.
        if a.dot(normal) < -1e-9 * a.length() * normal.length() {
            sum += solid_angle([a, b, c]) + solid_angle([b, d, c]);
            count += 1;
        }
    }
    if count == 0 { 0.0 } else { sum / f64::from(count) }
}

/// Of a triangle as seen from the origin (Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 1983).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let (x, y, z) = (a.length(), b.length(), c.length());
    let volume = a.dot(b.cross(c)).abs();
    2.0 * volume.atan2(x * y * z + a.dot(b) * z + a.dot(c) * y + b.dot(c) * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_of_a_cube_fills_a_sixth_of_the_sphere() {
        let [a, b, c, d] = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 1.0));
        let angle = solid_angle([a, b, c]) + solid_angle([b, d, c]);
        assert!((angle - 4.0 * std::f64::consts::PI / 6.0).abs() < 1e-12, "{angle}");
    }

    #[test]
    fn skewed_parallelograms_are_no_rectangles() {
        assert!(is_rectangle([DVec3::ONE, DVec3::new(1.0, 3.0, 1.0), DVec3::new(2.0, 1.0, 5.0)]));
        assert!(!is_rectangle([DVec3::ZERO, DVec3::X, DVec3::new(1e-4, 1.0, 0.0)]));
        assert!(
            !is_rectangle([DVec3::ZERO, 1e4 * DVec3::X, DVec3::new(1e-5, 1.0, 0.0)]),
            "sheared by a tenth of its width"
        );
    }
}
