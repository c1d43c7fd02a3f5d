//! What can go wrong with images and their files.

use std::io;
use std::path::PathBuf;

use crate::files::WriteError;
use crate::image::{Format, MAX_SIDE};

/// An error of the image module; each message names the file and what is wrong with it.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// A side is zero or too long.
    #[error("an image of {width}x{height} pixels: each side must be in 1..={MAX_SIDE}")]
    Size {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A list does not have one value for each pixel.
    #[error("{found} {what} for an image of {width}x{height}, expected {expected}")]
    Count {
        /// What was counted.
        what: &'static str,
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// `width·height`.
        expected: usize,
        /// Length of the list.
        found: usize,
    },
    /// A variance cannot be estimated from so few batches.
    #[error("a variance from {found} batch(es), expected at least 2")]
    Batches {
        /// Number of batches.
        found: u32,
    },
    /// The extension of a file name is none that can be read or written.
    #[error("{}: unknown image format, expected one of {}", path.display(), Format::extensions())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The operating system refused to read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file is not what its extension says, or is damaged.
    #[error("{}: not a valid {format} file: {problem}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What the extension says.
        format: Format,
        /// What was found.
        problem: String,
    },
    /// The file is (or may be) valid, but of a kind that is not supported.
    #[error("{}: unsupported {format} file: {problem}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What the extension says.
        format: Format,
        /// What was found, and what is supported.
        problem: String,
    },
    /// The file could not be written; an older file of that name is as it was.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The encoder refuses.
    #[error("the image cannot be encoded")]
    Encode(#[source] io::Error),
    /// A metadata entry that not every format can carry.
    #[error("metadata entry {key:?}: {problem}")]
    Metadata {
        /// The entry's key.
        key: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// Images of different sizes cannot be compared.
    #[error("the image has {}x{} pixels, the reference {}x{}", image.0, image.1, reference.0, reference.1)]
    SizeMismatch {
        /// Width and height of the image.
        image: (u32, u32),
        /// Width and height of the reference.
        reference: (u32, u32),
    },
    /// No pixel is finite in both images, so there is nothing to compare.
    #[error("no pixel is finite in both images")]
    NothingFinite,
}
