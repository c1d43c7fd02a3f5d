//! Headings of groups of options.

pub const SCENE: &str = "Scene";
pub const IMAGE: &str = "Image";
pub const QUALITY: &str = "Quality and time";
pub const DEVICE: &str = "Device";
pub const OUTPUT: &str = "Output";
pub const DEVELOPERS: &str = "For developers of the renderer";
