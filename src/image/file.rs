//! Reading and writing image files.

use std::path::Path;

use crate::files;
use crate::image::codec;
use crate::image::codec::DecodeError;
use crate::image::{Format, Image, ImageError, Metadata};
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
/// - OpenEXR: 32-bit float, with the noise estimate as the layer `variance` and the numbers of
///   samples as the integer channel `samples`, where the image has them.
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
    write_as(path, Format::from_path(path)?, image, metadata, transfer)
}

/// Writes an image as [`write()`] does, whatever the path's extension.
///
/// # Errors
/// As of [`write()`], but for [`ImageError::UnknownFormat`].
pub fn write_as(
    path: &Path,
    format: Format,
    image: &Image,
    metadata: &Metadata,
    transfer: Transfer,
) -> Result<Written, ImageError> {
    metadata.check()?;
    files::write_whole(path, |writer| codec::encode(format, image, metadata, transfer, writer))?;
    Ok(lost(format, image))
}

/// The bytes of an image's file.
///
/// # Errors
/// [`ImageError::Metadata`], or [`ImageError::Encode`].
pub fn encode(
    format: Format,
    image: &Image,
    metadata: &Metadata,
    transfer: Transfer,
) -> Result<(Vec<u8>, Written), ImageError> {
    metadata.check()?;
    let mut bytes = Vec::new();
    codec::encode(format, image, metadata, transfer, &mut bytes).map_err(ImageError::Encode)?;
    Ok((bytes, lost(format, image)))
}

fn lost(format: Format, image: &Image) -> Written {
    let non_finite = match format {
        Format::Png | Format::Hdr => image.pixels().iter().filter(|p| !p.iter().all(|c| c.is_finite())).count(),
        Format::Exr | Format::Pfm => 0,
    };
    Written { non_finite }
}

/// Reads an image in the format of the path's extension, as linear radiance.
///
/// PNG is decoded by its sRGB or gAMA chunk (sRGB if it has neither); alpha is ignored.
///
/// # Errors
/// [`ImageError::UnknownFormat`], [`ImageError::Read`], [`ImageError::Malformed`] or [`ImageError::Unsupported`].
pub fn read(path: &Path) -> Result<(Image, Metadata), ImageError> {
    let format = Format::from_path(path)?;
    let bytes = files::read_regular(path).map_err(|source| ImageError::Read { path: path.to_owned(), source })?;
    codec::decode(format, &bytes).map_err(|error| match error {
        DecodeError::Malformed(problem) => ImageError::Malformed { path: path.to_owned(), format, problem },
        DecodeError::Unsupported(problem) => ImageError::Unsupported { path: path.to_owned(), format, problem },
    })
}

/// Checks, before hours of rendering, that [`write()`] can write to `path`: a known extension, a directory
/// that exists and can be written, and no directory in the file's place.
///
/// # Errors
/// [`ImageError::UnknownFormat`] or [`ImageError::Write`].
pub fn check_writable(path: &Path) -> Result<(), ImageError> {
    Format::from_path(path)?;
    Ok(files::check_writable(path)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::error::Error;
    use std::fs;

    #[test]
    fn round_trip_by_extension_and_count_of_what_is_lost() {
        let directory = tempfile::tempdir().unwrap();
        let image = Image::from_pixels(2, 1, vec![[0.0, 1.0, 0.5], [f32::NAN, f32::INFINITY, 1.0]]).unwrap();
        for (name, non_finite) in [("a.png", 1), ("a.HDR", 1), ("a.exr", 0), ("a.pfm", 0)] {
            let path = directory.path().join(name);
            check_writable(&path).unwrap();
            let written = write(&path, &image, &Metadata::new(), Transfer::Srgb).unwrap();
            assert_eq!(written, Written { non_finite }, "{name}");
            let (read, _) = read(&path).unwrap();
            assert!((read.pixels()[0][2] - 0.5).abs() < 0.003 && read.pixels()[0][1] == 1.0, "{name}");
        }
    }

    #[test]
    fn errors_name_the_file_and_the_reason() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        fs::write(at("short.pfm"), "PF\n1 1\n-1\n").unwrap();
        fs::write(at("x.hdr"), "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n").unwrap();
        fs::create_dir(at("folder.png")).unwrap();
        let message = |error: ImageError| match error.source() {
            Some(source) => format!("{error}: {source}"),
            None => error.to_string(),
        };
        for (name, reason) in [
            ("short.pfm", "not a valid PFM file: 0 bytes of pixels, expected 12"),
            ("x.hdr", "unsupported Radiance HDR file: The image format `32-bit_rle_xyze`"),
            ("gone.exr", "No such file"),
            ("x.jpg", "unknown image format"),
        ] {
            let message = message(read(&at(name)).unwrap_err());
            assert!(message.contains(name) && message.contains(reason), "{message}");
        }
        let image = Image::new(1, 1).unwrap();
        for (name, reason) in
            [("folder.png", "directory"), ("gone/a.png", "No such file"), ("x.jpg", "unknown image format")]
        {
            let path = at(name);
            for error in [check_writable(&path), write(&path, &image, &Metadata::new(), Transfer::Srgb).map(drop)] {
                let message = message(error.unwrap_err());
                assert!(message.contains(name) && message.contains(reason), "{message}");
            }
        }
    }

    #[test]
    fn refused_metadata_keep_the_old_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.png");
        fs::write(&path, "old").unwrap();
        let mut metadata = Metadata::new();
        metadata.push("no spaces", "please");
        let error = write(&path, &Image::new(1, 1).unwrap(), &metadata, Transfer::Srgb).unwrap_err();
        assert!(matches!(error, ImageError::Metadata { .. }));
        assert_eq!(fs::read(&path).unwrap(), b"old");
    }
}
