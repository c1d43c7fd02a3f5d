//! Binned SAH construction of a binary bounding volume hierarchy with one box per leaf (of what it holds: see leaf.rs).
//!
//! Wald, "On fast construction of SAH-based bounding volume hierarchies" (2007). A subtree over n primitives has
//! n − 1 inner nodes, so that every subtree knows its place in the arrays before it is built, and halves are built
//! in parallel into disjoint slices: the result does not depend on the number of threads.

use rayon::prelude::*;

use crate::accel::aabb::Aabb;
use crate::accel::binning::{Bins, Extent, Reference, best_split, partition};

/// The deepest leaf that [`build`] makes; the shader's stack holds one entry a level.
pub const MAX_DEPTH: u32 = 62;

/// Subtrees larger than this are built by a task of their own.
const PARALLEL_ABOVE: usize = 4096;
/// A child: an inner node, or a leaf's place in [`Tree::order`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Child {
    /// Index into [`Tree::nodes`].
    Inner(u32),
    /// Index into [`Tree::order`].
    Leaf(u32),
}

/// An inner node: two children with their boxes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Boxes of the children.
    pub bounds: [Aabb; 2],
    /// The children.
    pub children: [Child; 2],
}

/// A hierarchy. Node 0 is the root; a tree over one primitive has one node whose children are the same leaf.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Inner nodes, parents before their children.
    pub nodes: Vec<Node>,
    /// Primitive of each leaf, in depth-first order.
    pub order: Vec<u32>,
}

/// Builds a tree over the boxes of primitives; `None` if there are none.
///
/// Boxes must be finite. Any arrangement is allowed, a million equal boxes included.
pub fn build(bounds: &[Aabb]) -> Option<Tree> {
    if bounds.is_empty() {
        return None;
    }
    let mut references: Vec<_> =
        bounds.par_iter().enumerate().map(|(i, &bounds)| Reference::new(bounds, i as u32)).collect();
    let filler = Node { bounds: [Aabb::EMPTY; 2], children: [Child::Leaf(0); 2] };
    if let [only] = bounds {
        return Some(Tree { nodes: vec![Node { bounds: [*only; 2], ..filler }], order: vec![0] });
    }
    let mut nodes = vec![filler; references.len() - 1];
    let whole = Extent::of(&references);
    Subtree { node: 0, leaf: 0, depth: 0 }.build(&mut references, &mut nodes, whole, &mut Bins::new());
    Some(Tree { nodes, order: references.par_iter().map(Reference::primitive).collect() })
}

#[derive(Clone, Copy)]
struct Subtree {
    node: u32,
    leaf: u32,
    depth: u32,
}

impl Subtree {
    /// Builds the subtree over at least two references; `nodes` is its own slice.
    fn build(self, references: &mut [Reference], nodes: &mut [Node], extent: Extent, bins: &mut Bins) {
        let count = references.len();
        let (middle, extents) = self.split(references, extent, bins);
        let (left, right) = references.split_at_mut(middle);
        let (root, rest) = nodes.split_at_mut(1);
        let (left_nodes, right_nodes) = rest.split_at_mut(left.len() - 1);
        let (left_leaf, right_leaf) = (self.leaf, self.leaf + left.len() as u32);
        let (left_node, right_node) = (self.node + 1, self.node + left.len() as u32);
        let child = |n: usize, node, leaf| if n == 1 { Child::Leaf(leaf) } else { Child::Inner(node) };
        root[0] = Node {
            bounds: extents.map(|e| e.bounds.aabb()),
            children: [child(left.len(), left_node, left_leaf), child(right.len(), right_node, right_leaf)],
        };
        let depth = self.depth + 1;
        let mut build_left = |bins: &mut Bins| {
            if left.len() > 1 {
                Subtree { node: left_node, leaf: left_leaf, depth }.build(left, left_nodes, extents[0], bins);
            }
        };
        let mut build_right = |bins: &mut Bins| {
            if right.len() > 1 {
                Subtree { node: right_node, leaf: right_leaf, depth }.build(right, right_nodes, extents[1], bins);
            }
        };
        if count > PARALLEL_ABOVE {
            rayon::join(|| build_left(bins), || build_right(&mut Bins::new()));
        } else {
            build_left(bins);
            build_right(bins);
        }
    }

