//! The file formats, told apart by extension.

use std::fmt;
use std::path::Path;

use crate::image::ImageError;

/// An image file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics (ISO/IEC 15948), written with 8 bits per channel.
    Png,
    /// OpenEXR, written as 32-bit float with noise estimates.
    Exr,
    /// Radiance RGBE, a shared exponent for three 8-bit mantissas.
    Hdr,
    /// Portable float map, 32-bit float without metadata.
    Pfm,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 4] = [Self::Png, Self::Exr, Self::Hdr, Self::Pfm];

    /// The format that a file name's extension stands for (in any case).
    ///
    /// # Errors
    /// [`ImageError::UnknownFormat`], which lists the known extensions.
    pub fn from_path(path: &Path) -> Result<Self, ImageError> {
        let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        Self::ALL
            .into_iter()
            .find(|format| extension.as_deref() == Some(format.extension()))
            .ok_or_else(|| ImageError::UnknownFormat { path: path.to_owned() })
    }

    /// File name extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr => "exr",
            Self::Hdr => "hdr",
            Self::Pfm => "pfm",
        }
    }

    /// All extensions, for messages.
    pub(super) fn extensions() -> String {
        Self::ALL.map(|format| format!(".{}", format.extension())).join(", ")
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Exr => "OpenEXR",
            Self::Hdr => "Radiance HDR",
            Self::Pfm => "PFM",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extension_decides_in_any_case() {
        assert_eq!(Format::from_path(Path::new("a/b.ExR")).unwrap(), Format::Exr);
        assert_eq!(Format::from_path(Path::new("x.tar.png")).unwrap(), Format::Png);
        for name in ["x", "x.jpg", "png", ".png", "x."] {
            let message = Format::from_path(Path::new(name)).unwrap_err().to_string();
            assert!(message.starts_with(name) && message.contains(".png, .exr, .hdr, .pfm"), "{message}");
        }
    }
}
