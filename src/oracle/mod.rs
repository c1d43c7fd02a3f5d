//! The oracle: a plain double-precision path tracer on the CPU, which the tests of the renderer trust.
//!
//! It is meant to be read in one sitting and believed: every ray is tested against every primitive, every
//! random number comes from a published generator that the shaders do not use, and nothing is shared with
//! the GPU but the [`Scene`]. It is slow, and is not meant for pictures.
//!
//! # What a path is
//! A path has at most `D = max_depth` surface hits, mirror and glass included. Each hit scatters light that
//! comes to it directly: from point lights, from emitters and from the background. Point lights are
//! connected to explicitly. Emitters and the background are only found by chance, along the ray that
//! leaves the hit; so the ray that leaves hit `D` is still traced, and carries back the emission or the
//! background it meets and nothing else. Emission therefore counts at hits `1..=D + 1`.
//!
//! With `indirect = false` the first diffuse hit takes the part of hit `D`.
//!
//! A path knows the medium that it runs in: that of the last body which it entered, or whose back it meets. Light that meets a surface
//! there has lost what the medium absorbs on the way.
//!
//! Lambertian surfaces and mirrors act on both sides. Every surface casts full shadows, glass too. Radiance is
//! not scaled by n² on refraction (it cancels for every camera and light outside of glass).

pub mod bsdf;
mod camera;
pub mod glass;
mod integrator;
pub mod material;
pub mod metallic_roughness;
mod rng;
pub mod trace;

pub use crate::oracle::bsdf::{cosine_hemisphere, fresnel, reflect, refract};
pub use crate::oracle::camera::{film_offset, lens_offset, primary_ray};
pub use crate::oracle::integrator::{direct_irradiance, radiance};
pub use crate::oracle::rng::Pcg64;
pub use crate::oracle::trace::{Hit, Primitive, Ray};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::scene::{Rgb, Scene};

/// How long and with which random numbers to render.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OracleSettings {
    /// Samples per pixel, at least 1; replaces the scene's own number.
    pub samples: u32,
    /// Equal seeds give equal bits, whatever the number of threads.
    pub seed: u64,
}

/// A rendered image, row 0 on top, with an estimate of its noise.
#[derive(Debug, Clone, PartialEq)]
pub struct OracleImage {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Linear radiance per pixel, row by row.
    pub mean: Vec<Rgb>,
    /// Unbiased estimate of the variance of each `mean`; NaN where it comes from a single sample.
    pub variance_of_mean: Vec<Rgb>,
}

impl OracleImage {
    /// Mean over all pixels, and its standard error, per channel.
    pub fn global_mean(&self) -> (Rgb, Rgb) {
        let pixels = self.mean.len() as f64;
        let sum = |values: &[Rgb]| values.iter().map(|&v| DVec3::from(v)).sum::<DVec3>();
        let variance = sum(&self.variance_of_mean) / (pixels * pixels);
        let error = DVec3::new(variance.x.sqrt(), variance.y.sqrt(), variance.z.sqrt());
        ((sum(&self.mean) / pixels).into(), error.into())
    }
}

/// Renders `scene`, in parallel on the current rayon pool.
///
/// The scene must be valid: indices in range, numbers finite.
pub fn render(scene: &Scene, settings: &OracleSettings) -> OracleImage {
    let (width, height) = (scene.film.width, scene.film.height);
    let row = |y: u32| {
        (0..width).map(move |x| {
            let index = u64::from(y) * u64::from(width) + u64::from(x);
            let mut rng = Pcg64::for_pixel(settings.seed, index);
            pixel(scene, x, y, settings.samples, &mut rng)
        })
    };
    let (mean, variance_of_mean) = (0..height).into_par_iter().flat_map_iter(row).unzip();
    OracleImage { width, height, mean, variance_of_mean }
}

/// Mean and variance of the mean of one pixel (Welford's update).
fn pixel(scene: &Scene, x: u32, y: u32, samples: u32, rng: &mut Pcg64) -> (Rgb, Rgb) {
    let (mut mean, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for n in 1..=samples {
        let film = DVec2::new(f64::from(x), f64::from(y)) + film_offset(scene.film.filter, rng);
        let lens = scene.camera.lens.map_or(DVec2::ZERO, |_| lens_offset(rng));
        let sample = radiance(scene, primary_ray(scene, film, lens), rng);
        let delta = sample - mean;
        mean += delta / f64::from(n);
        squares += delta * (sample - mean);
    }
    let n = f64::from(samples);
    (mean.into(), (squares / (n * (n - 1.0))).into())
}
