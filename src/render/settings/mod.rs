//! What a caller decides about a rendering.

pub(crate) mod feature;
pub(crate) mod mutation;
pub(crate) mod named;
pub(crate) mod table;
pub(crate) mod techniques;

use std::path::PathBuf;
use std::time::Duration;

use crate::scene::Scene;

use crate::render::error::RenderError;
use crate::render::settings::feature::Feature;
use crate::render::settings::mutation::Mutation;

/// Which random numbers are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sampler {
    /// Owen-scrambled Sobol points: error falls faster than with independent numbers.
    #[default]
    Sobol,
    /// Independent numbers from a hash.
    Independent,
    /// Independent numbers from PCG (O'Neill 2014), for comparison.
    Pcg,
}

/// Ray–triangle test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TriangleTest {
    /// Woop, Benthin and Wald (2013): no ray slips between two triangles that share an edge.
    #[default]
    Watertight,
    /// Möller and Trumbore (1997), for comparison: rays aimed at a shared edge may miss both triangles.
    MollerTrumbore,
}

/// How triangles are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Accel {
    /// As [`Accel::Bvh`]; on GPUs with ray queries, if the [context](crate::ContextOptions::ray_query) is opened for them, as
    /// [`Accel::RayQuery`] if a trial shows that this is faster: the same bits.
    #[default]
    Auto,
    /// Through a bounding volume hierarchy.
    Bvh,
    /// Every triangle is tested, to show what the hierarchy gains.
    None,
    /// The device's ray queries find the leaves of the hierarchy, whose triangles and spheres are tested as ever: the same bits. The device
    /// has to be opened for it ([`ContextOptions::ray_query`](crate::ContextOptions::ray_query)).
    RayQuery,
    /// Experimental: the device's ray queries find triangles by the device's own test. Distances are those of ours, so that images are
    /// reproducible on one device, but at edges and where surfaces fall together they depend on it.
    RayQueryTriangles,
}

impl Accel {
    /// Whether a device has to have ray queries for it.
    pub fn needs_ray_queries(self) -> bool {
        matches!(self, Self::RayQuery | Self::RayQueryTriangles)
    }
}

/// Tests only: how acceleration structures are built. The same hits are found.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum QueryBuild {
    /// As suits the device.
    #[default]
    Plain,
    /// And then compacted.
    Compacted,
    /// Of leaves in a random order.
    Shuffled,
    /// In memory whose address is no more aligned than it has to be.
    ShiftedScratch,
}

/// How rays that need the BVH are scheduled. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheduler {
    /// On CPU drivers [`Scheduler::Queue`] for scenes with a BVH, unless it is small or there are few samples to take, for
    /// which the larger kernel does not pay; on GPUs [`Scheduler::Interleaved`] for scenes with a BVH and no light but a point, unless
    /// paths are reused; else [`Scheduler::Inline`]. Where paths are reused and groups of eight do not fit into a subgroup, always
    /// the first.
    #[default]
    Auto,
    /// Each lane traverses the BVH at once.
    Inline,
    /// Lanes whose rays are done shade what they have met while others traverse the BVH. Not where paths are reused.
    Interleaved,
    /// Paths whose rays need the BVH wait in a ray pool of their lane, which goes on with others; all lanes of a subgroup
    /// then traverse together.
    Queue,
}

/// Whether the second hits of paths, those after mirrors and glass, serve several pixels (shaders/lib/reuse.glsl). Images
/// stay exact in the mean, and noise falls to a third and less where most of it is that of indirect light; neighbouring
/// pixels have part of it in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reuse {
    /// As [`Reuse::Always`], unless a pilot pass shows that it does not pay; but neither in scenes with a hierarchy and emitters
    /// together with glass or mirrors, nor where glass fills the view, nor where light paths are traced, nor without a hierarchy on
    /// lavapipe before Mesa 23.1. On GPUs only from 512 samples per pixel on (64 with a hierarchy), and with neither a noise
    /// to stop at, nor a time limit, nor a hierarchy and emitters.
    #[default]
    Auto,
    /// Where diffuse surfaces light each other. Not with [`Accel::None`].
    Always,
    /// Each path serves its own pixel only.
    Off,
}

/// Whether an image is made from what is known of it and of the differences between neighbouring pixels, where paths serve
/// several of them (shaders/lib/gradient.glsl). It stays exact in the mean; noise falls by half and more, and what is left of
/// it is smooth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gradients {
    /// Where paths are reused, from 2 samples per pixel on, unless a pilot pass shows that most noise is of light that is not
    /// shared.
    #[default]
    Auto,
    /// Nowhere.
    Off,
}

/// Whether pixels get different numbers of samples (shaders/lib/sample_map.glsl). Where it is tried whether paths should be reused,
/// noisy parts of the image get twice or four times as many as are asked for, others a half, in the time that these would take (of two or
/// three samples, as many at least, and up to 1.4 times the samples). Besides, edges of bright emitters that are seen directly or in mirrors
/// get 2 to 32 times as many; and, where light is traced from emitters ([`LightTracing`]) and there is glass, pixels that show glass 4 times, those
/// that show a mirror twice. The image stays exact in the mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SampleMap {
    /// Where it pays: neither with more than 2²⁷ samples, nor, with 1 sample per pixel, for edges of emitters if more than half of the image
    /// may show emitters or mirrors.
    #[default]
    Auto,
    /// Nowhere.
    Off,
}

/// How many samples of lights a path takes where it first meets a diffuse surface, if it serves several pixels
/// (shaders/lib/reuse.glsl). The image stays exact in the mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LightSamples {
    /// Four, unless the only light is a point, which is always sampled alike.
    #[default]
    Auto,
    /// One, as everywhere else.
    One,
}

