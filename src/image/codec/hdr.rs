//! Radiance HDR: pixels of three 8-bit mantissas with one exponent, run-length coded.
//!
//! G. Ward, "Real Pixels", Graphics Gems II (1991), and `color.c` of Radiance. Mantissas are rounded to
//! nearest and read without an offset, as nearly all readers do, so that a round trip has no bias.

use std::io::{self, Write};

use super::{DecodeError, check_header};
use crate::image::metadata::is_key;
use crate::image::transfer::clamp;
use crate::image::{Image, Metadata};

type Rgbe = [u8; 4];

/// Widths that the run-length code of 1991 can express; others are stored flat.
const RLE_WIDTHS: std::ops::Range<usize> = 8..32_768;

/// Writes pixels and, as comment lines `# KEY: VALUE`, metadata (line breaks and backslashes escaped).
pub(super) fn encode(image: &Image, metadata: &Metadata, writer: &mut impl Write) -> io::Result<()> {
    writeln!(writer, "#?RADIANCE")?;
    for (key, value) in metadata.iter() {
        let value = value.replace('\\', "\\\\").replace('\n', "\\n").replace('\r', "\\r");
        writeln!(writer, "# {key}: {value}")?;
    }
    writeln!(writer, "FORMAT=32-bit_rle_rgbe\n")?;
    writeln!(writer, "-Y {} +X {}", image.height(), image.width())?;
    let width = image.width() as usize;
    let mut plane = Vec::with_capacity(width);
    for row in image.pixels().chunks_exact(width) {
        let row: Vec<Rgbe> = row.iter().map(|&pixel| rgbe_from_linear(pixel)).collect();
        if RLE_WIDTHS.contains(&width) {
            writer.write_all(&[2, 2, (width >> 8) as u8, width as u8])?;
            for component in 0..4 {
                plane.clear();
                plane.extend(row.iter().map(|pixel| pixel[component]));
                write_runs(&plane, writer)?;
            }
        } else {
            // Cannot be taken for run-length codes, which begin (2,2,·) or (1,1,1): the largest mantissa
            // of any pixel but black is at least 128.
            writer.write_all(row.as_flattened())?;
        }
    }
    Ok(())
}

/// Negative values and NaN become 0, values beyond the range its end.
fn rgbe_from_linear(pixel: [f32; 3]) -> Rgbe {
    const LARGEST: f64 = 255.0 * exp2(127 - 8);
    let c = pixel.map(|v| clamp(f64::from(v), LARGEST));
    let max = c[0].max(c[1]).max(c[2]);
    // max = f·2^exponent with f in [0.5, 1), read from the bits; f32 input is never subnormal in f64.
    let mut exponent = ((max.to_bits() >> 52) as i32) - 1022;
    if (max * exp2(8 - exponent)).round() > 255.0 {
        exponent += 1;
    }
    if max == 0.0 || exponent + 128 < 1 {
        return [0; 4];
    }
    let scale = exp2(8 - exponent);
    let [r, g, b] = c.map(|v| (v * scale).round() as u8);
    [r, g, b, (exponent + 128) as u8]
}

fn linear_from_rgbe([r, g, b, e]: Rgbe) -> [f32; 3] {
    if e == 0 {
        return [0.0; 3];
    }
    [r, g, b].map(|m| (f64::from(m) * exp2(i32::from(e) - 136)) as f32)
}

