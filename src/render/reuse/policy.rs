//! Where paths are tried to serve several pixels at all, and what a pilot pass must show.

use crate::scene::Scene;

use crate::render::kernel::driver_traits::{DriverTraits, Sharers};
use crate::render::kernel::features::{Features, glass_fills_view};
use crate::render::reuse::decision::ReuseDecision;
use crate::render::settings::{RenderSettings, Reuse};

/// When paths serve several pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReusePolicy {
    /// What is asked for, where the kernel can.
    mode: Reuse,
    /// Samples per pixel from which on.
    fewest_samples: u32,
    /// By how much variance must fall in the pilot pass.
    pub worth: f64,
}

impl ReusePolicy {
    /// Of a scene that needs these features, on such a device, if the kernel is one that can reuse paths or not.
    pub fn new(needed: &Features, settings: &RenderSettings, traits: &DriverTraits, can: bool) -> Self {
        Self {
            mode: if can { settings.reuse } else { Reuse::Off },
            fewest_samples: fewest_samples(needed, settings.reuse, traits),
            worth: worth(needed, traits),
        }
    }

    /// What is decided before a rendering of so many samples per pixel.
    pub fn before(&self, samples: u32) -> ReuseDecision {
        if samples >= self.fewest_samples { ReuseDecision::from_mode(self.mode) } else { ReuseDecision::Never }
    }
}

/// Whether paths may serve several pixels, in a scene that needs these features, on such a device. It depends on neither
/// scheduler nor on what else is compiled, so that the image does not.
///
/// With a BVH and emitters together with smooth glass or mirrors it hardly pays: the noise of caustics is left, and a pilot pass that is lost
/// makes the rest slower (by 1.3). Nor does it pay for models in the open, under an environment or a background: their surfaces have two parts,
/// and most light there is direct. (Where light paths take most of that noise paths cannot be shared.) Brute force is
/// for comparison, not for speed.
///
/// On GPUs the host's part of it takes time: for each pixel what 100 to 600 samples take without a BVH, and 30 to 100 with one.
/// Threads that choose among lights and traverse a BVH hold too much: with emitters a sample takes 7 to 20 times the time (H100), and
/// surfaces of two parts hold more. Where glass fills the picture it takes 4 times the time, for less than half of the variance at best.
pub(crate) fn may_reuse(scene: &Scene, needed: &Features, settings: &RenderSettings, traits: &DriverTraits) -> bool {
    needed.can_reuse()
        && !needed.brute_force
        && traits.groups_fit
        && match (settings.reuse, traits.reuse) {
            (Reuse::Off, _) | (Reuse::Auto, Sharers::None) => false,
            (Reuse::Always, _) => true,
            (Reuse::Auto, Sharers::Lanes) => {
                !(needed.bvh && needed.has_caustics()) && (needed.diffuse || (needed.emitter && !needed.environment))
            }
            // Who waits for a time or a noise gets samples at once.
            (Reuse::Auto, Sharers::Threads) => {
                settings.samples >= fewest_samples(needed, settings.reuse, traits)
                    && settings.adaptive.is_none()
                    && settings.time_limit.is_none()
                    && !needed.metallic_roughness
                    && !(needed.bvh && (needed.emitter || (needed.dielectric && glass_fills_view(scene))))
            }
        }
}

/// Samples per pixel that a rendering has at least for it to be tried.
fn fewest_samples(needed: &Features, reuse: Reuse, traits: &DriverTraits) -> u32 {
    match (reuse, traits.reuse) {
        (Reuse::Auto, Sharers::Threads) if needed.bvh => 64,
        (Reuse::Auto, Sharers::Threads) => 512,
        _ => 0,
    }
}

/// By how much variance must fall in the pilot pass for reuse to pay. With a BVH a sample takes 1.4 to 2.3 times the time
/// (measured on lavapipe, scenes with meshes of 35 thousand to a million triangles); the least of these, since the noise that
/// reuse does not lower, of edges and of emitters, falls faster with further samples. Without a BVH it takes 1.9 to 2.1 times the
/// time, but the kernel that could reuse paths and does not takes 1.2 times that of one that could not.
///
/// Of surfaces with two parts the pilot pass tells too little, since most variance there is that of a few bright paths: 1.3 to 2.2 where
/// 1.6 to 2.1 are gained.
///
/// On GPUs a sample takes 2.4 to 4 times the time; a room of balls, one of glass, gains 3, one of diffuse balls and a mirror 4.1 to 8.
fn worth(needed: &Features, traits: &DriverTraits) -> f64 {
    match traits.reuse {
        Sharers::Threads => 4.0,
        _ if needed.metallic_roughness => 1.25,
        _ if needed.bvh => 1.4,
        _ => 1.8,
    }
}
