//! Sampling of lights, with the records of shaders/probe/light.comp.

use bytemuck::{Pod, Zeroable};

use crate::check::probe::Kernel;

const LIGHT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/light.spv"));

impl Kernel {
    /// [`LightQuery`] → [`LightPoint`], a candidate.
    pub const LIGHT_SAMPLE: Self = Self::function("probe light", LIGHT, 0);
    /// [`LightQuery`] → [`LightPoint`], one of two candidates; it has no number.
    pub const LIGHT_RESAMPLED: Self = Self::function("probe light", LIGHT, 2);
    /// [`DensityQuery`] → [`Density`].
    pub const LIGHT_PDF: Self = Self::function("probe light", LIGHT, 1);
}

/// A surface point that asks for light, in render space, and the random numbers.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct LightQuery {
    pub from: [f32; 3],
    /// Chooses the light.
    pub choice: f32,
    pub normal: [f32; 3],
    /// Chooses among candidates; a candidate alone is chosen by its lower digits too, which follow those of `choice`. Below the even
    /// share: regardless of probabilities.
    pub candidate: f32,
    /// Choose the point on it.
    pub point: [f32; 2],
    pub unused2: [f32; 2],
}

/// Where the shadow ray ends, and what arrives.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct LightPoint {
    pub point: [f32; 3],
    /// Number of the light, −1 if none can contribute.
    pub light: i32,
    /// Times cos/π of a white diffuse surface over the density.
    pub radiance: [f32; 3],
    /// Per solid angle, with the probability of the choice; 0 for a point light.
    pub pdf: f32,
}

/// A ray that has hit a light.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct DensityQuery {
    pub from: [f32; 3],
    pub light: i32,
    pub distance: f32,
    pub cosine: f32,
    pub unused: [f32; 6],
}

/// With which density the light would have been sampled there.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct Density {
    /// Per solid angle, with the probability of the choice.
    pub pdf: f32,
    /// Of the choice.
    pub probability: f32,
    /// Of the choice, if it is by the table alone.
    pub by_table: f32,
    pub unused: [f32; 5],
}