/// 2^exponent for the exponents of normal numbers (−1022..=1023).
const fn exp2(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// Runs of 3..=127 equal bytes as (128 + length, byte), all else as (length ≤ 128, bytes).
fn write_runs(bytes: &[u8], writer: &mut impl Write) -> io::Result<()> {
    let run_at = |i: usize| bytes[i..].iter().take(127).take_while(|&&b| b == bytes[i]).count();
    let mut i = 0;
    while i < bytes.len() {
        let run = run_at(i);
        if run >= 3 {
            writer.write_all(&[128 + run as u8, bytes[i]])?;
            i += run;
        } else {
            let start = i;
            while i < bytes.len() && i - start < 128 && run_at(i) < 3 {
                i += 1;
            }
            writer.write_all(&[(i - start) as u8])?;
            writer.write_all(&bytes[start..i])?;
        }
    }
    Ok(())
}

/// Reads flat, old and new run-length coded pixels, rows from the top; `EXPOSURE` is divided out.
pub(super) fn decode(bytes: &[u8]) -> Result<(Image, Metadata), DecodeError> {
    let mut rest = bytes;
    let signature = line(&mut rest)?;
    if !signature.starts_with("#?") {
        return Err(DecodeError::Malformed("the file does not begin with \"#?RADIANCE\" or \"#?RGBE\"".into()));
    }
    let mut metadata = Metadata::new();
    let mut exposure = 1.0;
    loop {
        let line = line(&mut rest)?;
        if line.is_empty() {
            break;
        }
        if let Some(comment) = line.strip_prefix("# ") {
            if let Some((key, value)) = comment.split_once(": ").filter(|(key, _)| is_key(key)) {
                metadata.push(key, unescape(value));
            }
        } else if let Some(format) = line.strip_prefix("FORMAT=") {
            if format.trim() != "32-bit_rle_rgbe" {
                return Err(DecodeError::Unsupported(format!("FORMAT is {format:?}, supported is 32-bit_rle_rgbe")));
            }
        } else if let Some(value) = line.strip_prefix("EXPOSURE=") {
            let factor: f64 = value.trim().parse().unwrap_or(f64::NAN);
            if !(factor > 0.0 && factor.is_finite()) {
                return Err(DecodeError::Malformed(format!("EXPOSURE is {value:?}, expected a positive number")));
            }
            exposure *= factor; // several lines multiply
        }
    }
    let resolution = line(&mut rest)?;
    let (width, height) = match resolution.split_ascii_whitespace().collect::<Vec<_>>()[..] {
        ["-Y", height, "+X", width] => match (width.parse(), height.parse()) {
            (Ok(width), Ok(height)) => check_header(width, height, bytes.len(), 1024)?,
            _ => return Err(DecodeError::Malformed(format!("the resolution is {resolution:?}"))),
        },
        ["-Y" | "+Y" | "-X" | "+X", _, "-Y" | "+Y" | "-X" | "+X", _] => {
            return Err(DecodeError::Unsupported(format!(
                "the resolution is {resolution:?}, supported is the order \"-Y height +X width\""
            )));
        }
        _ => {
            return Err(DecodeError::Malformed(format!(
                "the resolution is {resolution:?}, expected \"-Y height +X width\""
            )));
        }
    };
    let mut pixels = Vec::new();
    let mut row = vec![[0; 4]; width as usize];
    for y in 0..height {
        read_row(&mut rest, &mut row).map_err(|problem| DecodeError::Malformed(format!("row {y}: {problem}")))?;
        let scale = |v: f32| if exposure == 1.0 { v } else { (f64::from(v) / exposure) as f32 };
        pixels.extend(row.iter().map(|&pixel| linear_from_rgbe(pixel).map(scale)));
    }
    Ok((Image::from_pixels(width, height, pixels)?, metadata))
}

fn read_row(rest: &mut &[u8], row: &mut [Rgbe]) -> Result<(), &'static str> {
    let first: Rgbe = take(rest)?;
    let width = row.len();
    if first[..2] != [2, 2] || first[2] >= 128 || !RLE_WIDTHS.contains(&width) {
        return read_old_row(first, rest, row);
    }
    if usize::from(first[2]) << 8 | usize::from(first[3]) != width {
        return Err("the run-length code is for another width");
    }
    for component in 0..4 {
        let mut x = 0;
        while x < width {
            let [count] = take(rest)?;
            let length = usize::from(if count > 128 { count - 128 } else { count });
            if length == 0 || x + length > width {
                return Err("a run of the wrong length");
            }
            let target = row[x..x + length].iter_mut().map(|pixel| &mut pixel[component]);
            if count > 128 {
                let [value] = take(rest)?;
                target.for_each(|byte| *byte = value);
            } else {
                let (values, after) = rest.split_at_checked(length).ok_or("the file ends early")?;
                target.zip(values).for_each(|(byte, value)| *byte = *value);
                *rest = after;
            }
            x += length;
        }
    }
    Ok(())
}

/// Flat pixels, where (1,1,1,n) repeats the last one n times and markers in a row are digits of base 256.
fn read_old_row(first: Rgbe, rest: &mut &[u8], row: &mut [Rgbe]) -> Result<(), &'static str> {
    let (mut x, mut shift, mut next) = (0, 0u32, first);
    loop {
        if next[..3] == [1, 1, 1] {
            let count = usize::from(next[3]).checked_shl(shift).filter(|&n| n <= row.len() - x);
            let last = *x.checked_sub(1).and_then(|i: usize| row.get(i)).ok_or("a run without a pixel to repeat")?;
            let count = count.ok_or("a run of the wrong length")?;
            row[x..x + count].fill(last);
            x += count;
            shift += 8;
        } else {
            row[x] = next;
            x += 1;
            shift = 0;
        }
        if x == row.len() {
            return Ok(());
        }
        next = take(rest)?;
    }
}

fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], &'static str> {
    let (head, tail) = rest.split_first_chunk::<N>().ok_or("the file ends early")?;
    *rest = tail;
    Ok(*head)
}

fn line<'a>(rest: &mut &'a [u8]) -> Result<&'a str, DecodeError> {
    let end = rest
        .iter()
        .position(|&b| b == b'\n')
        .ok_or_else(|| DecodeError::Malformed("the file ends within the header".into()))?;
    let text = std::str::from_utf8(&rest[..end])
        .map_err(|_| DecodeError::Malformed("a line of the header is not UTF-8 text".into()))?;
    *rest = &rest[end + 1..];
    Ok(text.strip_suffix('\r').unwrap_or(text))
}

fn unescape(value: &str) -> String {
    let mut text = String::with_capacity(value.len());
    let mut chars = value.chars();
    while let Some(c) = chars.next() {
        match c {
            '\\' => match chars.next() {
                Some('n') => text.push('\n'),
                Some('r') => text.push('\r'),
                other => text.extend(other),
            },
            c => text.push(c),
        }
    }
    text
}
