//! Figures that tell how good a tree is.

use super::builder::{Child, Tree};

/// Figures of a tree.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TreeStatistics {
    /// Inner nodes.
    pub nodes: usize,
    /// Leaves, one primitive each.
    pub leaves: usize,
    /// Depth of the deepest leaf.
    pub depth: u32,
    /// Expected boxes and primitives tested by a long random ray that meets the root's box (surface area heuristic,
    /// with unit costs).
    pub sah_cost: f64,
    /// Bytes of the packed records.
    pub bytes: usize,
    /// Seconds that building took, packing included.
    pub build_seconds: f64,
}

impl TreeStatistics {
    /// Measures a tree.
    pub fn of(tree: &Tree, build_seconds: f64) -> Self {
        let root = &tree.nodes[0];
        let whole = f64::from(root.bounds[0].union(root.bounds[1]).half_area());
        let mut depth = 0;
        let mut area = whole;
        let mut stack = vec![(0u32, 1u32)];
        while let Some((index, level)) = stack.pop() {
            let node = &tree.nodes[index as usize];
            for (bounds, child) in node.bounds.iter().zip(node.children) {
                area += f64::from(bounds.half_area());
                match child {
                    Child::Inner(next) => stack.push((next, level + 1)),
                    Child::Leaf(_) => depth = depth.max(level),
                }
            }
        }
        Self {
            nodes: tree.nodes.len(),
            leaves: tree.order.len(),
            depth,
            sah_cost: if whole > 0.0 { area / whole } else { 0.0 },
            bytes: 64 * (tree.nodes.len() + tree.order.len()),
            build_seconds,
        }
    }
}
