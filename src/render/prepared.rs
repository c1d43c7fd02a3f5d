//! What a rendering needs of the host alone.

use std::time::Instant;

use crate::scene::Scene;

use super::features::Features;
use super::settings::RenderSettings;
use super::space::RenderSpace;
use super::tables::Tables;

/// What a scene needs, its tree and its tables, for a renderer ([`Renderer::with`](super::Renderer::with)). No device has a part
/// in it, so that this can be made while one is opened.
pub struct Prepared {
    pub(crate) features: Features,
    pub(crate) tables: Tables,
    /// What that took.
    pub(crate) seconds: f64,
}

impl Prepared {
    /// Builds the tree and fills the tables.
    pub fn of(scene: &Scene, settings: &RenderSettings) -> Self {
        let start = Instant::now();
        let features = Features::of(scene, settings);
        let space = RenderSpace::of(scene);
        let tables = Tables::of(scene, &space, settings);
        Self { features, tables, seconds: start.elapsed().as_secs_f64() }
    }
}
