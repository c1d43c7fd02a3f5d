//! How much memory textures may take, and making them smaller.

use rayon::prelude::*;

use crate::host::available_memory;
use crate::scene::description::Material;
use crate::scene::error::SceneError;
use crate::scene::srgb;
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
    let changed: Vec<_> =
        images.iter().filter(|image| factor(image, most) > 1).map(|image| image.name.as_str()).collect();
    if !changed.is_empty() {
        warnings.push(format!("{name}: {} images are made smaller: {}", changed.len(), changed.join(", ")));
    }
    let images: Vec<TextureImage> =
        images.into_par_iter().enumerate().map(|(i, image)| smaller(image, most, is_color(i))).collect();
    let bytes = |image: &TextureImage| image.texels.as_bytes().len() as u64;
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

/// How many pixels become one along either axis.
fn factor(image: &TextureImage, most: u32) -> u32 {
    image.width.max(image.height).div_ceil(most)
}

/// The image with sides of at most so many pixels, each a mean of those that it covers; colours by what their codes stand for.
fn smaller(image: TextureImage, most: u32, is_color: bool) -> TextureImage {
    let factor = factor(&image, most);
    if factor <= 1 {
        return image;
    }
    let (width, height) = (image.width.div_ceil(factor), image.height.div_ceil(factor));
    let decode = |x: f64| if is_color { srgb::decode(x) } else { x };
    let encode = |x: f64| if is_color { srgb::encode(x) } else { x };
    let mean = |index: u32| -> [f32; 4] {
        let (x0, y0) = (index % width * factor, index / width * factor);
        let (x1, y1) = ((x0 + factor).min(image.width), (y0 + factor).min(image.height));
        let mut sum = [0.0; 4];
        for (x, y) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y))) {
            let [r, g, b, a] = image.texels.value((y * image.width + x) as usize);
            let v = [decode(r), decode(g), decode(b), a];
            (0..4).for_each(|i| sum[i] += v[i]);
        }
        let [r, g, b, a] = sum.map(|x| x / f64::from((x1 - x0) * (y1 - y0)));
        [encode(r), encode(g), encode(b), a].map(|x| x as f32)
    };
    let pixels: Vec<[f32; 4]> = (0..width * height).into_par_iter().map(mean).collect();
    let codes = |most: f32| pixels.iter().map(move |pixel| pixel.map(|x| (x * most).round()));
    let texels = match image.texels {
        Texels::Rgba8(_) => Texels::Rgba8(codes(255.0).map(|pixel| pixel.map(|x| x as u8)).collect()),
        Texels::Rgba16(_) => Texels::Rgba16(codes(65535.0).map(|pixel| pixel.map(|x| x as u16)).collect()),
        Texels::Rgba32F(_) => Texels::Rgba32F(pixels),
    };
    TextureImage { name: image.name, width, height, texels }
}
