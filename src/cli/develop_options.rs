//! Options that say how radiance becomes 8-bit output, and what they do.

use std::ops::ControlFlow;

use anyhow::Result;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use photolith::image::{Format, auto_exposure};
use photolith::scene::{Exposure, Scene, Tone};
use photolith::{Context, Image, RenderSettings, Renderer};

use super::{heading, output};

/// Exposure, tone curve and background, instead of those of the scene.
#[derive(Args, Clone)]
pub struct DevelopOptions {
    /// Brighten 8-bit output by so many stops, or auto: geometry is middle grey, to a third of a stop
    #[arg(long, value_name = "STOPS|auto", value_parser = exposure, allow_hyphen_values = true, help_heading = heading::IMAGE)]
    exposure: Option<Exposure>,

    /// Tone curve of 8-bit output
    #[arg(long, value_name = "CURVE", value_parser = tone(), help_heading = heading::IMAGE)]
    tone: Option<Tone>,

    /// Leave the background out: alpha is the share of camera rays that meet geometry (.png, .exr)
    #[arg(long, help_heading = heading::IMAGE)]
    transparent: bool,
}

/// Samples per pixel that tell well enough where geometry is.
const ENOUGH: u32 = 16;

fn exposure(text: &str) -> Result<Exposure, String> {
    let number = || text.parse().ok().filter(|stops: &f64| stops.abs() <= 64.0).map(Exposure::Stops);
    let expected = || format!("'{text}' is no exposure, expected a number of stops from -64 to 64, or auto");
    if text == "auto" { Ok(Exposure::Auto) } else { number().ok_or_else(expected) }
}

fn tone() -> impl TypedValueParser<Value = Tone> {
    let named = |name: String| Tone::ALL.into_iter().find(|row| row.0 == name).map_or(Tone::None, |row| row.1);
    PossibleValuesParser::new(Tone::ALL.map(|row| row.0)).map(named)
}

/// How an image is shown.
#[derive(Debug, Clone, Copy)]
pub struct Development {
    /// Stops.
    pub exposure: f64,
    /// Whether the image decided that.
    pub auto: bool,
    /// The curve.
    pub tone: Tone,
    /// Whether the background is left out.
    pub transparent: bool,
}

impl DevelopOptions {
    /// Replaces what the scene says.
    ///
    /// # Errors
    /// The format has no alpha.
    pub fn apply(&self, scene: &mut Scene, format: Format) -> Result<()> {
        scene.film.exposure = self.exposure.unwrap_or(scene.film.exposure);
        scene.film.tone = self.tone.unwrap_or(scene.film.tone);
        scene.film.transparent |= self.transparent;
        if scene.film.transparent {
            anyhow::ensure!(
                matches!(format, Format::Png | Format::Exr),
                "a transparent background: {format} has no alpha, expected .png or .exr"
            );
            if let Some(map) = &mut scene.environment {
                map.visible = false;
            }
        }
        Ok(())
    }
}

/// Decides how an image is shown that had so many samples per pixel, and takes the background out of it if that is asked for.
///
/// # Errors
/// The coverage cannot be rendered.
pub fn develop(
    image: Image,
    scene: &Scene,
    settings: &RenderSettings,
    samples: u32,
    format: Format,
    context: &Context,
) -> Result<(Image, Development)> {
    let film = &scene.film;
    let auto = film.exposure == Exposure::Auto && format == Format::Png;
    let mut covered = Vec::new();
    if auto || film.transparent {
        let samples = if film.transparent { samples } else { samples.min(ENOUGH) };
        covered = coverage(scene, settings, samples.max(1), context)?;
    }
    let exposure = match film.exposure {
        Exposure::Stops(stops) => stops,
        Exposure::Auto if auto => auto_exposure(&image, &covered),
        Exposure::Auto => 0.0,
    };
    if format == Format::Png && (auto || exposure != 0.0 || film.tone != Tone::None) {
        let by = if auto { " (auto)" } else { "" };
        output::tell(&format!("exposure: {exposure:+.2} stops{by}, tone {}", film.tone.name()));
    }
    // A map was not shown; a constant background is known.
    let background = if scene.environment.is_some() { [0.0; 3] } else { scene.background };
    let image = if film.transparent { image.without_background(covered, background)? } else { image };
    Ok((image, Development { exposure, auto, tone: film.tone, transparent: film.transparent }))
}

/// The share of each pixel's camera rays that meet geometry.
fn coverage(scene: &Scene, settings: &RenderSettings, samples: u32, context: &Context) -> Result<Vec<f32>> {
    let silhouette = scene.silhouette(samples);
    let of_scene = RenderSettings { seed: settings.seed, sampler: settings.sampler, ..RenderSettings::of(&silhouette) };
    let film = Renderer::new(context, &silhouette, &of_scene)?.render(|_| ControlFlow::Continue(()))?;
    Ok(film.mean().into_iter().map(|[missed, ..]| (1.0 - missed).clamp(0.0, 1.0)).collect())
}
