//! What is decided before a rendering, from samples that are not the image's.

use std::mem::take;

use crate::render::error::RenderError;
use crate::render::film::tiling::BLOCK;
use crate::render::gradient::develop::GradientPlan;
use crate::render::gradient::phases::Phases;
use crate::render::gradient::surfaces::find_diffuse_places;
use crate::render::gradient::weights::class_weights;
use crate::render::kernel::layout::queue;
use crate::render::renderer::Renderer;
use crate::render::renderer::plan::Plan;
use crate::render::renderer::techniques::Decisions;
use crate::render::reuse::decision::ReuseDecision;
use crate::render::reuse::pilot::{PilotOptions, run_pilot};
use crate::render::sampling::emitter_edges::{EdgeSearch, look_for_edges};
use crate::render::sampling::sample_map::Grid;
use crate::render::sampling::sample_map_decision::{allocate_samples, fits_sample_map};
use crate::render::settings::mutation::Mutation;

impl Renderer {
    /// Before a rendering: whether paths are reused, whether the image is made from gradients, and how many samples
    /// each pixel gets. It depends on no random number of the image. The film is left to the caller.
    pub(super) fn decide(&mut self, Plan { samples, limited }: Plan) -> Result<Decisions, RenderError> {
        let Self { settings, techniques, engine, first_hits, .. } = self;
        let may_map = techniques.sample_map
            && fits_sample_map(settings, engine.launch.kernel.sobol_levels)
            && (!engine.launch.kernel.reuse || engine.has_whole_rows());
        let may_allocate = may_map && settings.adaptive.is_none() && samples >= queue::PILOT_SAMPLES;
        let [width, height] = engine.size();
        let grid = Grid { width, height, band_rows: engine.band_rows() };

        let search = EdgeSearch {
            emitter_bounds: &techniques.emitter_bounds,
            glass: techniques.glass,
            samples,
            own_seed: settings.mutation == Some(Mutation::OwnSampleMap),
        };
        let wanted =
            if may_map { look_for_edges(engine, first_hits, &search)?.unwrap_or_default() } else { Vec::new() };

        let mut reuse = techniques.reuse.before(samples);
        let mut decisions = Decisions::default();
        let gradients = techniques.makes_gradients(reuse, samples, settings);
        let due = reuse == ReuseDecision::Pending || (reuse == ReuseDecision::Always && gradients);
        if due && samples >= queue::PILOT_SAMPLES {
            let tells_tiles = may_allocate && !limited;
            let pilot = run_pilot(engine, PilotOptions::new(samples, tells_tiles, gradients), &wanted)?;
            if reuse == ReuseDecision::Pending {
                reuse = pilot.reuse;
            }
            let reuses = reuse.pays(techniques.reuse.worth);
            log::debug!("reuse of paths: {reuse:?}, {reuses}");
            if techniques.makes_gradients(reuse, samples, settings) {
                let places = find_diffuse_places(engine, first_hits)?;
                let weights = class_weights(&pilot.pairs, &places);
                log::debug!("weights of differences: {weights:?}");
                let phases = match settings.adaptive {
                    None => Phases::new(samples, limited),
                    Some(_) => Phases::OfDoublings,
                };
                let band_rows = grid.band_rows as usize;
                decisions.gradients = Some(GradientPlan { phases, places, weights, band_rows });
            }
            if may_allocate {
                let made = [reuses, decisions.gradients.is_some()];
                decisions.sample_map = allocate_samples(&pilot, made, grid, samples);
            }
        }
        decisions.reuse = reuse.pays(techniques.reuse.worth);
        decisions.reuse_gain = reuse.gain();
        // To a noise, pixels get different numbers of samples only where the image is made from gradients.
        if settings.adaptive.is_none() || decisions.gradients.is_some() {
            let grid = if decisions.reuse { grid } else { Grid { band_rows: BLOCK[1], ..grid } };
            decisions.sample_map = take(&mut decisions.sample_map).with_at_least(&wanted, decisions.reuse, grid);
        }
        Ok(decisions)
    }
}
