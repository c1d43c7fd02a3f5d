//! From a scene to a film: what the scene needs, how it is cut into dispatches, and the loop that runs them.

mod aims;
mod alias;
mod aliased;
mod allocation;
#[cfg(test)]
mod allocation_tests;
mod beam_light;
mod beams;
pub(crate) mod bindings;
mod checkpoint;
mod choice;
mod contrast;
mod corners;
pub(crate) mod driver;
mod error;
mod facets;
mod features;
mod film;
pub(crate) mod gather;
mod geometry;
pub(crate) mod kernels;
mod lamp_places;
pub(crate) mod layout;
#[cfg(test)]
mod layout_tests;
mod light_grid;
mod light_list;
mod light_tree;
mod lights;
mod mutation;
mod plan;
mod prepared;
mod progression;
#[cfg(test)]
mod progression_tests;
mod rectangles;
pub(crate) mod renderer;
mod screened_poisson;
mod settings;
mod shares;
mod sides;
pub(crate) mod sobol;
pub(crate) mod space;
mod spheres;
mod statistics;
mod stopping;
pub(crate) mod tables;
mod targets;
mod tiles;
mod twin_films;
mod upload;
mod view;

pub use checkpoint::{Checkpoint, CheckpointError};
pub use choice::Choice;
pub use error::RenderError;
pub use features::{Feature, Features};
pub use film::Film;
pub use kernels::shaders_hash;
pub use mutation::Mutation;
pub use prepared::Prepared;
pub use renderer::Renderer;
pub use settings::{
    Accel, Adaptive, Aims, Beams, Glances, Gradients, LightSamples, RenderSettings, Reuse, Sampler, Scheduler, Shares,
    TriangleTest,
};
pub use sobol::MAX_SAMPLES;
pub use statistics::{AdaptiveStatistics, Progress, RenderStatistics};

/// Builds the tree of a scene and measures it; `None` if the scene needs none under these settings.
pub fn tree_statistics(scene: &crate::scene::Scene, settings: &RenderSettings) -> Option<crate::accel::TreeStatistics> {
    tables::Tables::of(scene, &space::RenderSpace::of(scene), settings).tree
}