/// Whether light is traced from emitters through glass and by mirrors to diffuse surfaces (shaders/lib/light_tracing.glsl), where
/// paths from the camera find it by chance only. Images stay exact in the mean; bright dots of caustics go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LightTracing {
    /// In scenes with emitters, and glass or mirrors, and diffuse surfaces that light each other; but neither with
    /// [`Reuse::Always`] nor [`Accel::None`].
    #[default]
    Auto,
    /// Nowhere.
    Off,
}

/// Samples an image until its noise is low enough: as two halves that share no random numbers, with the same number of samples in all
/// pixels. Each half decides from its samples how many the other one gets, so that the image stays exact in the mean; the difference of
/// both gives the [variance](crate::render::Film::variance) of each pixel.
///
/// The noise of an image is √(mean of v/(x² + 0.01)) over pixels and channels: x is the radiance, v the variance that
/// its estimate has by chance. It is the root of the `relMSE` that [`compare`](crate::image::metrics::compare) finds
/// against the exact image. 0.01 is low noise, 0.1 a preview.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    /// The noise at which sampling stops. At 0 all samples are taken.
    pub noise: f64,
}

impl Adaptive {
    /// The fewest samples per pixel: one in each half.
    pub const LEAST_SAMPLES: u32 = 2;

    /// Checks the goal for at most `samples` per pixel.
    pub(crate) fn check(&self, samples: u32) -> Result<(), RenderError> {
        let fail = |problem: String| Err(RenderError::Settings(problem));
        if !self.noise.is_finite() || self.noise < 0.0 {
            return fail(format!("the noise to stop at is {}, expected a number that is not negative", self.noise));
        }
        if samples < Self::LEAST_SAMPLES {
            let least = Self::LEAST_SAMPLES;
            return fail(format!(
                "noise cannot be estimated from {samples} sample per pixel, expected at least {least}"
            ));
        }
        Ok(())
    }
}

/// Settings of a rendering. [`RenderSettings::of`] takes them from the scene; the default has no samples.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RenderSettings {
    /// Samples per pixel, in noisy parts more and elsewhere fewer (see [`SampleMap`]); with [`Adaptive`], the most that a pixel
    /// gets in both halves.
    pub samples: u32,
    /// The samples per pixel that a checkpoint was begun with, if it is to be gone on with to more of them.
    pub begun_with: Option<u32>,
    /// Sample to a noise.
    pub adaptive: Option<Adaptive>,
    /// Selects the random numbers; images of different seeds are independent.
    pub seed: u32,
    /// Random numbers.
    pub sampler: Sampler,
    /// Ray–triangle test.
    pub triangle_test: TriangleTest,
    /// How triangles are found.
    pub accel: Accel,
    /// How rays are scheduled.
    pub scheduler: Scheduler,
    /// Whether paths serve several pixels.
    pub reuse: Reuse,
    /// Whether differences between neighbouring pixels are used.
    pub gradients: Gradients,
    /// Whether pixels get different numbers of samples.
    pub sample_map: SampleMap,
    /// Samples of lights.
    pub light_samples: LightSamples,
    /// Whether light is traced from emitters.
    pub light_tracing: LightTracing,
    /// Stop after this time, or once every pixel has a sample if that takes longer.
    pub time_limit: Option<Duration>,
    /// Compile every feature, needed or not: for tests and benchmarks, the image is the same.
    pub general: bool,
    /// Compile one more feature than needed, to see what leaving it out saves; the image is the same.
    pub unneeded: Option<Feature>,
    /// Most samples per pixel in one dispatch; `None`: as measured. Changes no bit of the image.
    pub samples_per_dispatch: Option<u32>,
    /// Invocations of a workgroup; `None`: the device's default. Changes no bit of the image.
    pub workgroup_size: Option<u32>,
    /// Loop iterations of an invocation; `None`: what the driver is known to allow. Changes no bit of the image, unless it is too
    /// small for the pilot pass of [`SampleMap`].
    pub loop_budget: Option<u32>,
    /// Whether lanes traverse the BVH as the threads of a GPU do, each on its own; `None`: as suits the device. Changes no bit of the image.
    pub threads: Option<bool>,
    /// Invocations for the samples of a pixel, 1 or a power of two, where paths neither wait nor are reused; `None`: as many as keep the
    /// device busy. Changes no bit of the image.
    pub split: Option<u32>,
    /// Bytes of the buffers through which the film passes between host and device; `None`: 16 MiB, and no such buffers where the
    /// host sees the film. Changes no bit of the image.
    pub passage: Option<u32>,
    /// Count steps through the BVH as well; a little slower.
    pub count_steps: bool,
    /// A folder with `path_trace.spv`, `path_interleaved.spv`, `path_queue.spv`, `light_trace.spv`, `first_hit.spv` or `traverse.spv`, one of them at least, to
    /// use instead of the built-in shaders: edit a shader, run `glslc` on it, and render again without building the program.
    pub spirv_folder: Option<PathBuf>,
    /// Tests only: how acceleration structures are built.
    #[doc(hidden)]
    pub query_build: QueryBuild,
    /// Tests only: makes the trial of [`Accel::Auto`] on any device.
    #[doc(hidden)]
    pub forces_trial: bool,
    /// Tests only: breaks one thing on purpose, to show that the tests see it.
    #[doc(hidden)]
    pub mutation: Option<Mutation>,
}

impl RenderSettings {
    /// The scene's number of samples, seed 0, and defaults.
    pub fn of(scene: &Scene) -> Self {
        Self { samples: scene.integrator.samples, ..Self::default() }
    }

    /// The samples per pixel by which it is decided what a rendering is made with.
    pub(crate) fn planned_samples(&self) -> u32 {
        self.begun_with.unwrap_or(self.samples)
    }
}
