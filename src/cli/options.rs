//! Options that several subcommands share.

use std::path::Path;
use std::str::FromStr;

use anyhow::Context as _;
use clap::{Args, ValueEnum};
use photolith::render::{
    Accel, Beams, Glances, Gradients, LightSamples, MAX_SAMPLES, Reuse, Sampler, Scheduler, Shares, TriangleTest,
};
use photolith::scene::Scene;
use photolith::{ContextOptions, RenderSettings, Validation, user_cache};

/// Which device, and whether it is watched.
#[derive(Args, Clone)]
pub struct DeviceOptions {
    /// Vulkan device: index, UUID or part of the name (see `photolith devices`)
    #[arg(long, value_name = "INDEX|NAME|UUID")]
    pub device: Option<String>,

    /// Run with Vulkan validation layers; any message makes the exit code 4
    #[arg(long, value_name = "WHICH", num_args = 0..=1, default_missing_value = "core")]
    pub validate: Option<ValidateArg>,
}

/// Which validation.
#[derive(Clone, Copy, ValueEnum, PartialEq, Eq)]
pub enum ValidateArg {
    /// Rules of each call
    Core,
    /// Missing barriers
    Sync,
}

impl DeviceOptions {
    /// Which validation was asked for.
    pub fn validation(&self) -> Validation {
        match self.validate {
            None => Validation::Off,
            Some(ValidateArg::Core) => Validation::Core,
            Some(ValidateArg::Sync) => Validation::Synchronization,
        }
    }

    /// How to open the device.
    pub fn context_options(&self) -> ContextOptions {
        let shader_folder = user_cache().map(|cache| cache.join("shaders"));
        ContextOptions { device: self.device.clone(), validation: self.validation(), shader_folder }
    }
}

/// Settings that replace those of the scene, or that the scene does not hold.
#[derive(Args, Clone)]
pub struct SceneOptions {
    /// Image size instead of the scene's
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,

    /// Samples per pixel instead of the scene's; with --noise, the most that a pixel gets [default: 16384]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    pub samples: Option<u32>,

    /// Surface hits of a path instead of the scene's (1: direct light only)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65535))]
    pub max_depth: Option<u32>,

    /// Selects the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,

    /// Random numbers
    #[arg(long, value_enum, default_value_t = SamplerArg::Sobol)]
    pub sampler: SamplerArg,

    /// Ray–triangle test
    #[arg(long, value_enum, default_value_t = IntersectionArg::Watertight)]
    pub intersection: IntersectionArg,

    /// How triangles are found; `none` tests every one
    #[arg(long, value_enum, default_value_t = AccelArg::Bvh)]
    pub accel: AccelArg,

    /// How rays that need the tree are scheduled (changes no bit of the image)
    #[arg(long, value_enum, default_value_t = SchedulerArg::Auto)]
    pub scheduler: SchedulerArg,

    /// Whether paths serve several pixels: a third of the noise, part of it shared by blocks of eight pixels
    #[arg(long, value_enum, default_value_t = ReuseArg::Auto)]
    pub reuse: ReuseArg,

    /// Whether differences between neighbouring pixels are used, where paths serve several: half the noise again
    #[arg(long, value_enum, default_value_t = GradientsArg::Auto)]
    pub gradients: GradientsArg,

    /// Whether noisy parts of the image get more samples than others
    #[arg(long, value_enum, default_value_t = SharesArg::Auto)]
    pub shares: SharesArg,

    /// How many samples of lights paths take where they first meet a diffuse surface
    #[arg(long, value_enum, default_value_t = LightSamplesArg::Auto)]
    pub light_samples: LightSamplesArg,

    /// Whether samples look several times at lamps whose edges are seen, and at what is seen through glass
    #[arg(long, value_enum, default_value_t = GlancesArg::Auto)]
    pub glances: GlancesArg,

    /// Whether light is also traced from lamps, through glass and by mirrors
    #[arg(long, value_enum, default_value_t = BeamsArg::Auto)]
    pub beams: BeamsArg,

    /// Compile every feature, needed or not (changes no bit of the image)
    #[arg(long)]
    pub general: bool,
}

/// Random numbers.
#[derive(Clone, Copy, ValueEnum)]
pub enum SamplerArg {
    /// Owen-scrambled Sobol points
    Sobol,
    /// Independent numbers
    Independent,
    /// PCG (O'Neill 2014), slower; for comparison
    Pcg,
}

/// Ray–triangle tests.
#[derive(Clone, Copy, ValueEnum)]
pub enum IntersectionArg {
    /// Woop, Benthin and Wald: no leaks between triangles
    Watertight,
    /// Möller and Trumbore (1997); may leak at shared edges
    MollerTrumbore,
}

/// Acceleration structures.
#[derive(Clone, Copy, ValueEnum)]
pub enum AccelArg {
    /// Bounding volume hierarchy
    Bvh,
    /// None
    None,
}

