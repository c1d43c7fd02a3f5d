//! Render space: scene space moved and scaled so that single precision is at its best where it matters.
//!
//! The camera is the origin, so that a scene far from its own origin loses nothing. One unit is a power of two near
//! the size of what is seen, so that huge and tiny scenes give the same bits and nothing overflows.

pub(crate) mod bounds;
pub(crate) mod view;

use glam::{DVec3, Vec3};

use crate::scene::Scene;

/// The map from scene space to render space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RenderSpace {
    origin: DVec3,
    scale: f64,
    /// Largest distance from the origin at which the camera's rays start.
    pub aperture: f64,
    /// Largest distance from the origin at which rays are expected to start, in render space.
    pub reach: f64,
}

impl RenderSpace {
    pub fn of(scene: &Scene) -> Self {
        let origin = scene.camera.position;
        let aperture = aperture(scene);
        let mut near: f64 = aperture;
        for position in scene.lights.iter().filter_map(|light| light.position()) {
            near = near.max(position.distance(origin));
        }
        for mesh in &scene.meshes {
            let farthest = mesh.positions.iter().map(|p| p.distance_squared(origin)).fold(0.0, f64::max);
            near = near.max(farthest.sqrt());
        }
        for sphere in &scene.spheres {
            near = near.max((sphere.center.distance(origin) - sphere.radius).abs());
        }
        // Of spheres much larger than that only the near side is seen: the walls of a room.
        let reach = scene
            .spheres
            .iter()
            .filter(|s| s.radius <= 2.0 * near)
            .map(|s| s.center.distance(origin) + s.radius)
            .fold(near, f64::max);
        let reach = if reach > 0.0 && reach.is_finite() { reach } else { 1.0 };
        // The power of two below: exact, so that scaling the scene by 2^k scales nothing here. No vertex has a coordinate that rounds to 2,
        // which leaves a bit of each free (src/accel/record.rs).
        let scale = 2f64.powi(-exponent(reach * 1.0001));
        Self { origin, scale, aperture: aperture * scale, reach: reach * scale }
    }

    pub fn point(&self, p: DVec3) -> DVec3 {
        (p - self.origin) * self.scale
    }

    /// The inverse of [`Self::point`].
    pub fn scene_point(&self, p: DVec3) -> DVec3 {
        p / self.scale + self.origin
    }

    pub fn point32(&self, p: DVec3) -> Vec3 {
        self.point(p).as_vec3()
    }

    /// The corners of a triangle in single precision; `None` if that leaves it no area. A line or a point has no
    /// inside, and rounding must not give it one: of a point every ray passes on the inner side of each "edge".
    pub fn triangle32(&self, corners: [DVec3; 3]) -> Option<[Vec3; 3]> {
        let rounded = corners.map(|p| self.point32(p));
        // The products of differences of floats are exact in f64 but for their last bits.
        let [a, b, c] = rounded.map(|p| p.as_dvec3());
        ((b - a).cross(c - a) != DVec3::ZERO).then_some(rounded)
    }

    pub fn length(&self, l: f64) -> f64 {
        l * self.scale
    }

    /// The inverse of [`Self::length`].
    pub fn scene_length(&self, l: f64) -> f64 {
        l / self.scale
    }

    /// Power over area is what reaches a surface: power scales like an area.
    pub fn power(&self, p: f64) -> f64 {
        p * self.scale * self.scale
    }
}

/// Pixels from its own that a ray may start at most: of a normal distribution, with numbers of 24 bits, and a deviation of half a pixel.
const MOST_PIXELS_OFF: f64 = 4.0;

/// Largest distance from a scene's camera at which its rays start.
pub(crate) fn aperture(scene: &Scene) -> f64 {
    let [width, height] = [scene.film.width, scene.film.height].map(f64::from);
    let plane = scene.camera.orthographic_width.map_or(0.0, |of| {
        let pixel = of / width;
        pixel * (width / 2.0 + MOST_PIXELS_OFF).hypot(height / 2.0 + MOST_PIXELS_OFF)
    });
    plane + scene.camera.lens.map_or(0.0, |lens| lens.radius)
}

/// ⌊log₂ x⌋ of a normal x > 0, exactly.
fn exponent(x: f64) -> i32 {
    ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023
}
