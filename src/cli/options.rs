//! Options that several subcommands share.

use std::path::Path;
use std::str::FromStr;

use anyhow::Context as _;
use clap::{Args, ValueEnum};
use photolith::gpu::RayQueryUse;
use photolith::host::available_memory;
use photolith::render::{Accel, MAX_SAMPLES};
use photolith::scene::Scene;
use photolith::{ContextOptions, RenderSettings, Validation, user_cache};

use super::setting_options::SettingOptions;
use super::source_options::SourceOptions;
use super::text::{bytes, counted};
use super::view_options::ViewOptions;
use super::{heading, input};

/// Which device, and whether it is watched.
#[derive(Args, Clone)]
pub struct DeviceOptions {
    /// Vulkan device: index, UUID or part of its name (see `photolith devices`)
    #[arg(long, value_name = "INDEX|NAME|UUID", help_heading = heading::DEVICE)]
    pub device: Option<String>,

    /// Run with Vulkan validation layers; any message makes the exit code 4
    #[arg(long, value_name = "WHICH", num_args = 0..=1, default_missing_value = "core", help_heading = heading::DEVICE)]
    pub validate: Option<ValidateArg>,
}

/// Which validation.
#[derive(Clone, Copy, ValueEnum, PartialEq, Eq)]
pub enum ValidateArg {
    /// Rules of each call
    Core,
    /// Missing barriers
    Sync,
    /// Shaders check bounds of buffers and what ray queries are given; needs a newer layer
    Gpu,
}

impl DeviceOptions {
    /// Which validation was asked for.
    pub fn validation(&self) -> Validation {
        match self.validate {
            None => Validation::Off,
            Some(ValidateArg::Core) => Validation::Core,
            Some(ValidateArg::Sync) => Validation::Synchronization,
            Some(ValidateArg::Gpu) => Validation::GpuAssisted,
        }
    }

    /// How to open the device, for triangles that are found in such ways.
    pub fn context_options(&self, accels: &[Accel]) -> ContextOptions {
        let ray_query = if accels.iter().any(|accel| accel.needs_ray_queries()) {
            RayQueryUse::Always
        } else if accels.contains(&Accel::Auto) {
            RayQueryUse::OnGpus
        } else {
            RayQueryUse::Never
        };
        let shader_folder = user_cache().map(|cache| cache.join("shaders"));
        ContextOptions {
            device: self.device.clone(),
            validation: self.validation(),
            shader_folder,
            ray_query,
            capture: false,
        }
    }
}

/// Settings that replace those of the scene, or that the scene does not hold.
#[derive(Args, Clone, Default)]
pub struct SceneOptions {
    /// Image size instead of the scene's
    #[arg(long, value_name = "WxH", help_heading = heading::IMAGE)]
    pub size: Option<Size>,

    /// Samples per pixel instead of the scene's; with --noise the most that a pixel gets [default: 16384]
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)),
        allow_negative_numbers = true,
        help_heading = heading::QUALITY,
        display_order = 0
    )]
    pub samples: Option<u32>,

    /// Surfaces that light may meet on its way, instead of the scene's number (1: direct light only)
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=65535),
        allow_negative_numbers = true,
        help_heading = heading::SCENE
    )]
    pub max_depth: Option<u32>,

    #[command(flatten)]
    pub view: ViewOptions,

    #[command(flatten)]
    pub source: SourceOptions,

    /// Warnings are errors: end with code 2
    #[arg(long, help_heading = heading::SCENE)]
    pub strict: bool,

    #[command(flatten)]
    pub settings: SettingOptions,
}

impl SceneOptions {
    /// Loads the scene, prints its warnings, and applies the options to it.
    pub fn load(&self, path: &Path) -> anyhow::Result<(Scene, RenderSettings)> {
        let mut loaded = input::load(path, &self.source.load_options())?;
        for warning in &loaded.warnings {
            log::warn!("{warning}");
        }
        self.check_warnings(loaded.warnings.len())?;
        if let Some(Size { width, height }) = self.size {
            loaded.scene.film.width = width;
            loaded.scene.film.height = height;
        }
        self.view.apply(&mut loaded)?;
        self.source.apply(&mut loaded.scene)?;
        let mut scene = loaded.scene;
        if let Some(samples) = self.samples {
            scene.integrator.samples = samples;
        }
        if let Some(depth) = self.max_depth {
            scene.integrator.max_depth = depth;
        }
        scene.validate().context("after the options were applied")?;
        let mut settings = RenderSettings::of(&scene);
        self.settings.apply(&mut settings);
        Ok((scene, settings))
    }
}

impl SceneOptions {
    /// Whether to go on after so many warnings.
    ///
    /// # Errors
    /// There are some, and they are errors.
    pub fn check_warnings(&self, warnings: usize) -> anyhow::Result<()> {
        if self.strict && warnings > 0 {
            anyhow::bail!("{}, expected none with --strict", counted(warnings, "warning", "warnings"));
        }
        Ok(())
    }
}

/// What the host holds of each pixel at least, when the image is read back: a sum and a count in the film, the mean, and the image.
const BYTES_OF_PIXEL: u64 = 24 + 4 + 12 + 12;

/// Checks that an image is not larger than memory, before it is begun.
///
/// # Errors
/// It is.
pub fn check_memory(scene: &Scene) -> anyhow::Result<()> {
    let pixels = u64::from(scene.film.width) * u64::from(scene.film.height);
    let needed = pixels.saturating_mul(BYTES_OF_PIXEL);
    if let Some(available) = available_memory().filter(|available| *available < needed) {
        anyhow::bail!(
            "{}: an image of {}x{} pixels needs at least {} of memory, expected at most {}, which are available",
            scene.source,
            scene.film.width,
            scene.film.height,
            bytes(needed),
            bytes(available)
        );
    }
    Ok(())
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
