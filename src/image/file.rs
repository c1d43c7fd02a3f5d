//! Reading and writing image files.

use std::fs;
use std::path::Path;

use super::codec::{self, DecodeError};
use super::{Format, Image, ImageError, Metadata, atomic};
use crate::scene::Transfer;

/// What was lost in writing a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Written {
    /// Pixels with a NaN or infinite channel that the format cannot hold. PNG and HDR write 0 for NaN and
    /// the largest code for +∞; EXR and PFM keep such values, so that this is 0.
    pub non_finite: usize,
}

/// Writes an image in the format of the path's extension.
///
/// - PNG: 8 bits per channel by `transfer`, values clamped to 0..=1, with a matching gAMA or sRGB chunk.
/// - OpenEXR: 32-bit float, and the noise estimate as the layer `variance`.
/// - Radiance HDR: RGBE rounded to nearest, values clamped to 0..=1.7e38.
/// - PFM: little-endian float.
///
/// `transfer` concerns PNG only. The file is written under a temporary name beside `path` and then
/// renamed: it appears whole or not at all.
///
/// # Errors
/// [`ImageError::UnknownFormat`], [`ImageError::Metadata`] or [`ImageError::Write`]; an older file at
/// `path` is then as it was.
pub fn write(path: &Path, image: &Image, metadata: &Metadata, transfer: Transfer) -> Result<Written, ImageError> {
    let format = Format::from_path(path)?;
    metadata.check()?;
    atomic::write_whole(path, |writer| codec::encode(format, image, metadata, transfer, writer))
        .map_err(|source| ImageError::Write { path: path.to_owned(), source })?;
    let non_finite = match format {
        Format::Png | Format::Hdr => image.pixels().iter().filter(|p| !p.iter().all(|c| c.is_finite())).count(),
        Format::Exr | Format::Pfm => 0,
    };
    Ok(Written { non_finite })
}

/// Reads an image in the format of the path's extension, as linear radiance.
///
/// PNG is decoded by its sRGB or gAMA chunk (sRGB if it has neither); alpha is ignored.
///
/// # Errors
/// [`ImageError::UnknownFormat`], [`ImageError::Read`], [`ImageError::Malformed`] or [`ImageError::Unsupported`].
pub fn read(path: &Path) -> Result<(Image, Metadata), ImageError> {
    let format = Format::from_path(path)?;
    let bytes = fs::read(path).map_err(|source| ImageError::Read { path: path.to_owned(), source })?;
    codec::decode(format, &bytes).map_err(|error| match error {
        DecodeError::Malformed(problem) => ImageError::Malformed { path: path.to_owned(), format, problem },
        DecodeError::Unsupported(problem) => ImageError::Unsupported { path: path.to_owned(), format, problem },
    })
}

/// Checks, before hours of rendering, that [`write`] can write to `path`: a known extension, a directory
/// that exists and can be written, and no directory in the file's place.
///
/// # Errors
/// [`ImageError::UnknownFormat`] or [`ImageError::Write`].
pub fn check_writable(path: &Path) -> Result<(), ImageError> {
    Format::from_path(path)?;
    atomic::check(path).map_err(|source| ImageError::Write { path: path.to_owned(), source })
}
