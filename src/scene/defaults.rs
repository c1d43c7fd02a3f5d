//! What a scene has if its author says nothing.

use crate::scene::description::{Film, Integrator, PixelFilter, Transfer};

impl Default for Film {
    /// 512 × 512 pixels, Gaussian filter, gamma 2.2.
    fn default() -> Self {
        Self { width: 512, height: 512, filter: PixelFilter::Gaussian, transfer: Transfer::Gamma(2.2) }
    }
}

impl Default for Integrator {
    /// Paths of up to 8 hits, roulette from the fourth on, 64 samples per pixel, indirect light.
    fn default() -> Self {
        Self { max_depth: 8, samples: 64, russian_roulette: Some(4), indirect: true }
    }
}
