//! Light from all around: a picture in latitude and longitude.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;

use crate::scene::image_file::{decode, is_exr, read_exr};
use crate::scene::srgb;
use crate::scene::texture::Texels;

/// Radiance from all directions. Bilinear between the centres of pixels; the first column follows the last one, and beyond the first and
/// the last row these go on.
///
/// The middle of the map is at −z, the top at +y, and what is to the right of the middle at +x.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// For messages: its file, or what it is.
    pub name: String,
    /// Pixels, at least 1.
    pub width: u32,
    /// Pixels, at least 1.
    pub height: u32,
    /// Radiance, rows from the top; finite and at least 0.
    pub texels: Arc<Vec<[f32; 3]>>,
    /// Turns the map about +y, degrees: 90 brings its middle to −x.
    pub rotation: f64,
    /// Multiplies radiance, >= 0.
    pub scale: f64,
    /// Whether the camera sees it.
    pub visible: bool,
}

impl Environment {
    /// Reads a map: `.hdr`, `.exr`, or a picture of 8 bits, of which the colours are decoded. The second value is what to warn of.
    ///
    /// # Errors
    /// In words.
    pub fn read(bytes: &[u8], name: &str) -> Result<(Self, Option<String>), String> {
        let (width, height, mut texels, warning): (_, _, Vec<[f32; 3]>, _) = if is_exr(bytes) {
            let (width, height, pixels) = read_exr(bytes)?;
            (width, height, pixels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect(), None)
        } else {
            let image = decode(bytes, name)?;
            let is_radiance = matches!(image.texels, Texels::Rgba32F(_));
            let low = "it has no high dynamic range: nothing in it is brighter than white";
            let radiance = |pixel: usize| {
                let [r, g, b, _] = image.texels.value(pixel);
                [r, g, b].map(|x| if is_radiance { x } else { srgb::decode(x) } as f32)
            };
            let texels: Vec<[f32; 3]> = (0..image.width as usize * image.height as usize).map(radiance).collect();
            (image.width, image.height, texels, (!is_radiance).then(|| low.to_owned()))
        };
        let mut replaced = 0;
        for x in texels.as_flattened_mut().iter_mut().filter(|x| !(x.is_finite() && **x >= 0.0)) {
            *x = 0.0;
            replaced += 1;
        }
        let negative = (replaced > 0).then(|| format!("{replaced} values below 0 or not finite count as 0"));
        let warning = warning.or(negative).map(|warning| format!("{name}: {warning}"));
        let texels = Arc::new(texels);
        let map = Self { name: name.to_owned(), width, height, texels, rotation: 0.0, scale: 1.0, visible: true };
        Ok((map, warning))
    }

    /// The built-in studio: a ceiling that is brighter than the floor, and a soft lamp at the upper left in front. Its mean over the
    /// sphere is 1.
    pub fn studio() -> Self {
        const WIDTH: u32 = 256;
        const HEIGHT: u32 = 128;
        let direction = |x: u32, y: u32| {
            let u = (f64::from(x) + 0.5) / f64::from(WIDTH);
            let theta = PI * (f64::from(y) + 0.5) / f64::from(HEIGHT);
            let phi = 2.0 * PI * (u - 0.5);
            DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
        };
        let key = DVec3::new(-0.6, 0.7, 0.75).normalize();
        let fill = DVec3::new(0.9, 0.25, 0.35).normalize();
        let radiance = |d: DVec3| {
            let lamp = |axis: DVec3, width: f64| (-(1.0 - d.dot(axis)) / width).exp();
            0.45 + 0.35 * d.y + 9.0 * lamp(key, 0.05) + 1.2 * lamp(fill, 0.12)
        };
        let pixels: Vec<(f64, f64)> = (0..WIDTH * HEIGHT)
            .map(|i| {
                let theta = PI * (f64::from(i / WIDTH) + 0.5) / f64::from(HEIGHT);
                (radiance(direction(i % WIDTH, i / WIDTH)), theta.sin())
            })
            .collect();
        let mean =
            pixels.iter().map(|(l, weight)| l * weight).sum::<f64>() / pixels.iter().map(|(_, w)| w).sum::<f64>();
        let texels = pixels.iter().map(|(l, _)| [(l / mean) as f32; 3]).collect();
        Self {
            name: "studio".to_owned(),
            width: WIDTH,
            height: HEIGHT,
            texels: Arc::new(texels),
            rotation: 0.0,
            scale: 1.0,
            visible: true,
        }
    }
}