    /// Orders the references into two non-empty parts; returns the size of the first, and their extents.
    fn split(self, references: &mut [Reference], extent: Extent, bins: &mut Bins) -> (usize, [Extent; 2]) {
        let count = references.len();
        // Levels that halving needs must remain.
        let levels_needed = usize::BITS - (count - 1).leading_zeros();
        let may_be_uneven = self.depth + levels_needed < MAX_DEPTH;
        if count > 2
            && may_be_uneven
            && let Some(split) = best_split(references, extent, bins)
        {
            return partition(references, split);
        }
        let middle = count / 2;
        // Primitives with one box end up in ascending order: of exact copies the first is then the first record.
        let size = (extent.centroids.hi - extent.centroids.lo).truncate();
        let axis = size.max_position();
        let key = |r: &Reference| r.centroid()[axis];
        references
            .select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.primitive().cmp(&b.primitive())));
        (middle, [Extent::of(&references[..middle]), Extent::of(&references[middle..])])
    }
}

impl Tree {
    /// Checks every invariant that traversal relies on: each leaf is reached exactly once (twice in a tree over one
    /// primitive), children come after parents, boxes contain what is below them, and the depth is bounded.
    ///
    /// # Errors
    /// The first violation, in words.
    pub fn validate(&self, bounds: &[Aabb]) -> Result<(), String> {
        let mut seen = vec![0u32; self.order.len()];
        let mut stack = vec![(0u32, 0u32, None::<Aabb>)];
        while let Some((index, depth, around)) = stack.pop() {
            let node = self.nodes.get(index as usize).ok_or(format!("no node {index}"))?;
            for (b, child) in node.bounds.iter().zip(node.children) {
                if around.is_some_and(|a| !a.contains(*b)) {
                    return Err(format!("node {index}: a child's box sticks out"));
                }
                match child {
                    Child::Inner(next) if next <= index => {
                        return Err(format!("node {index}: child {next} does not come after it"));
                    }
                    Child::Inner(next) => stack.push((next, depth + 1, Some(*b))),
                    Child::Leaf(leaf) => {
                        let primitive = *self.order.get(leaf as usize).ok_or(format!("no leaf {leaf}"))?;
                        let own = bounds.get(primitive as usize).ok_or(format!("no primitive {primitive}"))?;
                        if !b.contains(*own) {
                            return Err(format!("leaf {leaf}: its primitive sticks out"));
                        }
                        if depth + 1 > MAX_DEPTH {
                            return Err(format!("leaf {leaf}: at depth {}, the limit is {MAX_DEPTH}", depth + 1));
                        }
                        seen[leaf as usize] += 1;
                    }
                }
            }
        }
        let expected = if self.order.len() == 1 { 2 } else { 1 };
        if let Some(leaf) = seen.iter().position(|&n| n != expected) {
            return Err(format!("leaf {leaf} is reached {} times", seen[leaf]));
        }
        let mut primitives = self.order.clone();
        primitives.sort_unstable();
        if !primitives.iter().enumerate().all(|(i, &p)| i as u32 == p) || self.order.len() != bounds.len() {
            return Err("the leaves are not a permutation of the primitives".to_owned());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::accel::binning::PARALLEL_WITHIN;
    use glam::Vec3;

    use super::*;

    fn check(bounds: &[Aabb]) -> Tree {
        let tree = build(bounds).unwrap();
        tree.validate(bounds).unwrap();
        tree
    }

    fn point(x: f32, y: f32, z: f32) -> Aabb {
        Aabb::around([Vec3::new(x, y, z)])
    }

    #[test]
    fn degenerate_inputs_make_valid_trees() {
        assert!(build(&[]).is_none());
        check(&[point(1.0, 2.0, 3.0)]);
        check(&[point(1.0, 2.0, 3.0); 2]);
        check(&vec![point(1.0, 2.0, 3.0); 10_001]);
        check(&(0..5000).map(|i| point(i as f32, 0.0, 0.0)).collect::<Vec<_>>());
        // Every split peels one off: the depth bound must step in.
        let spiral: Vec<_> = (0..120).map(|i| point(2f32.powi(i - 60), 0.0, 0.0)).collect();
        check(&spiral);
        check(&[point(f32::MAX, 0.0, 0.0), point(-f32::MAX, 0.0, 0.0), point(0.0, 1e30, 0.0)]);
        check(&[Aabb { lo: Vec3::splat(-1e38), hi: Vec3::splat(1e38) }; 9]);
    }

    #[test]
    fn random_boxes_make_the_same_valid_tree_with_any_number_of_threads() {
        let mut random = crate::accel::random_numbers(1);
        let boxes: Vec<_> = (0..PARALLEL_WITHIN + 20_000)
            .map(|_| {
                let p = Vec3::new(random(), random(), random());
                Aabb { lo: p, hi: p + 0.01 * Vec3::new(random(), random(), random()) }
            })
            .collect();
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let many = rayon::ThreadPoolBuilder::new().num_threads(5).build().unwrap();
        assert!(alone.install(|| check(&boxes)) == many.install(|| build(&boxes).unwrap()));
    }
}
