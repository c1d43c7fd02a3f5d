//! Options that say what to make of a file: glTF leaves choices, and light may come from elsewhere.

use std::path::Path;

use anyhow::Context as _;
use clap::Args;
use photolith::scene::{Environment, LoadOptions, Scene};

use super::{heading, output};

/// What to make of the file.
#[derive(Args, Clone, Default)]
pub struct SourceOptions {
    /// Time at which the animations of a glTF file are evaluated; without one nodes are as they are stored
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true, help_heading = heading::SCENE)]
    time: Option<f64>,

    /// Variant of the materials of a glTF file, by name or number (0 is the first)
    #[arg(long, value_name = "NAME|N", help_heading = heading::SCENE)]
    variant: Option<String>,

    /// Longest side of a texture; larger ones are made smaller
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..), help_heading = heading::SCENE)]
    texture_limit: Option<u32>,

    /// Files that a file names have to be in its folder, or below
    #[arg(long, help_heading = heading::SCENE)]
    confine: bool,

    /// Light from all around instead of the scene's background: an .hdr or .exr file, studio, white, or none
    #[arg(long, value_name = "FILE|studio|white|none", help_heading = heading::SCENE)]
    environment: Option<String>,

    /// Turns the environment about the vertical
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, help_heading = heading::SCENE)]
    environment_rotation: Option<f64>,

    /// Multiplies the radiance of the environment
    #[arg(long, value_name = "FACTOR", allow_hyphen_values = true, help_heading = heading::SCENE)]
    environment_scale: Option<f64>,
}

impl SourceOptions {
    /// Those that loading needs.
    pub fn load_options(&self) -> LoadOptions {
        LoadOptions {
            time: self.time,
            variant: self.variant.clone(),
            texture_limit: self.texture_limit,
            confine: self.confine,
        }
    }

    /// Applies the others, and says what was chosen.
    ///
    /// # Errors
    /// The environment cannot be read, or there is none to turn or scale.
    pub fn apply(&self, scene: &mut Scene) -> anyhow::Result<()> {
        match self.environment.as_deref() {
            None => {}
            Some("none") => (scene.environment, scene.background) = (None, [0.0; 3]),
            Some("white") => (scene.environment, scene.background) = (None, [1.0; 3]),
            Some("studio") => scene.environment = Some(Environment::studio()),
            Some(file) => {
                let bytes = photolith::files::read_regular(Path::new(file)).with_context(|| file.to_owned())?;
                let read = Environment::read(&bytes, file);
                let (map, warning) = read.map_err(|found| {
                    anyhow::anyhow!("{file}: {found}, expected an environment map: .hdr, .exr or a picture")
                })?;
                if let Some(warning) = warning {
                    log::warn!("{warning}");
                }
                scene.environment = Some(map);
            }
        }
        let scale = self.environment_scale;
        if let (None, Some(scale)) = (&scene.environment, scale) {
            anyhow::ensure!(
                scene.background != [0.0; 3],
                "--environment-scale: the scene has no environment, expected one"
            );
            scene.background = scene.background.map(|x| x * scale);
        }
        let Some(map) = &mut scene.environment else {
            anyhow::ensure!(
                self.environment_rotation.is_none(),
                "--environment-rotation: the scene has no environment map, expected one"
            );
            return Ok(());
        };
        map.rotation = self.environment_rotation.unwrap_or(map.rotation);
        map.scale = scale.unwrap_or(map.scale);
        output::tell(&format!("environment: {}, turned by {}°, times {}", map.name, map.rotation, map.scale));
        Ok(())
    }
}
