//! Images of textures, decoded.

use std::borrow::Cow;

use image::{DynamicImage, ImageDecoder, ImageReader, Limits};

use crate::scene::texture::{Texels, TextureImage};

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
    let mut reader = ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    if bytes.starts_with(b"\xabKTX 20\xbb") {
        return Err("a KTX2 image".to_owned());
    }
    if reader.format().is_none() {
        // Only TGA has no mark of its own.
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
            let clean = |x: f32| if x.is_finite() { x.max(0.0) } else { 0.0 };
            let pixels = image.into_rgba32f().into_raw();
            Texels::Rgba32F(pixels.as_chunks().0.iter().map(|pixel: &[f32; 4]| pixel.map(clean)).collect())
        }
        _ => Texels::Rgba8(image.into_rgba8().into_raw().as_chunks().0.to_vec()),
    };
    Ok(TextureImage { name: name.to_owned(), width, height, texels })
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
