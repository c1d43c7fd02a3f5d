//! Radiance HDR: pixels of three 8-bit mantissas with one exponent, run-length coded.
//!
//! G. Ward, "Real Pixels", Graphics Gems II (1991), and `color.c` of Radiance. Mantissas are rounded to
//! nearest and read without an offset, as nearly all readers do, so that a round trip has no bias.

use std::io::{self, Write};

use ::image::codecs::hdr::{HdrDecoder, HdrEncoder};
use ::image::{DynamicImage, ImageDecoder, Rgb};

use crate::image::codec::{DecodeError, check_header, limits};
use crate::image::metadata::is_key;
use crate::image::transfer::clamp;
use crate::image::{Image, Metadata};

const SIGNATURE: &[u8] = b"#?RADIANCE\n";

/// Writes pixels and, as comment lines `# KEY: VALUE`, metadata (values as JSON strings).
pub(super) fn encode(image: &Image, metadata: &Metadata, writer: &mut impl Write) -> io::Result<()> {
    let pixels: Vec<_> = image.pixels().iter().map(|&pixel| Rgb(rounded(pixel))).collect();
    let mut bytes = Vec::new();
    let (width, height) = (image.width() as usize, image.height() as usize);
    HdrEncoder::new(&mut bytes).encode(&pixels, width, height).map_err(io::Error::other)?;
    let Some(rest) = bytes.strip_prefix(SIGNATURE) else {
        return Err(io::Error::other("the encoder's header is damaged"));
    };
    writer.write_all(SIGNATURE)?;
    for (key, value) in metadata.iter() {
        writeln!(writer, "# {key}: {}", serde_json::Value::from(value))?;
    }
    writer.write_all(rest)
}

/// The nearest value that the format holds; the encoder would round down, which darkens. Negative values and NaN become
/// 0, values beyond the range its end.
fn rounded(pixel: [f32; 3]) -> [f32; 3] {
    const LARGEST: f64 = 255.0 * exp2(127 - 8);
    let c = pixel.map(|v| clamp(f64::from(v), LARGEST));
    let max = c[0].max(c[1]).max(c[2]);
    // max = f·2^exponent with f in [0.5, 1), read from the bits; f32 input is never subnormal in f64.
    let mut exponent = ((max.to_bits() >> 52) as i32) - 1022;
    if max * exp2(8 - exponent) >= 255.5 {
        exponent += 1;
    }
    // The smallest exponent of the format; of the sum, the encoder would take the lowest 8 bits.
    if exponent + 128 < 1 {
        return [0.0; 3];
    }
    c.map(|v| ((v * exp2(8 - exponent)).round() * exp2(exponent - 8)) as f32)
}

/// 2^exponent for the exponents of normal numbers (−1022..=1023).
const fn exp2(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// Reads flat, old and new run-length coded pixels, rows from the top; `EXPOSURE` is divided out.
pub(super) fn decode(bytes: &[u8]) -> Result<(Image, Metadata), DecodeError> {
    if !bytes.starts_with(b"#?") {
        return Err(DecodeError::Malformed("the file does not begin with \"#?RADIANCE\" or \"#?RGBE\"".into()));
    }
    // A run that is repeated 256^8 times overflows in the decoder, where overflow is checked.
    if bytes.windows(20).any(|window| *window.as_chunks::<4>().0 == [[1, 1, 1, 0]; 5]) {
        return Err(DecodeError::Malformed("many runs of length zero".into()));
    }
    // Strict would be without "#?RGBE".
    let mut decoder = HdrDecoder::new_nonstrict(bytes)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = check_header(width.into(), height.into(), bytes.len(), 1024)?;
    decoder.set_limits(limits())?;
    let mut exposure = 1.0;
    for (key, value) in decoder.metadata().custom_attributes {
        if key == "EXPOSURE" {
            let factor: f64 = value.trim().parse().unwrap_or(f64::NAN);
            if !(factor > 0.0 && factor.is_finite()) {
                return Err(DecodeError::Malformed(format!("EXPOSURE is {value:?}, expected a positive number")));
            }
            exposure *= factor; // several lines multiply
        }
    }
    let mut values = DynamicImage::from_decoder(decoder)?.into_rgb32f().into_raw();
    if exposure != 1.0 {
        values.iter_mut().for_each(|v| *v = (f64::from(*v) / exposure) as f32);
    }
    let image = Image::from_pixels(width, height, values.as_chunks().0.to_vec())?;
    Ok((image, comments(bytes)))
}

/// The decoder skips comments.
fn comments(bytes: &[u8]) -> Metadata {
    let mut metadata = Metadata::new();
    for line in bytes.split(|&b| b == b'\n').take_while(|line| !line.is_empty()) {
        let line = String::from_utf8_lossy(line);
        let entry = line.strip_prefix("# ").and_then(|comment| comment.split_once(": "));
        if let Some((key, value)) = entry.filter(|(key, _)| is_key(key)) {
            metadata.push(key, serde_json::from_str(value).unwrap_or(value.to_owned()));
        }
    }
    metadata
}
