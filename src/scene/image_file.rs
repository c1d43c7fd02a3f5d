//! Images of textures, decoded.

use std::borrow::Cow;
use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageReader, Limits};

use crate::scene::texture::{Texels, TextureImage};

/// What files of images may be.
pub(super) const KINDS: &str = "PNG, JPEG, WebP, TGA, BMP, HDR or EXR";

/// Longest side of an image.
const MAX_SIDE: u32 = 32_768;
/// Bytes that decoding an image may take.
const MAX_BYTES: u64 = 4 << 30;

/// Decodes an image by its content. What the file says of its orientation is followed.
///
/// # Errors
/// In words: it is of no known kind, broken, or too large.
pub(super) fn decode(bytes: &[u8], name: &str) -> Result<TextureImage, String> {
    let bytes = &*with_known_mark(bytes);
    if is_exr(bytes) {
        let (width, height, pixels) = read_exr(bytes)?;
        return Ok(TextureImage { name: name.to_owned(), width, height, texels: cleaned(&pixels) });
    }
    if bytes.starts_with(b"\xabKTX 20\xbb") {
        return Err("a KTX2 image".to_owned());
    }
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    if reader.format().is_none() {
        if !may_be_tga(bytes) {
            return Err("no image of a kind that is known".to_owned());
        }
        reader.set_format(image::ImageFormat::Tga);
    }
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MAX_SIDE), Some(MAX_SIDE));
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(format!("an image of {width} × {height} pixels"));
    }
    let image = DynamicImage::from_decoder(decoder).map_err(|error| error.to_string())?;
    let texels = match image {
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => Texels::Rgba16(image.into_rgba16().into_raw().as_chunks().0.to_vec()),
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            cleaned(image.into_rgba32f().into_raw().as_chunks().0)
        }
        _ => Texels::Rgba8(image.into_rgba8().into_raw().as_chunks().0.to_vec()),
    };
    Ok(TextureImage { name: name.to_owned(), width, height, texels })
}

/// What is below 0 or not finite counts as 0.
fn cleaned(pixels: &[[f32; 4]]) -> Texels {
    let clean = |x: f32| if x.is_finite() { x.max(0.0) } else { 0.0 };
    Texels::Rgba32F(pixels.iter().map(|pixel| pixel.map(clean)).collect())
}

/// Only TGA has no mark of its own: whether the header could be one.
fn may_be_tga(bytes: &[u8]) -> bool {
    let Some(header) = bytes.first_chunk::<18>() else { return false };
    let (map, kind, depth) = (header[1], header[2], header[16]);
    map <= 1 && matches!(kind, 1..=3 | 9..=11) && matches!(depth, 8 | 15 | 16 | 24 | 32)
}

/// Whether a file is of OpenEXR.
pub(super) fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

/// Width, height and pixels of an `.exr`, as they are stored; opaque where it has no alpha.
///
/// # Errors
/// In words: it is broken, has no colours, or is too large.
pub(super) fn read_exr(bytes: &[u8]) -> Result<(u32, u32, Vec<[f32; 4]>), String> {
    use exr::prelude::{MetaData, ReadChannels as _, ReadLayers as _, read};
    let header = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| error.to_string())?;
    let most = MAX_SIDE as usize;
    let is_too_large = |size: exr::prelude::Vec2<usize>| {
        size.width() > most || size.height() > most || size.area() as u64 * 16 > MAX_BYTES
    };
    if let Some(size) = header.headers.iter().map(|header| header.layer_size).find(|size| is_too_large(*size)) {
        return Err(format!("an image of {} × {} pixels, which is too large", size.width(), size.height()));
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size, _| (size.width(), vec![[0.0f32; 4]; size.area()]),
            |(width, pixels), position, (r, g, b, a): (f32, f32, f32, f32)| {
                pixels[position.y() * *width + position.x()] = [r, g, b, a]
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| error.to_string())?;
    let size = image.layer_data.size;
    let (_, pixels) = image.layer_data.channel_data.pixels;
    Ok((size.width() as u32, size.height() as u32, pixels))
}

/// Files of Radiance begin with the name of the program that wrote them, of which the decoder knows one.
fn with_known_mark(bytes: &[u8]) -> Cow<'_, [u8]> {
    const KNOWN: &[u8] = b"#?RADIANCE";
    if !bytes.starts_with(b"#?") || bytes.starts_with(KNOWN) {
        return Cow::Borrowed(bytes);
    }
    let rest = bytes.iter().position(|&byte| byte == b'\n').unwrap_or(bytes.len());
    Cow::Owned([KNOWN, &bytes[rest..]].concat())
}