/// Schedulers.
#[derive(Clone, Copy, ValueEnum)]
pub enum SchedulerArg {
    /// What is faster on the device
    Auto,
    /// Each lane walks the tree at once
    Inline,
    /// Lanes whose rays are done shade while others walk the tree (not where paths are reused)
    Turns,
    /// Paths that need the tree wait, until a whole subgroup walks it together
    Queue,
}

/// Reuse of paths.
#[derive(Clone, Copy, ValueEnum)]
pub enum ReuseArg {
    /// In scenes with indirect light on diffuse surfaces, if a few samples beforehand show that it pays; on GPUs in long
    /// renderings
    Auto,
    /// The same, whether it pays or not
    Always,
    /// Never
    Off,
}

/// Use of differences between neighbouring pixels.
#[derive(Clone, Copy, ValueEnum)]
pub enum GradientsArg {
    /// From 2 samples per pixel on, where paths serve several pixels, if most noise is theirs
    Auto,
    /// Never
    Off,
}

/// Shares of the samples.
#[derive(Clone, Copy, ValueEnum)]
pub enum SharesArg {
    /// Where it pays, from 4 samples on: half, twice or four times --samples, in the time of as many everywhere
    Auto,
    /// Never
    Off,
}

/// Samples of lights.
#[derive(Clone, Copy, ValueEnum)]
pub enum LightSamplesArg {
    /// Four, where paths serve several pixels and there is more than a point light
    Auto,
    /// One
    One,
}

/// Light traced from lamps.
#[derive(Clone, Copy, ValueEnum)]
pub enum BeamsArg {
    /// In scenes with lamps, and glass or mirrors
    Auto,
    /// Never
    Off,
}

/// Glances at lamps.
#[derive(Clone, Copy, ValueEnum)]
pub enum GlancesArg {
    /// In the pixels that need it; with 1 to 3 samples per pixel only if lamps may be in few parts of the image
    Auto,
    /// Never
    Off,
}

impl SceneOptions {
    /// Loads the scene, prints its warnings, and applies the options to it.
    pub fn load(&self, path: &Path) -> anyhow::Result<(Scene, RenderSettings)> {
        let loaded = Scene::load(path)?;
        for warning in &loaded.warnings {
            log::warn!("{warning}");
        }
        let mut scene = loaded.scene;
        if let Some(Size { width, height }) = self.size {
            scene.film.width = width;
            scene.film.height = height;
        }
        if let Some(samples) = self.samples {
            scene.integrator.samples = samples;
        }
        if let Some(depth) = self.max_depth {
            scene.integrator.max_depth = depth;
        }
        scene.validate().context("after the options were applied")?;
        let settings = RenderSettings {
            seed: self.seed,
            sampler: match self.sampler {
                SamplerArg::Sobol => Sampler::Sobol,
                SamplerArg::Independent => Sampler::Independent,
                SamplerArg::Pcg => Sampler::Pcg,
            },
            triangle_test: match self.intersection {
                IntersectionArg::Watertight => TriangleTest::Watertight,
                IntersectionArg::MollerTrumbore => TriangleTest::MollerTrumbore,
            },
            accel: match self.accel {
                AccelArg::Bvh => Accel::Bvh,
                AccelArg::None => Accel::None,
            },
            scheduler: match self.scheduler {
                SchedulerArg::Auto => Scheduler::Auto,
                SchedulerArg::Inline => Scheduler::Inline,
                SchedulerArg::Turns => Scheduler::Turns,
                SchedulerArg::Queue => Scheduler::Queue,
            },
            reuse: match self.reuse {
                ReuseArg::Auto => Reuse::Auto,
                ReuseArg::Always => Reuse::Always,
                ReuseArg::Off => Reuse::Off,
            },
            gradients: match self.gradients {
                GradientsArg::Auto => Gradients::Auto,
                GradientsArg::Off => Gradients::Off,
            },
            light_samples: match self.light_samples {
                LightSamplesArg::Auto => LightSamples::Auto,
                LightSamplesArg::One => LightSamples::One,
            },
            shares: match self.shares {
                SharesArg::Auto => Shares::Auto,
                SharesArg::Off => Shares::Off,
            },
            glances: match self.glances {
                GlancesArg::Auto => Glances::Auto,
                GlancesArg::Off => Glances::Off,
            },
            beams: match self.beams {
                BeamsArg::Auto => Beams::Auto,
                BeamsArg::Off => Beams::Off,
            },
            general: self.general,
            ..RenderSettings::of(&scene)
        };
        Ok((scene, settings))
    }
}

/// `WIDTHxHEIGHT`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let error = || format!("'{text}' is not a size, expected WIDTHxHEIGHT with 1 to 65536 each, such as 640x480");
        let (width, height) = text.split_once(['x', 'X']).ok_or_else(error)?;
        let number = |t: &str| t.parse().ok().filter(|n| (1..=65536).contains(n)).ok_or_else(error);
        Ok(Self { width: number(width)?, height: number(height)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!("640x480".parse(), Ok(Size { width: 640, height: 480 }));
        for bad in ["", "640", "x", "0x1", "1x0", "-1x5", "1x65537", "1.5x2", "4x4x4"] {
            assert!(bad.parse::<Size>().is_err(), "{bad}");
        }
    }
}
