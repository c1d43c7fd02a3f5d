//! Where samples are several paths (shaders/lib/glance.glsl): where the camera sees glass or a mirror first.

use super::super::error::RenderError;
use super::super::features::Features;
use super::super::layout::{glance, mode};
use super::super::settings::{Glances, RenderSettings};
use super::Renderer;

/// Paths of a sample where a mirror, and where glass is seen first. Variance × time with 2 and with 4 through glass, against 1:
/// .57 and .41 (a mesh of glass), .73 and .56 (an icosphere of glass), .72 and .58 (balls), lavapipe 25.0.7; 8 change little.
/// By mirrors 2 take that to .97 and .89 where there is glass as well; where there is none, to .94 at best.
const BY_MIRRORS: u32 = 2;
const THROUGH_GLASS: u32 = 4;
// A block of the sampler's table holds the paths of a whole number of samples.
const _: () = assert!(1024 % BY_MIRRORS == 0 && 1024 % THROUGH_GLASS == 0);
/// What the seed is changed by (XOR) for the survey: pixels at the edge of glass whose samples were chosen by their own first one
/// would be biased towards what is beside it.
const SEED: u32 = 0x1715_609d;
/// Deeper paths do without: where loops have a budget, a sample must fit in as a whole.
const MOST_DEPTH: u32 = 64;

/// Whether samples may be several paths, in a scene that needs these features and with so many targets of beams.
pub(super) fn may_repeat(needed: &Features, beam_targets: u32, settings: &RenderSettings) -> bool {
    settings.glances == Glances::Auto && beam_targets > 0 && needed.dielectric && needed.max_depth <= MOST_DEPTH
}

/// How a sample of so many paths begins; one begins as ever.
pub(super) fn sample(paths: u32) -> u32 {
    if paths > 1 { glance::REPEATED | paths << glance::REPEATS_SHIFT | (paths - 1) } else { 0 }
}

impl Renderer {
    /// Of how many paths the samples of each pixel are, row by row; `None` if that was not looked for. Leaves samples in the film if it
    /// was.
    pub(super) fn look_for_glass(&mut self) -> Result<Option<Vec<u32>>, RenderError> {
        if !self.launch.repeats {
            return Ok(None);
        }
        self.clear_film()?;
        let whole = self.whole_film();
        self.beforehand(|renderer| {
            renderer.push.modes |= mode::SURVEY;
            renderer.push.seed ^= SEED;
            renderer.sample_once(&whole)
        })?;
        let mut paths = vec![1; self.width as usize * self.height as usize];
        self.read_pixels(&whole, &mut paths, |paths, slot| {
            // What the survey tells: 0 a diffuse surface, 1 a mirror, 2 glass.
            *paths = match slot.total(0) {
                0.0 => 1,
                1.0 => BY_MIRRORS,
                _ => THROUGH_GLASS,
            };
        })?;
        Ok(Some(paths))
    }
}
