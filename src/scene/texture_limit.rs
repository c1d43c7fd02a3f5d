//! How much memory textures may take, and making them smaller.

use rayon::prelude::*;

use crate::host::available_memory;
use crate::scene::description::Material;
use crate::scene::error::SceneError;
use crate::scene::texture::{Texels, TextureImage};

/// Makes images smaller whose sides are longer than `most`, and refuses those that memory does not hold.
pub(super) fn limit(
    name: &str,
    images: Vec<TextureImage>,
    materials: &[Material],
    most: Option<u32>,
    warnings: &mut Vec<String>,
) -> Result<Vec<TextureImage>, SceneError> {
    let is_color = |image: usize| {
        let mut uses = materials.iter().flat_map(|material| material.textures.values());
        uses.any(|texture| texture.image as usize == image && texture.srgb)
    };
    let most = most.unwrap_or(u32::MAX).max(1);
    let images: Vec<TextureImage> =
        images.into_par_iter().enumerate().map(|(i, image)| smaller(image, most, is_color(i))).collect();
    let changed: Vec<_> =
        images.iter().filter(|image| image.name.ends_with(SMALLER)).map(|image| image.name.clone()).collect();
    if !changed.is_empty() {
        warnings.push(format!("{name}: {} images are made smaller: {}", changed.len(), changed.join(", ")));
    }
    let bytes = |image: &TextureImage| image.texels.as_bytes().len() as u64;
    // Once more as the shaders see them.
    let needed = images.iter().map(bytes).sum::<u64>();
    match available_memory() {
        Some(available) if needed > available => {
            let mut largest: Vec<_> = images.iter().collect();
            largest.sort_by_key(|image| std::cmp::Reverse(bytes(image)));
            let names: Vec<_> = largest
                .iter()
                .take(3)
                .map(|image| format!("{} ({} × {})", image.name, image.width, image.height))
                .collect();
            Err(SceneError::Model {
                file: name.to_owned(),
                at: "textures".to_owned(),
                found: format!("{} MB, the largest of them {}", needed >> 20, names.join(", ")),
                expected: format!(
                    "at most the {} MB of memory that are left: --texture-limit makes them smaller",
                    available >> 20
                ),
            })
        }
        _ => Ok(images),
    }
}

/// What is added to the name of an image that was made smaller.
const SMALLER: &str = " (smaller)";

/// The image with sides of at most so many pixels, each a mean of those that it covers; colours by what their codes stand for.
fn smaller(image: TextureImage, most: u32, is_color: bool) -> TextureImage {
    let factor = image.width.max(image.height).div_ceil(most);
    if factor <= 1 {
        return image;
    }
    let (width, height) = (image.width.div_ceil(factor), image.height.div_ceil(factor));
    let value = |pixel: usize| -> [f32; 4] {
        match &image.texels {
            Texels::Rgba8(pixels) => pixels[pixel].map(|code| f32::from(code) / 255.0),
            Texels::Rgba16(pixels) => pixels[pixel].map(|code| f32::from(code) / 65535.0),
            Texels::Rgba32F(pixels) => pixels[pixel],
        }
    };
    let decode = |x: f32| {
        if !is_color {
            x
        } else if x <= 0.04045 {
            x / 12.92
        } else {
            ((x + 0.055) / 1.055).powf(2.4)
        }
    };
    let encode = |x: f32| {
        if !is_color {
            x
        } else if x <= 0.003_130_8 {
            x * 12.92
        } else {
            1.055 * x.powf(1.0 / 2.4) - 0.055
        }
    };
    let mean = |index: u32| -> [f32; 4] {
        let (x0, y0) = (index % width * factor, index / width * factor);
        let (x1, y1) = ((x0 + factor).min(image.width), (y0 + factor).min(image.height));
        let mut sum = [0.0f32; 4];
        for (x, y) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y))) {
            let [r, g, b, a] = value((y * image.width + x) as usize);
            let v = [decode(r), decode(g), decode(b), a];
            (0..4).for_each(|i| sum[i] += v[i]);
        }
        let [r, g, b, a] = sum.map(|x| x / ((x1 - x0) * (y1 - y0)) as f32);
        [encode(r), encode(g), encode(b), a]
    };
    let pixels: Vec<[f32; 4]> = (0..width * height).into_par_iter().map(mean).collect();
    let codes = |most: f32| pixels.iter().map(move |pixel| pixel.map(|x| (x * most).round()));
    let texels = match image.texels {
        Texels::Rgba8(_) => Texels::Rgba8(codes(255.0).map(|pixel| pixel.map(|x| x as u8)).collect()),
        Texels::Rgba16(_) => Texels::Rgba16(codes(65535.0).map(|pixel| pixel.map(|x| x as u16)).collect()),
        Texels::Rgba32F(_) => Texels::Rgba32F(pixels),
    };
    TextureImage { name: format!("{}{SMALLER}", image.name), width, height, texels }
}
