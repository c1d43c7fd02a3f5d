//! What the camera sees of render space, where it is the origin.

use std::ops::Range;

use glam::DVec3;

use crate::accel::Aabb;
use crate::scene::{Scene, unit};

/// Points of the picture, along either side, from which the part that shows something is estimated; or cells.
const GRID: u32 = 32;

/// Columns and rows of pixels.
pub(crate) type Rectangle = [Range<u32>; 2];

/// Pixels around those where something is seen that may show it too, since they are filtered.
const MARGIN: f64 = 3.0;

/// The image plane: at distance 1, or of parallel rays, where they start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct View {
    /// Half its width.
    pub right: DVec3,
    /// Half its height.
    pub up: DVec3,
    /// To its centre: a unit vector.
    pub forward: DVec3,
    /// Rays are parallel.
    pub orthographic: bool,
    /// Pixels of the picture, in columns and rows.
    pub size: [f64; 2],
}

impl View {
    /// Of a scene's camera and film; a length of 1 in the scene is so many units here.
    pub fn of(scene: &Scene, scale: f64) -> Self {
        let camera = &scene.camera;
        // A scene that has been checked has these directions.
        let direction = |v| unit(v).unwrap_or(DVec3::Z);
        let forward = direction(camera.target - camera.position);
        let right = direction(forward.cross(direction(camera.up)));
        let up = right.cross(forward);
        let [width, height] = [scene.film.width, scene.film.height].map(f64::from);
        let half_width = match camera.orthographic_width {
            Some(width) => scale * width / 2.0,
            None => (camera.horizontal_fov.to_radians() / 2.0).tan(),
        };
        let orthographic = camera.orthographic_width.is_some();
        let half_height = half_width * height / width;
        Self { right: right * half_width, up: up * half_height, forward, orthographic, size: [width, height] }
    }

    /// The part of the picture that shows some of these boxes, or lies before them.
    pub fn part_of(&self, boxes: &[Aabb]) -> f64 {
        let at = |i: u32| f64::from(2 * i + 1) / f64::from(GRID) - 1.0;
        let rays = (0..GRID * GRID).map(|i| self.ray(at(i % GRID), at(i / GRID)));
        let meets = |[origin, direction]: [DVec3; 2]| {
            let (origin, inverse) = (origin.as_vec3(), direction.as_vec3().recip());
            boxes.iter().any(|b| Aabb { lo: b.lo - origin, hi: b.hi - origin }.meets_ray_from_origin(inverse))
        };
        rays.filter(|ray| meets(*ray)).count() as f64 / f64::from(GRID * GRID)
    }

    /// Where the ray through a point of the image plane starts, from the middle of a lens, and its direction, of any length.
    pub fn ray(&self, x: f64, y: f64) -> [DVec3; 2] {
        let aside = x * self.right + y * self.up;
        if self.orthographic { [aside, self.forward] } else { [DVec3::ZERO, self.forward + aside] }
    }

    /// Where on the image plane, whose half sizes are 1, a point is seen: to the right, and down. None if it is not before the camera.
    fn at(&self, point: DVec3) -> Option<[f64; 2]> {
        let depth = self.forward.dot(point);
        let at = [(self.right, 1.0), (self.up, -1.0)].map(|(half, sign)| {
            sign * half.dot(point) / half.length_squared() / if self.orthographic { 1.0 } else { depth }
        });
        (depth > 1e-6 * point.length()).then_some(at)
    }

    /// The part of the picture in whose cells some of these points are, as seen from the origin.
    pub fn part_with(&self, points: impl Iterator<Item = DVec3>) -> f64 {
        let mut has_point = vec![false; (GRID * GRID) as usize];
        for p in points {
            if let Some(at) = self.at(p)
                && at.iter().all(|x| x.abs() < 1.0)
            {
                let [column, row] = at.map(|x| ((x + 1.0) / 2.0 * f64::from(GRID)) as usize);
                has_point[row * GRID as usize + column] = true;
            }
        }
        has_point.iter().filter(|&&has_point| has_point).count() as f64 / f64::from(GRID * GRID)
    }

    /// The pixels that may show what is in a box, or a little more; none if that is beyond one of the picture's sides.
    pub fn pixels_of_box(&self, lo: DVec3, hi: DVec3) -> Option<Rectangle> {
        if self.is_beyond_a_side(lo, hi) {
            return None;
        }
        let corner = |i: usize| DVec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { lo[axis] } else { hi[axis] }));
        let seen: [Option<[f64; 2]>; 8] = std::array::from_fn(|i| self.at(corner(i)));
        Some([0, 1].map(|axis| {
            let pixels = self.size[axis];
            // Anywhere for what reaches behind the camera.
            if seen.contains(&None) {
                return 0..pixels as u32;
            }
            let all = || seen.iter().flatten().map(|at| (at[axis] + 1.0) / 2.0 * pixels);
            let (first, last) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
            let inside = |x: f64| x.clamp(0.0, pixels) as u32;
            inside((first - MARGIN).floor())..inside((last + MARGIN).ceil())
        }))
    }

    /// Whether all of a box lies beyond one of the picture's sides.
    fn is_beyond_a_side(&self, lo: DVec3, hi: DVec3) -> bool {
        let beyond = |inward: DVec3| (inward * lo).max(inward * hi).element_sum() < 0.0;
        let mut sides = [self.right, self.up].into_iter().zip(self.size).flat_map(|(half, pixels)| {
            let across = half / half.length_squared();
            let reach = (1.0 + 2.0 * MARGIN / pixels) * self.forward;
            [reach - across, reach + across]
        });
        sides.any(beyond)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    #[test]
    fn a_box_covers_its_part_of_the_picture() {
        let view =
            View { right: DVec3::X, up: 0.5 * DVec3::Y, forward: DVec3::NEG_Z, orthographic: false, size: [100.0; 2] };
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
    fn points_are_in_their_cells_of_the_picture() {
        let view =
            View { right: DVec3::X, up: 0.5 * DVec3::Y, forward: DVec3::NEG_Z, orthographic: false, size: [100.0; 2] };
        // At a distance of 4 the picture reaches 4 to the sides and 2 up and down.
        let square = |side: i32| (0..side * side).map(move |i| v(f64::from(i % side), f64::from(i / side), 0.0));
        let dense = |scale: f64| square(200).map(move |p| scale * p / 100.0 + v(-4.0, -2.0, -4.0));
        assert_eq!(view.part_with(dense(4.0)), 1.0);
        assert_eq!(view.part_with(dense(2.0)), 0.5);
        assert_eq!(view.part_with(dense(2.0).map(|p| p * 1e-9)), 0.5);
        // Behind the camera, in it, beside the picture, nothing; many in one cell.
        let none = [v(0.1, 0.1, 4.0), DVec3::ZERO, v(4.1, 0.0, -4.0), v(0.0, -2.1, -4.0), DVec3::NAN];
        assert_eq!(view.part_with(none.into_iter()), 0.0);
        assert_eq!(view.part_with(std::iter::repeat_n(v(0.1, 0.1, -4.0), 9)), 1.0 / 1024.0);
    }
}
