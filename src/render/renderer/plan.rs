//! What a rendering is decided by.

use crate::render::error::RenderError;
use crate::render::film::checkpoint::Checkpoint;
use crate::render::settings::RenderSettings;

/// Settings by which it is decided, which stay when it is gone on with to more samples.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Plan {
    /// Samples per pixel that its settings asked for when it was begun.
    pub samples: u32,
    /// Whether they limited its time.
    pub limited: bool,
}

impl Plan {
    /// That of a checkpoint, or of a rendering that begins.
    ///
    /// # Errors
    /// The checkpoint was begun with other samples than the settings say, or with more than they ask for.
    pub fn of(settings: &RenderSettings, checkpoint: Option<&Checkpoint>) -> Result<Self, RenderError> {
        let (samples, asked) = (settings.planned_samples(), settings.samples);
        let begun_with = checkpoint.map_or(samples, Checkpoint::begun_with);
        if begun_with != samples || begun_with > asked {
            return Err(RenderError::Settings(format!(
                "{asked} samples per pixel are asked for, but the checkpoint was begun with {begun_with}"
            )));
        }
        let limited = checkpoint.map_or(settings.time_limit.is_some(), |checkpoint| checkpoint.figures.limited != 0);
        Ok(Self { samples, limited })
    }
}
