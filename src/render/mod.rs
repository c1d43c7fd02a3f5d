//! From a scene to a film: what the scene needs, how it is cut into dispatches, and the loop that runs them.

pub(crate) mod engine;
pub(crate) mod first_hit;
pub(crate) mod gradient;
pub(crate) mod kernel;
pub(crate) mod plan;
pub(crate) mod scene;

mod error;
mod film;
pub(crate) mod light;
pub(crate) mod light_tracing;
pub(crate) mod renderer;
pub(crate) mod reuse;
pub(crate) mod sampling;
mod settings;
pub(crate) mod space;
mod statistics;

pub use crate::render::error::RenderError;
pub use crate::render::film::Film;
pub use crate::render::film::checkpoint::{Checkpoint, CheckpointError};
pub use crate::render::first_hit::SeenSurface;
pub use crate::render::kernel::features::Features;
pub use crate::render::kernel::shaders_hash;
pub use crate::render::kernel::sobol::MAX_SAMPLES;
pub use crate::render::kernel::specialization::explain;
pub use crate::render::plan::prepared::Prepared;
pub use crate::render::renderer::Renderer;
pub use crate::render::settings::feature::{Feature, FeatureFlags};
pub use crate::render::settings::mutation::Mutation;
pub use crate::render::settings::named::Choice;
pub use crate::render::settings::table::{Audience, Setting, Values};
pub use crate::render::settings::techniques::TechniqueList;
pub use crate::render::settings::{
    Accel, Adaptive, Gradients, LightSamples, LightTracing, QueryBuild, RenderSettings, Reuse, SampleMap, Sampler,
    Scheduler, TriangleTest,
};
pub use crate::render::statistics::{AdaptiveStatistics, Progress, RenderStatistics};
