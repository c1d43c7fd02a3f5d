//! Images made of channels of others.

use rayon::prelude::*;

use crate::scene::texture::{Texels, TextureImage};

/// A number of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Channel {
    Red,
    Green,
    Blue,
    Alpha,
    /// Of codes: no curve is undone.
    Luminance,
}

/// What a channel of a new image is made of.
pub(super) struct Part<'a> {
    pub image: &'a TextureImage,
    pub channel: Channel,
    /// What becomes of its values.
    pub change: Option<Box<dyn Fn(f64) -> f64 + Sync + 'a>>,
}

impl<'a> Part<'a> {
    /// Values as they are.
    pub fn plain(image: &'a TextureImage, channel: Channel) -> Self {
        Self { image, channel, change: None }
    }
}

/// An image with these channels; 1 where there is none. It has the sides of the largest, to which others are stretched, and as many bits
/// as they have, 16 at least where values are changed.
pub(super) fn combine(name: String, parts: [Option<Part<'_>>; 4]) -> TextureImage {
    let given = || parts.iter().flatten();
    let side = |of: fn(&TextureImage) -> u32| given().map(|part| of(part.image)).max().unwrap_or(1);
    let (width, height) = (side(|image| image.width), side(|image| image.height));
    let pixel = |index: usize| {
        let (x, y) = (index % width as usize, index / width as usize);
        let value = |part: &Part<'_>| {
            let value = stretched(part, x, y, width, height);
            part.change.as_ref().map_or(value, |change| change(value)) as f32
        };
        parts.each_ref().map(|part| part.as_ref().map_or(1.0, value))
    };
    let pixels: Vec<[f32; 4]> = (0..width as usize * height as usize).into_par_iter().map(pixel).collect();
    let codes = |most: f32| pixels.iter().map(move |pixel| pixel.map(|x| (x.clamp(0.0, 1.0) * most).round()));
    let has_floats = given().any(|part| matches!(part.image.texels, Texels::Rgba32F(_)));
    let is_8_bit = given().all(|part| matches!(part.image.texels, Texels::Rgba8(_)) && part.change.is_none());
    let texels = match (has_floats, is_8_bit) {
        (true, _) => Texels::Rgba32F(pixels.iter().map(|pixel| pixel.map(|x| x.clamp(0.0, f32::MAX))).collect()),
        (_, true) => Texels::Rgba8(codes(255.0).map(|pixel| pixel.map(|x| x as u8)).collect()),
        _ => Texels::Rgba16(codes(65535.0).map(|pixel| pixel.map(|x| x as u16)).collect()),
    };
    TextureImage { name, width, height, texels }
}

/// The value at a pixel of an image of other sides, bilinear. (That of one repeats.)
fn stretched(part: &Part<'_>, x: usize, y: usize, width: u32, height: u32) -> f64 {
    let image = part.image;
    if (image.width, image.height) == (width, height) {
        return value(image, part.channel, x, y);
    }
    let place = |i: usize, to: u32, of: u32| {
        let at = (i as f64 + 0.5) * f64::from(of) / f64::from(to) - 0.5;
        let first = at.floor();
        let wrapped = |i: f64| i.rem_euclid(f64::from(of)) as usize;
        (wrapped(first), wrapped(first + 1.0), at - first)
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (place(x, width, image.width), place(y, height, image.height));
    let row = |y: usize| value(image, part.channel, x0, y) * (1.0 - fx) + value(image, part.channel, x1, y) * fx;
    row(y0) * (1.0 - fy) + row(y1) * fy
}

fn value(image: &TextureImage, channel: Channel, x: usize, y: usize) -> f64 {
    let [r, g, b, a] = image.texels.value(y * image.width as usize + x);
    match channel {
        Channel::Red => r,
        Channel::Green => g,
        Channel::Blue => b,
        Channel::Alpha => a,
        Channel::Luminance if r == g && g == b => r,
        Channel::Luminance => 0.2126 * r + 0.7152 * g + 0.0722 * b,
    }
}

fn values(image: &TextureImage) -> impl IndexedParallelIterator<Item = [f64; 4]> + '_ {
    (0..image.width as usize * image.height as usize).into_par_iter().map(|pixel| image.texels.value(pixel))
}

/// Whether any pixel is not opaque.
pub(super) fn has_alpha(image: &TextureImage) -> bool {
    values(image).any(|[.., a]| a < 1.0)
}

/// Whether a channel tells what is cut out: nearly all of it is 0 or 1, but for what lossy files make of these.
pub(super) fn is_mask(image: &TextureImage, channel: Channel) -> bool {
    const SHARE: f64 = 0.98;
    const ROUNDING: f64 = 8.0 / 255.0;
    let width = image.width as usize;
    let pixels = width * image.height as usize;
    let is_clear = |pixel: &usize| {
        let x = value(image, channel, pixel % width, pixel / width);
        x <= ROUNDING || x >= 1.0 - ROUNDING
    };
    (0..pixels).into_par_iter().filter(is_clear).count() as f64 >= SHARE * pixels as f64
}

