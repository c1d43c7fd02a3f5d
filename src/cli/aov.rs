//! What the camera sees, as layers of an OpenEXR file.

use std::path::Path;

use anyhow::{Result, bail};
use photolith::image::{Format, ImageLayers, LayerValues, Metadata, write_layers};
use photolith::render::SeenSurface;
use photolith::{Renderer, files};

/// In place of an id where nothing is seen.
const NO_ID: u32 = u32::MAX;

/// Checks, before anything is rendered, that layers can be written to `path`.
///
/// # Errors
/// It is no OpenEXR file, or cannot be written.
pub fn check(path: &Path) -> Result<()> {
    match Format::from_path(path) {
        Ok(Format::Exr) => Ok(files::check_writable(path)?),
        _ => bail!("--aov {}: layers are written as OpenEXR only, expected a name that ends in .exr", path.display()),
    }
}

/// Writes what each pixel's centre shows: layers `albedo`, `normal` (for shading), `geometric_normal`, `position`, `depth`, and `id`.
///
/// # Errors
/// The device fails, or the file cannot be written.
pub fn write(path: &Path, renderer: &mut Renderer, [width, height]: [u32; 2], metadata: &Metadata) -> Result<()> {
    let seen = renderer.seen_surfaces()?;
    let mut layers = ImageLayers::new(width, height)?;
    let vectors = |of: fn(&SeenSurface) -> [f32; 3]| -> Vec<_> {
        seen.iter().map(|seen| seen.as_ref().map_or([0.0; 3], of)).collect()
    };
    layers.push_vectors("albedo", "RGB", &vectors(|seen| seen.albedo))?;
    layers.push_vectors("normal", "XYZ", &vectors(|seen| seen.shading_normal))?;
    layers.push_vectors("geometric_normal", "XYZ", &vectors(|seen| seen.normal))?;
    layers.push_vectors("position", "XYZ", &vectors(|seen| seen.position.as_vec3().to_array()))?;
    let depths = seen.iter().map(|seen| seen.as_ref().map_or(f32::INFINITY, |seen| seen.depth as f32));
    layers.push("depth.Z", LayerValues::Float(depths.collect()))?;
    let ids = |of: fn(&SeenSurface) -> u32| {
        LayerValues::Integer(seen.iter().map(|seen| seen.as_ref().map_or(NO_ID, of)).collect())
    };
    layers.push("id.primitive", ids(|seen| seen.primitive))?;
    layers.push("id.material", ids(|seen| seen.material))?;
    Ok(write_layers(path, &layers, metadata)?)
}
