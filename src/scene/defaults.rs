//! What a scene has if its author says nothing.

use glam::DVec3;

use crate::scene::description::{Camera, Exposure, Film, Integrator, PixelFilter, Scene, Tone, Transfer};

impl Default for Scene {
    /// Nothing, and the defaults of all else.
    fn default() -> Self {
        Self {
            source: String::new(),
            camera: Camera::default(),
            film: Film::default(),
            integrator: Integrator::default(),
            background: [0.0; 3],
            environment: None,
            materials: Vec::new(),
            images: Vec::new(),
            spheres: Vec::new(),
            meshes: Vec::new(),
            lights: Vec::new(),
        }
    }
}

impl Default for Camera {
    /// A pinhole in the origin that looks along −z, with an angle of 60°.
    fn default() -> Self {
        Self {
            position: DVec3::ZERO,
            target: DVec3::NEG_Z,
            up: DVec3::Y,
            horizontal_fov: 60.0,
            orthographic_width: None,
            lens: None,
        }
    }
}

impl Default for Film {
    /// 512 × 512 pixels, Gaussian filter, gamma 2.2.
    fn default() -> Self {
        Self {
            width: 512,
            height: 512,
            filter: PixelFilter::Gaussian,
            transfer: Transfer::Gamma(2.2),
            exposure: Exposure::Stops(0.0),
            tone: Tone::None,
            transparent: false,
        }
    }
}

impl Default for Integrator {
    /// Paths of up to 8 hits, roulette from the fourth on, 64 samples per pixel, indirect light.
    fn default() -> Self {
        Self { max_depth: 8, samples: 64, russian_roulette: Some(4), indirect: true }
    }
}