/// Whether an image looks like one of normals: blue, with red and green about their middle.
pub(super) fn looks_like_normals(image: &TextureImage) -> bool {
    let add = |[a, b, c]: [f64; 3], [r, g, bl, _]: [f64; 4]| [a + r, b + g, c + bl];
    let sum = values(image)
        .fold(|| [0.0; 3], add)
        .collect::<Vec<_>>()
        .into_iter()
        .fold([0.0; 3], |sum, [r, g, b]| add(sum, [r, g, b, 0.0]));
    let [r, g, b] = sum.map(|x| x / (f64::from(image.width) * f64::from(image.height)));
    let is_middle = |x: f64| (0.35..0.65).contains(&x);
    is_middle(r) && is_middle(g) && b > 0.7 && b > r + 0.15 && b > g + 0.15
}

/// How far white is above black where heights have no unit, in sides of the image.
const RELIEF: f64 = 0.01;

/// The normals of a relief that a channel gives the heights of; it repeats. A `-bm` scales them like those of any map of normals.
pub(super) fn normals_of_heights(name: String, part: &Part<'_>) -> TextureImage {
    let image = part.image;
    let (width, height) = (image.width as usize, image.height as usize);
    let scale = RELIEF * image.width.max(image.height) as f64;
    let at = |x: usize, y: usize| {
        let h = value(image, part.channel, x, y);
        scale * part.change.as_ref().map_or(h, |change| change(h))
    };
    let pixel = |index: usize| {
        let (x, y) = (index % width, index / width);
        let along = (at((x + 1) % width, y) - at((x + width - 1) % width, y)) / 2.0;
        // Rows go down, bitangents up.
        let up = (at(x, (y + height - 1) % height) - at(x, (y + 1) % height)) / 2.0;
        let normal = glam::DVec3::new(-along, -up, 1.0).normalize();
        let [r, g, b] = (0.5 * normal + 0.5).to_array().map(|x| (x * 65535.0).round() as u16);
        [r, g, b, u16::MAX]
    };
    let texels = Texels::Rgba16((0..width * height).into_par_iter().map(pixel).collect());
    TextureImage { name, width: image.width, height: image.height, texels }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, pixels: &[[u8; 4]]) -> TextureImage {
        TextureImage { name: "a".to_owned(), width, height, texels: Texels::Rgba8(pixels.to_vec()) }
    }

    #[test]
    fn channels_are_combined() {
        let small = image(1, 1, &[[10, 20, 30, 40]]);
        let large = image(2, 1, &[[0, 100, 200, 255], [50, 150, 250, 0]]);
        let half = |x: f64| x / 2.0;
        let parts = [
            Some(Part::plain(&large, Channel::Blue)),
            None,
            Some(Part::plain(&small, Channel::Green)),
            Some(Part::plain(&large, Channel::Alpha)),
        ];
        let both = combine("b".to_owned(), parts);
        assert_eq!(both.texels, Texels::Rgba8(vec![[200, 255, 20, 255], [250, 255, 20, 0]]));
        let changed = Part { change: Some(Box::new(half)), ..Part::plain(&small, Channel::Alpha) };
        let changed = combine("c".to_owned(), [Some(changed), None, None, None]);
        assert_eq!(changed.texels, Texels::Rgba16(vec![[20 * 257, 65535, 65535, 65535]]));
        // Stretched to twice the width: centres are a quarter of the way between those of the smaller one, which repeats.
        let wide = image(4, 1, &[[0; 4]; 4]);
        let parts = [Some(Part::plain(&large, Channel::Red)), Some(Part::plain(&wide, Channel::Red)), None, None];
        let Texels::Rgba8(found) = combine("d".to_owned(), parts).texels else { panic!() };
        assert_eq!(found.iter().map(|p| p[0]).collect::<Vec<_>>(), [13, 13, 38, 38]);
    }

    #[test]
    fn kinds_of_images_are_told_apart() {
        assert!(looks_like_normals(&image(2, 1, &[[128, 128, 255, 255], [100, 150, 230, 255]])));
        for other in [[128, 128, 128, 255], [255, 255, 255, 255], [30, 40, 250, 255], [90, 90, 120, 255]] {
            assert!(!looks_like_normals(&image(1, 1, &[other])), "{other:?}");
        }
        let mask = |grey: u8| image(2, 1, &[[0, 0, 0, 255], [grey; 4]]);
        assert!(is_mask(&mask(250), Channel::Luminance) && !is_mask(&mask(200), Channel::Luminance));
        assert!(has_alpha(&mask(254)) && !has_alpha(&mask(255)));
    }

    /// A plane that rises to the right by 1/8 of white a pixel, away from the seam, and one that rises upwards.
    #[test]
    fn heights_become_normals() {
        for (turned, axis) in [(false, 0), (true, 1)] {
            let pixel = |i: u32| [if turned { 7 - i / 8 } else { i % 8 } as u8 * 32; 4];
            let pixels: Vec<_> = (0..64).map(pixel).collect();
            let heights = image(8, 8, &pixels);
            let part = Part::plain(&heights, Channel::Luminance);
            let Texels::Rgba16(normals) = normals_of_heights("n".to_owned(), &part).texels else { panic!() };
            let normal = normals[3 * 8 + 3].map(|code| f64::from(code) / 65535.0 * 2.0 - 1.0);
            let slope = RELIEF * 8.0 * 32.0 / 255.0;
            assert!((normal[axis] / normal[2] + slope).abs() < 1e-4, "{normal:?}");
            assert!(normal[1 - axis].abs() < 1e-4, "{normal:?}");
        }
    }
}
