//! The file formats: bytes to image and back. Files and names are the caller's business.

mod exr;
mod hdr;
mod pfm;
mod png;

use std::io::{self, Write};

use crate::image::{Format, Image, ImageError, ImageLayers, MAX_SIDE, Metadata};
use crate::scene::Transfer;

/// Why bytes are not an image.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum DecodeError {
    /// The bytes contradict the format.
    Malformed(String),
    /// The format allows it, this program does not.
    Unsupported(String),
}

impl DecodeError {
    fn malformed(problem: impl ToString) -> Self {
        Self::Malformed(problem.to_string())
    }
}

impl From<ImageError> for DecodeError {
    fn from(error: ImageError) -> Self {
        Self::malformed(error)
    }
}

impl From<::image::ImageError> for DecodeError {
    fn from(error: ::image::ImageError) -> Self {
        match error {
            ::image::ImageError::Unsupported(problem) => Self::Unsupported(problem.to_string()),
            other => Self::malformed(other),
        }
    }
}

/// Writes `image` to `writer`; `transfer` concerns PNG only.
pub(super) fn encode(
    format: Format,
    image: &Image,
    metadata: &Metadata,
    transfer: Transfer,
    writer: &mut impl Write,
) -> io::Result<()> {
    match format {
        Format::Png => png::encode(image, metadata, transfer, writer),
        Format::Exr => exr::encode(image, metadata, writer),
        Format::Hdr => hdr::encode(image, metadata, writer),
        Format::Pfm => pfm::encode(image, writer),
    }
}

/// Writes layers to `writer`, as OpenEXR.
pub(super) fn encode_layers(layers: &ImageLayers, metadata: &Metadata, writer: &mut impl Write) -> io::Result<()> {
    exr::encode_layers(layers, metadata, writer)
}

/// Reads a whole file's bytes.
pub(super) fn decode(format: Format, bytes: &[u8]) -> Result<(Image, Metadata), DecodeError> {
    match format {
        Format::Png => png::decode(bytes),
        Format::Exr => exr::decode(bytes),
        Format::Hdr => hdr::decode(bytes),
        Format::Pfm => pfm::decode(bytes).map(|image| (image, Metadata::new())),
    }
}

/// For decoders that take limits; those that depend on the file are checked by [`check_header`].
fn limits() -> ::image::Limits {
    let mut limits = ::image::Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits
}

/// Checks a header's size before memory is set aside for it: sides in range, and no more pixels than
/// `bytes` can hold at `max_pixels_per_byte`, the best compression of the format.
fn check_header(width: u64, height: u64, bytes: usize, max_pixels_per_byte: u64) -> Result<(u32, u32), DecodeError> {
    let side = |length: u64| u32::try_from(length).ok().filter(|l| (1..=MAX_SIDE).contains(l));
    let (Some(w), Some(h)) = (side(width), side(height)) else {
        return Err(DecodeError::Malformed(format!(
            "the header says {width}x{height} pixels, each side must be in 1..={MAX_SIDE}"
        )));
    };
    if width * height > (bytes as u64).saturating_mul(max_pixels_per_byte) {
        return Err(DecodeError::Malformed(format!(
            "the header says {width}x{height} pixels, too many for a file of {bytes} bytes"
        )));
    }
    Ok((w, h))
}

#[cfg(test)]
mod tests;
