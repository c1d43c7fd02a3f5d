//! What has been done of a rendering that was stopped, to go on with at another time.

use std::hash::Hasher;
use std::io::{self, Write};

use bytemuck::{Pod, Zeroable};

use crate::gpu::StageTime;
use crate::hash::Fnv;

use crate::render::kernel::layout::{Counters, FilmSlot, GradientSlot};
use crate::render::statistics::RenderStatistics;

/// The beginning of a file; the number is that of the format.
const MAGIC: &[u8; 24] = b"photolith checkpoint 2\n\n";

/// The film, exactly as it is on the device, and what was counted: [`Renderer::checkpoint`](crate::render::Renderer::checkpoint).
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    pub(crate) figures: Figures,
    pub(crate) film: Vec<FilmSlot>,
    /// None where no image is made from gradients.
    pub(crate) gradients: Vec<GradientSlot>,
    /// Sums of the light of light paths, row by row; none where no light paths are traced.
    pub(crate) light_paths: Vec<[f64; 3]>,
}

/// Numbers about it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct Figures {
    /// Samples per pixel that were asked for when the rendering began: what was decided about it is decided by them.
    pub begun_with: u32,
    /// Whether its time was limited then.
    pub limited: u32,
    /// Samples per pixel before the part of the rendering, with groups of pixels in one place, that was stopped.
    pub done: u64,
    pub samples: u64,
    pub reused_samples: u64,
    pub rays: u64,
    pub shadow_rays: u64,
    pub bvh_steps: u64,
    pub bad_samples: u64,
    pub dispatches: u64,
    /// Traced.
    pub light_paths: u64,
    pub render_seconds: f64,
    /// On the device, for paths and for light paths.
    pub stage_seconds: [f64; 2],
}

impl Figures {
    /// Of a rendering whose stages have these names.
    pub fn new(statistics: &RenderStatistics, stages: [&str; 2]) -> Self {
        let seconds = |stage| statistics.stages.iter().filter(|s| s.stage == stage).map(|s| s.seconds).sum();
        Self {
            samples: statistics.samples,
            reused_samples: statistics.reused_samples,
            rays: statistics.rays,
            shadow_rays: statistics.shadow_rays,
            bvh_steps: statistics.bvh_steps,
            bad_samples: statistics.bad_samples,
            dispatches: statistics.dispatches,
            stage_seconds: stages.map(seconds),
            ..Self::default()
        }
    }

    /// As if all had been done in one go. (The seconds of the whole are added when it is over.)
    pub fn restore(&self, statistics: &mut RenderStatistics, stages: [&'static str; 2]) {
        statistics.samples = self.samples;
        statistics.reused_samples = self.reused_samples;
        statistics.rays = self.rays;
        statistics.shadow_rays = self.shadow_rays;
        statistics.bvh_steps = self.bvh_steps;
        statistics.bad_samples = self.bad_samples;
        statistics.dispatches += self.dispatches;
        let stages = stages.into_iter().zip(self.stage_seconds).filter(|(_, seconds)| *seconds > 0.0);
        let stages: Vec<_> = stages.map(|(stage, seconds)| StageTime { stage, seconds }).collect();
        statistics.add(&Counters::zeroed(), &stages);
    }
}

/// Why bytes are no checkpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// They do not begin like one, or like one of another version.
    #[error("not a checkpoint of this version of photolith")]
    Foreign,
    /// They have been cut short or changed.
    #[error("the checkpoint is damaged")]
    Damaged,
}

impl Checkpoint {
    /// Samples so far, over all pixels.
    pub fn samples(&self) -> u64 {
        self.figures.samples
    }

    /// Samples per pixel that were asked for when it was begun: for [`RenderSettings`](crate::RenderSettings::begun_with).
    pub fn begun_with(&self) -> u32 {
        self.figures.begun_with
    }

    /// Seconds that it has taken.
    pub fn seconds(&self) -> f64 {
        self.figures.render_seconds
    }

