//! Figures that tell how good a tree is.

/// Figures of a tree.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BvhStatistics {
    /// Inner nodes.
    pub nodes: usize,
    /// Leaves, one or two primitives each.
    pub leaves: usize,
    /// What is in them.
    pub primitives: usize,
    /// Depth of the deepest leaf.
    pub depth: u32,
    /// Expected records visited by a long random ray that meets the root's box (surface area heuristic with unit costs).
    pub sah_cost: f64,
    /// Bytes of the packed records.
    pub bytes: usize,
    /// Seconds that building took, packing included.
    pub build_seconds: f64,
}
