//! Binned SAH construction of a binary bounding volume hierarchy with one box per leaf (of what it holds: see leaf.rs).
//!
//! Wald, "On fast construction of SAH-based bounding volume hierarchies" (2007). A subtree over n primitives has
//! n − 1 inner nodes, so that every subtree knows its place in the arrays before it is built, and halves are built
//! in parallel into disjoint slices: the result does not depend on the number of threads.

use glam::Vec4;
use rayon::prelude::*;

use crate::accel::aabb::Aabb;

/// The deepest leaf that [`build`] makes; the shader's stack holds one entry a level.
pub const MAX_DEPTH: u32 = 62;

/// Subtrees larger than this are built by a task of their own.
const PARALLEL_ABOVE: usize = 4096;
/// Above this many primitives, the work on one node is shared too.
const PARALLEL_WITHIN: usize = 1 << 17;
const MAX_BINS: usize = 32;

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

/// Bits of a small normal float. Indices alone would be subnormal floats, with which arithmetic is a hundred times
/// slower on most processors, even where nobody looks at the result.
const INDEX_BASE: u32 = 0x2000_0000;

/// A primitive with its box. Four floats a corner, so that a corner is one SIMD register.
#[derive(Clone, Copy)]
struct Reference {
    /// Lowest corner.
    lo: Vec4,
    /// Highest corner; w holds the primitive's index, as the bits of a float.
    hi: Vec4,
}

impl Reference {
    fn new(bounds: Aabb, primitive: u32) -> Self {
        Self { lo: bounds.lo.extend(0.0), hi: bounds.hi.extend(f32::from_bits(INDEX_BASE + primitive)) }
    }

    fn primitive(&self) -> u32 {
        self.hi.w.to_bits() - INDEX_BASE
    }

    fn centroid(&self) -> Vec4 {
        0.5 * (self.lo + self.hi)
    }
}

/// A box that grows; w means nothing.
#[derive(Clone, Copy)]
struct Growing {
    lo: Vec4,
    hi: Vec4,
}

impl Growing {
    const EMPTY: Self = Self { lo: Vec4::INFINITY, hi: Vec4::NEG_INFINITY };

    fn with(self, r: &Reference) -> Self {
        Self { lo: self.lo.min(r.lo), hi: self.hi.max(r.hi) }
    }

    fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    fn extended(self, p: Vec4) -> Self {
        Self { lo: self.lo.min(p), hi: self.hi.max(p) }
    }

    fn aabb(self) -> Aabb {
        Aabb { lo: self.lo.truncate(), hi: self.hi.truncate() }
    }

    fn half_area(self) -> f32 {
        self.aabb().half_area()
    }
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

/// Bounds of primitives and of their centroids.
#[derive(Clone, Copy)]
struct Extent {
    bounds: Growing,
    centroids: Growing,
}

impl Extent {
    const EMPTY: Self = Self { bounds: Growing::EMPTY, centroids: Growing::EMPTY };

    fn of(references: &[Reference]) -> Self {
        if references.len() > PARALLEL_WITHIN {
            let (left, right) = references.split_at(references.len() / 2);
            let (left, right) = rayon::join(|| Self::of(left), || Self::of(right));
            return left.union(right);
        }
        references.iter().fold(Self::EMPTY, |e, r| e.with(r))
    }

    fn with(self, r: &Reference) -> Self {
        Self { bounds: self.bounds.with(r), centroids: self.centroids.extended(r.centroid()) }
    }

    fn union(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), centroids: self.centroids.union(other.centroids) }
    }
}

/// Where a subtree's nodes and leaves go.
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

#[derive(Clone, Copy)]
struct Split {
    axis: usize,
    /// Bins below this go to the first part.
    bin: usize,
    binning: Binning,
}

/// Maps centroids to bins along each axis.
#[derive(Clone, Copy)]
struct Binning {
    lo: Vec4,
    scale: Vec4,
    last: Vec4,
    count: usize,
}

impl Binning {
    fn new(centroids: Growing, primitives: usize) -> Self {
        let count = (4 + primitives / 2).min(MAX_BINS);
        let size = centroids.hi - centroids.lo;
        // A flat axis gets scale 0: all in bin 0. The margin keeps the last centroid in the last bin.
        let per_axis = |s: f32| if s > 0.0 { (count as f32 * (1.0 - 1e-6) / s).min(f32::MAX) } else { 0.0 };
        let scale = Vec4::new(per_axis(size.x), per_axis(size.y), per_axis(size.z), 0.0);
        Self { lo: centroids.lo, scale, last: Vec4::splat(count as f32 - 0.5), count }
    }

