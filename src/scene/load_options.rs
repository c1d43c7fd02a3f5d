//! Choices that a file leaves.

/// What to make of a file that leaves a choice. Time and variant concern glTF.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadOptions {
    /// Animations are evaluated at this time, seconds; without one nodes are as they are stored.
    pub time: Option<f64>,
    /// Name or number of a variant of the materials.
    pub variant: Option<String>,
    /// Longest side of a texture, pixels; larger ones are made smaller.
    pub texture_limit: Option<u32>,
    /// Files that a file names have to be in its folder.
    pub confine: bool,
}
