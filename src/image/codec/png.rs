//! PNG (ISO/IEC 15948): written with 8 bits per channel and the transfer curve in a gAMA or sRGB chunk.
//!
//! Pixels are read by the `image` crate. It writes neither text nor gAMA and sRGB chunks, reads no text, and does not
//! tell an sRGB chunk from a gAMA of 1/2.2: for these, the `png` crate, on which it builds, is used directly.

use std::io::{self, Cursor, Write};

use ::image::DynamicImage;
use ::image::codecs::png::PngDecoder;
use ::png::text_metadata::{ITXtChunk, TEXtChunk};
use ::png::{BitDepth, ColorType, Compression, Decoder, Encoder, Info, ScaledFloat, SrgbRenderingIntent};
use rayon::prelude::*;

use crate::image::codec::{DecodeError, check_header, limits};
use crate::image::{Image, Metadata};
use crate::scene::Transfer;

/// The gAMA chunk holds 100000 times the encoding exponent.
const GAMA_SCALE: f64 = 100_000.0;

/// Writes 8-bit RGB, or RGBA for an image with alpha; metadata become tEXt chunks, or iTXt where a value is not ASCII.
pub(super) fn encode(
    image: &Image,
    metadata: &Metadata,
    transfer: Transfer,
    writer: &mut impl Write,
) -> io::Result<()> {
    let mut encoder = Encoder::new(writer, image.width(), image.height());
    encoder.set_color(if image.alpha().is_some() { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    match transfer {
        Transfer::Srgb => encoder.set_source_srgb(SrgbRenderingIntent::Perceptual),
        Transfer::Gamma(gamma) => {
            encoder.set_source_gamma(ScaledFloat::from_scaled(
                (GAMA_SCALE / gamma).round().clamp(1.0, f64::from(i32::MAX)) as u32,
            ));
        }
    }
    let mut writer = encoder.write_header()?;
    for (key, value) in metadata.iter() {
        if value.is_ascii() {
            writer.write_text_chunk(&TEXtChunk::new(key, value))?;
        } else {
            writer.write_text_chunk(&ITXtChunk::new(key, value))?;
        }
    }
    let codes: Vec<u8> = match image.alpha() {
        None => image.pixels().as_flattened().par_iter().map(|&value| transfer.code(value)).collect(),
        Some(alpha) => image.pixels().par_iter().zip(alpha).flat_map_iter(|(p, &a)| rgba(*p, a, transfer)).collect(),
    };
    writer.write_image_data(&codes)?;
    Ok(writer.finish()?)
}

/// PNG holds the colour of what covers a pixel, whatever part of it that is.
fn rgba(pixel: [f32; 3], alpha: f32, transfer: Transfer) -> [u8; 4] {
    let [r, g, b] = pixel.map(|c| if alpha > 0.0 { transfer.code(c / alpha) } else { 0 });
    [r, g, b, (255.0 * alpha.clamp(0.0, 1.0) + 0.5) as u8]
}

/// Reads grey, colour and palette images of any depth; alpha is ignored.
pub(super) fn decode(bytes: &[u8]) -> Result<(Image, Metadata), DecodeError> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    let header = decoder.read_header_info().map_err(DecodeError::malformed)?;
    // Deflate reaches 1032:1, and a byte may hold 8 pixels.
    let (width, height) = check_header(header.width.into(), header.height.into(), bytes.len(), 8 * 1032)?;
    let mut chunks = decoder.read_info().map_err(DecodeError::malformed)?;
    // Text may come after the pixels.
    chunks.finish().map_err(DecodeError::malformed)?;
    let transfer = stored_transfer(chunks.info());

    let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits())?;
    let image = DynamicImage::from_decoder(decoder)?;
    let table = |largest: u16| -> Vec<f32> {
        (0..=largest).map(|code| transfer.decode(f64::from(code) / f64::from(largest)) as f32).collect()
    };
    let linear: Vec<f32> = if image.color().bytes_per_pixel() > image.color().channel_count() {
        let table = table(u16::MAX);
        image.into_rgb16().iter().map(|&code| table[usize::from(code)]).collect()
    } else {
        let table = table(u8::MAX.into());
        image.into_rgb8().iter().map(|&code| table[usize::from(code)]).collect()
    };
    let pixels = linear.as_chunks().0.to_vec();
    Ok((Image::from_pixels(width, height, pixels)?, stored_text(chunks.info())))
}

/// sRGB chunk before gAMA chunk, sRGB if there is neither, as the standard has it.
fn stored_transfer(info: &Info) -> Transfer {
    match info.gama_chunk.map(ScaledFloat::into_scaled) {
        Some(gama) if info.srgb.is_none() && gama > 0 => Transfer::Gamma(gamma_from_chunk(gama)),
        _ => Transfer::Srgb,
    }
}

/// The gamma of at most three decimals that the chunk's five digits stand for (45455 is 2.2, not 2.19998),
/// else the exact quotient.
fn gamma_from_chunk(gama: u32) -> f64 {
    let exact = GAMA_SCALE / f64::from(gama);
    let short = (exact * 1000.0).round() / 1000.0;
    if (GAMA_SCALE / short).round() == f64::from(gama) { short } else { exact }
}

fn stored_text(info: &Info) -> Metadata {
    let mut metadata = Metadata::new();
    for chunk in &info.uncompressed_latin1_text {
        metadata.push(chunk.keyword.as_str(), &chunk.text);
    }
    for chunk in &info.utf8_text {
        if let Ok(text) = chunk.get_text() {
            metadata.push(chunk.keyword.as_str(), text);
        }
    }
    metadata
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_digits_give_back_the_gamma() {
        for gamma in [0.5, 1.0, 1.8, 2.2, 2.4, 2.222, 3.0] {
            let chunk = (GAMA_SCALE / gamma).round() as u32;
            assert_eq!(gamma_from_chunk(chunk), gamma);
        }
        assert!((gamma_from_chunk(12_345) - 8.100_445_524).abs() < 1e-3);
    }
}
