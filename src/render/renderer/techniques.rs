//! Which techniques a rendering may use, and what is decided about them before it.

use crate::render::gradient::develop::GradientPlan;
use crate::render::gradient::phases::{FEWEST_SAMPLES, Phases};
use crate::render::kernel::driver_traits::DriverTraits;
use crate::render::kernel::layout::mode;
use crate::render::light_tracing::tracer;
use crate::render::plan::launch::KernelOptions;
use crate::render::plan::prepared::Prepared;
use crate::render::reuse::decision::{ReuseDecision, most_left};
use crate::render::reuse::policy;
use crate::render::reuse::policy::ReusePolicy;
use crate::render::sampling::emitter_edges::looks_for_glass;
use crate::render::sampling::sample_map::SampleMap;
use crate::render::sampling::sample_map_decision::{levels_of_table, wants_sample_map};
use crate::render::sampling::stopping::Stopping;
use crate::render::settings::{Gradients, RenderSettings};
use crate::render::space::view::Rectangle;

/// What a rendering may use, by scene, settings and device.
pub(super) struct Techniques {
    pub reuse: ReusePolicy,
    /// Whether neighbours can be compared where paths are reused.
    pub gradients: bool,
    /// The part of variance that this may leave.
    most_left: f64,
    /// Whether surfaces may have two parts, of which one is shared (shaders/lib/bsdf/parts.glsl). Then most variance in the pilot pass is that
    /// of a few bright paths by microfacets and glass: it tells neither where samples are to go, nor whether gradients pay, which lower other
    /// noise.
    parts: bool,
    /// Whether numbers of samples may differ between pixels.
    pub sample_map: bool,
    /// The pixels that may show the edges of emitters; none where nobody is to look for them.
    pub emitter_bounds: Vec<Rectangle>,
    /// Whether glass and mirrors that the camera sees get more samples.
    pub glass: bool,
}

impl Techniques {
    /// Decides, and says what the kernel must be able to do for it. It depends on nothing that is compiled without being needed, so that the
    /// image does not.
    pub fn new(prepared: &Prepared<'_>, traits: &DriverTraits) -> (Self, KernelOptions) {
        let Prepared { scene, settings, features, needed, tables, .. } = prepared;
        let casters = tracer::caster_count(needed, tables);
        let reuse = policy::may_reuse(scene, needed, settings, traits) && casters == 0;
        let glass = looks_for_glass(needed, casters);
        let parts = reuse && needed.metallic_roughness;
        let sample_map = wants_sample_map(settings) && !parts && (reuse || glass || !tables.emitter_bounds.is_empty());
        let techniques = Self {
            reuse: ReusePolicy::new(needed, settings, traits, reuse),
            gradients: reuse && settings.gradients == Gradients::Auto,
            most_left: most_left(tables.samples_lights()),
            parts,
            sample_map,
            emitter_bounds: tables.emitter_bounds.clone(),
            glass,
        };
        let options = KernelOptions {
            reuse,
            gradients: techniques.gradients,
            light_samples: if reuse { tables.light_samples(settings.light_samples) } else { 1 },
            glass,
            sample_map,
            casters,
            sobol_levels: levels_of_table(features, settings, sample_map),
        };
        (techniques, options)
    }

    /// Whether pixels that see emitters, mirrors and glass are looked for.
    pub fn looks_for_edges(&self) -> bool {
        self.sample_map && (self.glass || !self.emitter_bounds.is_empty())
    }

    /// Whether the image of so many samples is made from gradients, that being decided about reuse.
    pub fn makes_gradients(&self, reuse: ReuseDecision, samples: u32, settings: &RenderSettings) -> bool {
        let samples = match &settings.adaptive {
            None => samples,
            Some(adaptive) => Stopping::of_half(adaptive, settings.samples).most(),
        };
        self.gradients
            && samples >= FEWEST_SAMPLES
            && reuse.pays(self.reuse.worth)
            && (self.parts || reuse.suits_gradients(self.most_left))
    }
}

/// What is decided about a rendering before its samples are taken.
#[derive(Debug, Clone, Default)]
pub(super) struct Decisions {
    /// Whether paths serve several pixels.
    pub reuse: bool,
    /// The variance without that over the variance with it, if it was tried.
    pub reuse_gain: Option<f64>,
    /// How the image is made from gradients, if it is.
    pub gradients: Option<GradientPlan>,
    /// How many samples each pixel gets of those that are asked for.
    pub sample_map: SampleMap,
}

impl Decisions {
    /// Where groups of pixels are.
    pub fn phases(&self) -> Phases {
        self.gradients.as_ref().map_or(Phases::NEVER_SHIFTED, |plan| plan.phases)
    }

    /// What dispatches are told of it.
    pub fn modes(&self) -> u32 {
        let reused = if self.reuse { mode::REUSED } else { 0 };
        let correlated = if self.gradients.is_some() { mode::CORRELATED } else { 0 };
        reused | correlated
    }

    /// Samples, over all of so many pixels, of an image that has `samples` per pixel in the mean.
    pub fn samples_of_image(&self, samples: u32, pixels: u64) -> u64 {
        let of_kind = |(kind, n)| self.sample_map.samples(kind, n, pixels);
        self.phases().samples(samples).into_iter().enumerate().map(of_kind).sum()
    }
}
