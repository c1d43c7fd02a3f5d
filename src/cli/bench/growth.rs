//! `photolith bench --growth`: scenes larger from one to the next.

use anyhow::{Context as _, anyhow};
use clap::ValueEnum;
use photolith::bench::growth::{self, Growth, GrowthReport};
use photolith::{Context, RenderError, RenderSettings};

use super::{BenchArgs, Progress};
use crate::cli::interrupt::Interrupt;

/// Samples per pixel if no other number is asked for.
const SAMPLES: u32 = 4;

/// What grows.
#[derive(Clone, Copy, ValueEnum)]
pub enum GrowthArg {
    /// Triangles of a landscape, 1e3 to 1e6
    Triangles,
    /// Spheres, 10 to 1e5
    Spheres,
    /// Point lights, 1 to 1e4
    Lights,
    /// Pixels, 64² to 1024²
    Pixels,
    /// Surface hits of a path, 1 to 64
    Depth,
}

impl From<GrowthArg> for Growth {
    fn from(grows: GrowthArg) -> Self {
        match grows {
            GrowthArg::Triangles => Self::Triangles,
            GrowthArg::Spheres => Self::Spheres,
            GrowthArg::Lights => Self::Lights,
            GrowthArg::Pixels => Self::Pixels,
            GrowthArg::Depth => Self::Depth,
        }
    }
}

/// What is to be measured.
pub struct Series {
    grows: Growth,
    sizes: Vec<u64>,
    settings: RenderSettings,
}

impl Series {
    /// The series that was asked for, if one was.
    ///
    /// # Errors
    /// The largest size is below the smallest or beyond what a scene can have, or there are several numbers of samples.
    pub fn of(args: &BenchArgs) -> anyhow::Result<Option<Self>> {
        let Some(grows) = args.growth.map(Growth::from) else { return Ok(None) };
        let sizes = grows.sizes(args.max).context("--max")?;
        let samples = match &args.samples {
            None => SAMPLES,
            Some(counts) => counts.single().ok_or_else(|| anyhow!("--growth takes one number of --samples"))?,
        };
        Ok(Some(Self { grows, sizes, settings: RenderSettings { samples, ..RenderSettings::default() } }))
    }

    /// Measures, up to the first size that fails, whose error comes with what was found so far, or until it is interrupted.
    pub fn measure(&self, context: &Context, interrupt: &Interrupt) -> (GrowthReport, Option<RenderError>) {
        let bar = Progress::new(self.sizes.len());
        let on_progress = |size: u64| {
            bar.set(self.sizes.iter().filter(|&&s| s < size).count(), &size.to_string());
            interrupt.go_on()
        };
        let result = growth::measure(context, self.grows, &self.sizes, &self.settings, on_progress);
        bar.finish();
        result
    }
}
