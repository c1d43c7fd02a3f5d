//! What a rendering needs of the host alone.

pub(crate) mod casters;
pub(crate) mod collect;
pub(crate) mod containment;
pub(crate) mod coplanar;
pub(crate) mod geometry;
pub(crate) mod light_paths;
pub(crate) mod polygons;
pub(crate) mod spheres;
pub(crate) mod tables;

use std::time::Instant;

use crate::scene::Scene;

use crate::render::error::RenderError;
use crate::render::kernel::features::Features;
use crate::render::sampling::sobol;
use crate::render::scene::tables::Tables;
use crate::render::settings::RenderSettings;
use crate::render::space::RenderSpace;

/// A scene with its tree and its tables, for a renderer ([`Renderer::with`](crate::render::Renderer::with)). No device has a part in it, so
/// that this can be made while one is opened.
pub struct Prepared<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) settings: &'a RenderSettings,
    pub(crate) features: Features,
    pub(crate) tables: Tables,
    /// What that took.
    pub(crate) seconds: f64,
}

impl<'a> Prepared<'a> {
    /// Builds the tree and fills the tables. The scene must be [valid](Scene::validate), as those are that have been loaded: of others
    /// there is no image, or a panic.
    ///
    /// # Errors
    /// The settings make no sense.
    pub fn of(scene: &'a Scene, settings: &'a RenderSettings) -> Result<Self, RenderError> {
        let start = Instant::now();
        check(settings)?;
        let features = Features::of(scene, settings);
        let tables = Tables::of(scene, &RenderSpace::of(scene), settings);
        Ok(Self { scene, settings, features, tables, seconds: start.elapsed().as_secs_f64() })
    }
}

fn check(settings: &RenderSettings) -> Result<(), RenderError> {
    if settings.samples == 0 {
        return Err(RenderError::Settings("the number of samples is 0, expected at least 1".to_owned()));
    }
    if settings.samples > sobol::MAX_SAMPLES {
        return Err(RenderError::Settings(format!(
            "the number of samples is {}, expected at most {}",
            settings.samples,
            sobol::MAX_SAMPLES
        )));
    }
    if let Some(adaptive) = &settings.adaptive {
        adaptive.check(settings.samples)?;
    }
    Ok(())
}
