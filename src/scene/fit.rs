//! A camera that sees all of a scene.

use glam::DVec3;

use crate::scene::description::{Camera, Scene};

/// Full vertical angle of view, degrees.
const VERTICAL_FOV: f64 = 40.0;
/// From the front (+z) to the right, degrees.
const AZIMUTH: f64 = 25.0;
/// Above the horizon, degrees.
const ELEVATION: f64 = 15.0;
/// Free space around the scene, of its radius.
const MARGIN: f64 = 0.05;
/// Radius for a scene without any extent.
const LEAST_RADIUS: f64 = 1e-3;

impl Camera {
    /// A three-quarter view from the front (+z) of a sphere, in an image of these sides.
    pub fn fit(center: DVec3, radius: f64, width: u32, height: u32) -> Self {
        let (sin_azimuth, cos_azimuth) = AZIMUTH.to_radians().sin_cos();
        let (sin_elevation, cos_elevation) = ELEVATION.to_radians().sin_cos();
        let to_camera = DVec3::new(cos_elevation * sin_azimuth, sin_elevation, cos_elevation * cos_azimuth);
        let half_height = (VERTICAL_FOV / 2.0).to_radians().tan();
        let half_width = half_height * f64::from(width) / f64::from(height);
        let narrowest = half_height.min(half_width).atan();
        let distance = (1.0 + MARGIN) * radius / narrowest.sin();
        Self {
            position: center + distance * to_camera,
            target: center,
            horizontal_fov: 2.0 * half_width.atan().to_degrees(),
            ..Self::default()
        }
    }

    /// The full horizontal angle for a vertical one, both in degrees, in an image of this width over height.
    pub fn horizontal_of_vertical(vertical: f64, aspect: f64) -> f64 {
        2.0 * ((vertical.to_radians() / 2.0).tan() * aspect).atan().to_degrees()
    }
}

impl Scene {
    /// The middle of the box around all surfaces, and the distance of what is farthest from there.
    pub fn bounding_sphere(&self) -> (DVec3, f64) {
        let points = || self.meshes.iter().flat_map(|mesh| &mesh.positions);
        let (mut lo, mut hi) =
            points().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), &p| (lo.min(p), hi.max(p)));
        for sphere in &self.spheres {
            (lo, hi) = (lo.min(sphere.center - sphere.radius), hi.max(sphere.center + sphere.radius));
        }
        let center = lo.midpoint(hi);
        let of_meshes = points().map(|p| p.distance(center));
        let of_spheres = self.spheres.iter().map(|s| s.center.distance(center) + s.radius);
        let radius = of_meshes.chain(of_spheres).fold(0.0, f64::max);
        (center, if radius > 0.0 { radius } else { LEAST_RADIUS * (1.0 + center.length()) })
    }

    /// A three-quarter view of all that it has.
    pub fn fitting_camera(&self) -> Camera {
        let (center, radius) = self.bounding_sphere();
        Camera::fit(center, radius, self.film.width, self.film.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_fits_with_its_margin() {
        let center = DVec3::new(3.0, 4.0, 5.0);
        for (width, height) in [(512, 512), (640, 360), (360, 640)] {
            let camera = Camera::fit(center, 2.0, width, height);
            let to_camera = camera.position - center;
            assert!((to_camera.x / to_camera.z - 25f64.to_radians().tan()).abs() < 1e-12);
            assert!((to_camera.y / to_camera.length() - 15f64.to_radians().sin()).abs() < 1e-12);
            let half_width = (camera.horizontal_fov.to_radians() / 2.0).tan();
            let half_height = half_width * f64::from(height) / f64::from(width);
            assert!((half_height - 20f64.to_radians().tan()).abs() < 1e-12);
            let seen = (2.1 / to_camera.length()).asin().tan();
            assert!((seen - half_width.min(half_height)).abs() < 1e-12);
        }
    }
}
