//! Headings of groups of options.

/// What is rendered.
pub const SCENE: &str = "Scene";
/// Where the image goes, and how large it is.
pub const IMAGE: &str = "Image";
/// How good it gets, and how long that takes.
pub const QUALITY: &str = "Quality and time";
/// On what it is rendered.
pub const DEVICE: &str = "Device";
/// What else is printed.
pub const OUTPUT: &str = "Output";
/// What people who render do not need.
pub const DEVELOPERS: &str = "For developers of the renderer";