    /// A number whose lowest bits are the bin, for each axis.
    fn rounded(&self, r: &Reference) -> Vec4 {
        // In range even where the scale overflowed: `max` and `min` drop NaN.
        let x = ((r.centroid() - self.lo) * self.scale).max(Vec4::splat(0.5)).min(self.last);
        x + ROUNDING
    }

    fn bins(&self, r: &Reference) -> [usize; 3] {
        let x = self.rounded(r);
        [x.x, x.y, x.z].map(bin_of)
    }

    fn bin(&self, r: &Reference, axis: usize) -> usize {
        bin_of(self.rounded(r)[axis])
    }
}

/// Added to a small number from a half on, makes a sum whose lowest bits are that number without its fraction (or one less, where
/// there is none): three conversions to integers, with all that is to be looked after there, took a third of the time.
const ROUNDING: f32 = (1 << 23) as f32 - 0.5;

fn bin_of(rounded: f32) -> usize {
    rounded.to_bits() as usize % MAX_BINS
}

/// For each axis and bin, the box of its primitives and their number. Kept from node to node: to clear all of it would
/// cost more than a small node has to do.
struct Bins([[(Growing, u32); MAX_BINS]; 3]);

impl Bins {
    fn new() -> Box<Self> {
        Box::new(Self([[(Growing::EMPTY, 0); MAX_BINS]; 3]))
    }

    fn fill(&mut self, references: &[Reference], binning: &Binning) {
        for row in &mut self.0 {
            row[..binning.count].fill((Growing::EMPTY, 0));
        }
        if references.len() > PARALLEL_WITHIN {
            let (left, right) = references.split_at(references.len() / 2);
            let mut other = Self::new();
            rayon::join(|| self.fill(left, binning), || other.fill(right, binning));
            for (a, b) in self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()) {
                *a = (a.0.union(b.0), a.1 + b.1);
            }
            return;
        }
        for r in references {
            for (row, b) in self.0.iter_mut().zip(binning.bins(r)) {
                row[b].0 = row[b].0.with(r);
                row[b].1 += 1;
            }
        }
    }
}

/// The split of least SAH cost among all bin borders of all axes; `None` if all centroids share a bin.
fn best_split(references: &[Reference], extent: Extent, bins: &mut Bins) -> Option<Split> {
    let binning = Binning::new(extent.centroids, references.len());
    bins.fill(references, &binning);
    let mut best: Option<(f32, Split)> = None;
    for (axis, row) in bins.0.iter().enumerate() {
        if binning.scale[axis] == 0.0 {
            continue;
        }
        // cost_right[i]: of bins i.. together
        let mut cost_right = [0.0f32; MAX_BINS];
        let mut part = (Growing::EMPTY, 0u32);
        for i in (1..binning.count).rev() {
            part = (part.0.union(row[i].0), part.1 + row[i].1);
            cost_right[i] = if part.1 == 0 { f32::INFINITY } else { part.0.half_area() * part.1 as f32 };
        }
        let mut part = (Growing::EMPTY, 0u32);
        for i in 1..binning.count {
            part = (part.0.union(row[i - 1].0), part.1 + row[i - 1].1);
            if part.1 == 0 {
                continue;
            }
            let cost = part.0.half_area() * part.1 as f32 + cost_right[i];
            if cost.is_finite() && best.is_none_or(|(c, _)| cost < c) {
                best = Some((cost, Split { axis, bin: i, binning }));
            }
        }
    }
    best.map(|(_, split)| split)
}

/// Moves the references of the first part to the front.
fn partition(references: &mut [Reference], split: Split) -> (usize, [Extent; 2]) {
    let mut extents = [Extent::EMPTY; 2];
    let (mut i, mut j) = (0, references.len());
    while i < j {
        if split.binning.bin(&references[i], split.axis) < split.bin {
            extents[0] = extents[0].with(&references[i]);
            i += 1;
        } else {
            j -= 1;
            extents[1] = extents[1].with(&references[i]);
            references.swap(i, j);
        }
    }
    (i, extents)
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