    /// Writes it, with a text that says what rendering it is of.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, what: &str, out: &mut impl Write) -> io::Result<()> {
        let lengths = [what.len(), self.film.len(), self.gradients.len(), self.light_paths.len()].map(|n| n as u64);
        let parts: [&[u8]; 7] = [
            MAGIC,
            bytemuck::bytes_of(&lengths),
            bytemuck::bytes_of(&self.figures),
            bytemuck::cast_slice(&self.film),
            bytemuck::cast_slice(&self.gradients),
            bytemuck::cast_slice(&self.light_paths),
            what.as_bytes(),
        ];
        let mut hash = Fnv::default();
        for part in parts {
            hash.write(part);
            out.write_all(part)?;
        }
        out.write_all(&hash.finish().to_le_bytes())
    }

    /// Reads what [`Self::write`] has written: the text, and the checkpoint.
    ///
    /// # Errors
    /// The bytes are something else, or damaged.
    pub fn read(bytes: &[u8]) -> Result<(String, Self), CheckpointError> {
        use CheckpointError::{Damaged, Foreign};
        let rest = bytes.strip_prefix(MAGIC).ok_or(Foreign)?;
        let (all, sum) = bytes.split_last_chunk().ok_or(Damaged)?;
        let mut hash = Fnv::default();
        hash.write(all);
        if hash.finish() != u64::from_le_bytes(*sum) {
            return Err(Damaged);
        }
        let mut rest = &rest[..rest.len().checked_sub(sum.len()).ok_or(Damaged)?];
        let [text, film, gradients, light_paths] = <[u64; 4]>::try_from(taken(&mut rest, 4)?).map_err(|_| Damaged)?;
        let figures = taken(&mut rest, 1)?[0];
        let (film, gradients) = (taken(&mut rest, film)?, taken(&mut rest, gradients)?);
        let light_paths = taken(&mut rest, light_paths)?;
        let what = String::from_utf8(taken(&mut rest, text)?).map_err(|_| Damaged)?;
        Ok((what, Self { figures, film, gradients, light_paths }))
    }
}

/// So many values from the beginning of bytes.
fn taken<T: Pod>(bytes: &mut &[u8], count: u64) -> Result<Vec<T>, CheckpointError> {
    let length = usize::try_from(count).ok().and_then(|n| n.checked_mul(size_of::<T>()));
    let (values, rest) = length.and_then(|n| bytes.split_at_checked(n)).ok_or(CheckpointError::Damaged)?;
    *bytes = rest;
    Ok(bytemuck::pod_collect_to_vec(values))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_is_what_was_written() {
        let figures = Figures { begun_with: 64, done: 3, samples: 1 << 40, render_seconds: 0.5, ..Figures::default() };
        let slot = |n: u8| FilmSlot { count: u32::from(n), sum: [f32::from(n); 3], ..FilmSlot::default() };
        let gradients = vec![GradientSlot { pilot_down: 2.0, ..GradientSlot::default() }];
        for (gradients, light_paths) in [(Vec::new(), vec![[0.25, -1.0, 3.0]]), (gradients, Vec::new())] {
            let checkpoint = Checkpoint { figures, film: (0..5).map(slot).collect(), gradients, light_paths };
            let mut bytes = Vec::new();
            checkpoint.write("Seed: 1\nä", &mut bytes).unwrap();
            assert_eq!(Checkpoint::read(&bytes), Ok(("Seed: 1\nä".to_owned(), checkpoint)));
            for i in 0..bytes.len() {
                assert!(Checkpoint::read(&bytes[..i]).is_err(), "{i} bytes");
                let mut changed = bytes.clone();
                changed[i] ^= 4;
                let expected = if i < MAGIC.len() { CheckpointError::Foreign } else { CheckpointError::Damaged };
                assert_eq!(Checkpoint::read(&changed), Err(expected), "byte {i}");
            }
        }
    }
}
