//! From what was sampled to an image.

use crate::render::film::Film;
use crate::render::gradient::develop::{GradientPlan, GradientSums, use_gradients};
use crate::render::light_tracing::splats::Splats;
use crate::render::sampling::sample_map::SampleMap;

/// An image.
pub(super) struct Developed {
    pub film: Film,
    /// Whether differences between neighbouring pixels, of groups in both places, have a part in it.
    pub from_gradients: bool,
}

/// Makes an image of plain data, all of which a checkpoint or the decisions before a rendering hold: the film's sums, those of gradients
/// with what was decided about them, and the light of light paths. It needs no device.
pub(super) fn develop(
    mut film: Film,
    gradients: Option<(&GradientPlan, GradientSums)>,
    map: &SampleMap,
    splats: &Splats,
) -> Developed {
    let from_gradients = gradients.is_some_and(|(plan, sums)| use_gradients(&mut film, sums, plan, map));
    splats.add_to(&mut film);
    Developed { film, from_gradients }
}
