//! Portable float map (P. Debevec, <https://www.pauldebevec.com/Research/HDR/PFM/>): a text header
//! `PF` or `Pf`, width and height, a scale whose sign tells the byte order, then rows from the bottom up.

use std::io::{self, Write};

use crate::image::Image;
use crate::image::codec::{DecodeError, check_header};

/// Writes colour, little-endian, at scale 1.
pub(super) fn encode(image: &Image, writer: &mut impl Write) -> io::Result<()> {
    write!(writer, "PF\n{} {}\n-1.0\n", image.width(), image.height())?;
    let mut values = Vec::new();
    for row in image.pixels().chunks_exact(image.width() as usize).rev() {
        values.clear();
        values.extend(row.as_flattened().iter().map(|value| value.to_le_bytes()));
        writer.write_all(values.as_flattened())?;
    }
    Ok(())
}

/// Reads colour or grey in either byte order; the scale's magnitude multiplies the values.
pub(super) fn decode(bytes: &[u8]) -> Result<Image, DecodeError> {
    let mut rest = bytes;
    let channels = match token(&mut rest, "the signature")? {
        "PF" => 3,
        "Pf" => 1,
        other => {
            return Err(DecodeError::Malformed(format!("the signature is {other:?}, expected \"PF\" or \"Pf\"")));
        }
    };
    let width: u64 = number(&mut rest, "the width")?;
    let height: u64 = number(&mut rest, "the height")?;
    let scale: f32 = number(&mut rest, "the scale")?;
    if scale == 0.0 || !scale.is_finite() {
        return Err(DecodeError::Malformed(format!("the scale is {scale}, expected a finite number other than 0")));
    }
    let (width, height) = check_header(width, height, bytes.len(), 1)?;
    let expected = width as usize * height as usize * channels * 4;
    if rest.len() != expected {
        return Err(DecodeError::Malformed(format!(
            "{} bytes of pixels, expected {expected} for {width}x{height} with {channels} channel(s)",
            rest.len()
        )));
    }
    let (from_bytes, scale): (fn([u8; 4]) -> f32, f32) =
        if scale < 0.0 { (f32::from_le_bytes, -scale) } else { (f32::from_be_bytes, scale) };
    let value = |b: &[u8; 4]| if scale == 1.0 { from_bytes(*b) } else { from_bytes(*b) * scale };
    let (values, _) = rest.as_chunks::<4>();
    let rows = values.chunks_exact(width as usize * channels).rev();
    let pixels = if channels == 3 {
        rows.flat_map(|row| row.as_chunks::<3>().0).map(|p| p.each_ref().map(value)).collect()
    } else {
        rows.flatten().map(|v| [value(v); 3]).collect()
    };
    Ok(Image::from_pixels(width, height, pixels)?)
}

/// The next word of the header, with the one white space that ends it taken off `rest`.
fn token<'a>(rest: &mut &'a [u8], what: &str) -> Result<&'a str, DecodeError> {
    const LONGEST: usize = 32;
    let truncated = || DecodeError::Malformed(format!("the header ends before {what}"));
    let start = rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or_else(truncated)?;
    let word = &rest[start..];
    let length = word.iter().take(LONGEST).position(u8::is_ascii_whitespace).ok_or_else(truncated)?;
    *rest = &word[length + 1..];
    std::str::from_utf8(&word[..length]).map_err(|_| DecodeError::Malformed(format!("{what} is not text")))
}

fn number<T: std::str::FromStr>(rest: &mut &[u8], what: &str) -> Result<T, DecodeError> {
    let word = token(rest, what)?;
    word.parse().map_err(|_| DecodeError::Malformed(format!("{what} is {word:?}, expected a number")))
}
