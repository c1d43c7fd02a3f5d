//! What a rendering needs of the host alone.

use std::time::Instant;

use bytemuck::Zeroable;

use crate::accel::BvhStatistics;
use crate::scene::Scene;

use crate::render::error::RenderError;
use crate::render::kernel::features::Features;
use crate::render::kernel::layout::Push;
use crate::render::kernel::sobol;
use crate::render::scene::tables::Tables;
use crate::render::settings::RenderSettings;
use crate::render::space::RenderSpace;

/// A scene with its BVH and its tables, for a renderer ([`Renderer::with`](crate::render::Renderer::with)). No device has a part in it, so
/// that this can be made while one is opened.
pub struct Prepared<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) settings: &'a RenderSettings,
    pub(crate) features: Features,
    /// Those that the scene needs, even if the kernel is to be a general one.
    pub(crate) needed: Features,
    pub(crate) tables: Tables,
    /// What that took.
    pub(crate) seconds: f64,
}

impl<'a> Prepared<'a> {
    /// Builds the BVH and fills the tables. The scene must be [valid](Scene::validate), as those are that have been loaded: of others
    /// there is no image, or a panic.
    ///
    /// # Errors
    /// The settings make no sense.
    pub fn of(scene: &'a Scene, settings: &'a RenderSettings) -> Result<Self, RenderError> {
        let start = Instant::now();
        check(settings)?;
        let tables = Tables::new(scene, &RenderSpace::of(scene), settings);
        let features = Features::new(scene, &tables, settings);
        let needed = if settings.general || settings.unneeded.is_some() {
            Features::new(scene, &tables, &RenderSettings { general: false, unneeded: None, ..settings.clone() })
        } else {
            features.clone()
        };
        Ok(Self { scene, settings, features, needed, tables, seconds: start.elapsed().as_secs_f64() })
    }

    /// What the scene needs, and what more is asked for.
    pub fn features(&self) -> &Features {
        &self.features
    }

    /// Figures of the BVH, if there is one.
    pub fn bvh(&self) -> Option<&BvhStatistics> {
        self.tables.bvh.as_ref()
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

/// The push constants of a rendering, before a dispatch adds its own.
pub(crate) fn push_constants(scene: &Scene, settings: &RenderSettings) -> Push {
    Push { width: scene.film.width, height: scene.film.height, seed: settings.seed, ..Push::zeroed() }
}
