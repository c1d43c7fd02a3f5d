//! What the camera sees of render space, where it is the origin.

use glam::DVec3;

use crate::accel::Aabb;
use crate::scene::Scene;

use super::lights::{Light, LightShape};

/// Points of the picture, along either side, from which the part that shows something is estimated.
const GRID: u32 = 32;

/// The image plane at distance 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct View {
    /// Half its width.
    pub right: DVec3,
    /// Half its height.
    pub up: DVec3,
    /// To its centre: a unit vector.
    pub forward: DVec3,
    /// Half a pixel's width and height, the plane's half sizes being 1.
    half_pixel: [f64; 2],
}

impl View {
    /// Of a scene's camera and film.
    pub fn of(scene: &Scene) -> Self {
        let camera = &scene.camera;
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(camera.up.normalize()).normalize();
        let up = right.cross(forward);
        let [width, height] = [scene.film.width, scene.film.height].map(f64::from);
        let half_width = (camera.horizontal_fov.to_radians() / 2.0).tan();
        let half_height = half_width * height / width;
        Self { right: right * half_width, up: up * half_height, forward, half_pixel: [1.0 / width, 1.0 / height] }
    }

    /// The part of the picture that shows some of these boxes, or lies before them.
    pub fn part_of(&self, boxes: &[Aabb]) -> f64 {
        let at = |i: u32| f64::from(2 * i + 1) / f64::from(GRID) - 1.0;
        let directions = (0..GRID * GRID).map(|i| self.forward + at(i % GRID) * self.right + at(i / GRID) * self.up);
        let meets = |direction: DVec3| {
            let inverse = direction.as_vec3().recip();
            boxes.iter().any(|b| b.meets_ray_from_origin(inverse))
        };
        directions.filter(|direction| meets(*direction)).count() as f64 / f64::from(GRID * GRID)
    }

    /// Whether a light's surface may be in the picture: not more than three pixels beyond one of its sides, and not
    /// turned away.
    pub fn may_show(&self, light: &Light) -> bool {
        let faces = match light.shape {
            LightShape::Point(_) => false,
            LightShape::Triangle([a, b, c]) | LightShape::Parallelogram([a, b, c]) => (b - a).cross(c - a).dot(a) < 0.0,
            LightShape::Sphere { .. } => true,
        };
        let (lo, hi) = light.bounds();
        let beyond = |inward: DVec3| (inward * lo).max(inward * hi).element_sum() < 0.0;
        let margin = |half_pixel: f64| 1.0 + 6.0 * half_pixel;
        let sides = [self.right, self.up].into_iter().zip(self.half_pixel).flat_map(|(half, half_pixel)| {
            let across = half / half.length_squared();
            [margin(half_pixel) * self.forward - across, margin(half_pixel) * self.forward + across]
        });
        faces && !sides.into_iter().any(beyond)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    fn square(center: DVec3, half: f64) -> Light {
        // Faces +z.
        let corner = center - v(half, half, 0.0);
        let shape = LightShape::Parallelogram([corner, corner + 2.0 * half * DVec3::X, corner + 2.0 * half * DVec3::Y]);
        Light { shape, radiance: [1.0; 3] }
    }

    #[test]
    fn a_box_covers_its_part_of_the_picture() {
        let view = View { right: DVec3::X, up: 0.5 * DVec3::Y, forward: DVec3::NEG_Z, half_pixel: [0.01; 2] };
        let of = |lo: [f32; 3], hi: [f32; 3]| Aabb { lo: lo.into(), hi: hi.into() };
        // The right half of the picture, and the quarter on the left above.
        let (right, above) = (of([0.0, -9.0, -5.0], [9.0, 9.0, -4.0]), of([-5.0, 0.0, -4.0], [-0.1, 3.0, -4.0]));
        assert_eq!(view.part_of(&[right]), 0.5);
        assert_eq!(view.part_of(&[right, above]), 0.75);
        assert_eq!(view.part_of(&[right, right]), 0.5);
        // Around the camera, behind it, nothing.
        assert_eq!(view.part_of(&[of([-1.0; 3], [1.0; 3])]), 1.0);
        assert_eq!(view.part_of(&[of([-9.0, -9.0, 1.0], [9.0; 3])]), 0.0);
        assert_eq!(view.part_of(&[]), 0.0);
    }

    #[test]
    fn lamps_beyond_a_side_are_not_shown() {
        let half_pixel = [1.0 / 200.0, 1.0 / 100.0];
        let view = View { right: DVec3::X, up: 0.5 * DVec3::Y, forward: DVec3::NEG_Z, half_pixel };
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
            assert_eq!(view.may_show(&square(v(x, y, -10.0), 1.0)), shown, "{x} {y}");
            let sphere = LightShape::Sphere { center: v(x, y, -10.0), radius: 1.0, inward: false };
            assert_eq!(view.may_show(&Light { shape: sphere, radiance: [1.0; 3] }), shown, "{x} {y}");
        }
        // Behind the camera, and seen from behind.
        assert!(!view.may_show(&square(v(0.0, 0.0, 10.0), 1.0)));
        let mut turned = square(v(0.0, 0.0, -10.0), 1.0);
        if let LightShape::Parallelogram([_, b, c]) = &mut turned.shape {
            std::mem::swap(b, c);
        }
        assert!(!view.may_show(&turned));
        // All around it.
        let around = LightShape::Sphere { center: DVec3::ZERO, radius: 3.0, inward: true };
        assert!(view.may_show(&Light { shape: around, radiance: [1.0; 3] }));
        assert!(!view.may_show(&Light { shape: LightShape::Point(v(0.0, 0.0, -1.0)), radiance: [1.0; 3] }));
    }
}
