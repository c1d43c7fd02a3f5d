//! From two children a node to four: which nodes of a binary tree stay.
//!
//! Ylitie, Karras and Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs" (HPG 2017),
//! section 3.1: of all ways to leave nodes out, dynamic programming finds the one in which a random ray meets the
//! fewest records. A node costs its area, since every record that a ray reads costs the same.

use crate::accel::aabb::Aabb;
use crate::accel::builder::{Child, Tree};

/// Children of a node, at most.
pub const WIDTH: usize = 4;

/// Subtrees with more nodes than this are worked on by a task of their own.
const PARALLEL_ABOVE: usize = 4096;

/// Which nodes stay.
pub(super) struct Collapse<'a> {
    tree: &'a Tree,
    choices: Vec<Choice>,
}

/// What becomes of the subtree below a binary node.
#[derive(Clone, Copy, Default)]
struct Choice {
    /// Of up to 2, 3 and 4 subtrees that may take its place, how many are left of it.
    left: [u8; WIDTH - 1],
    /// Whether one subtree does better than up to 2, and up to 2 better than up to 3.
    fewer: [bool; 2],
    /// Records of it, if it stays itself: nodes that stay, and leaves.
    records: u32,
}

/// What the best one, up to two, and up to three subtrees in place of one cost, and how many records they have.
#[derive(Clone, Copy)]
struct Forest {
    cost: [f32; WIDTH - 1],
    records: [u32; WIDTH - 1],
}

/// A child with its box.
pub(super) type Boxed = (Aabb, Child);

impl<'a> Collapse<'a> {
    pub fn of(tree: &'a Tree) -> Self {
        let mut choices = vec![Choice::default(); tree.nodes.len()];
        plan(tree, 0, &mut choices);
        if tree.order.len() == 1 {
            // The root holds its only leaf twice; `children` returns it once.
            choices[0].records = 2;
        }
        Self { tree, choices }
    }

    /// Records of the subtree below a node that stays, its own among them: nodes that stay, and leaves.
    pub fn records(&self, node: u32) -> usize {
        self.choices[node as usize].records as usize
    }

    /// The one to four children of a node that stays, in the order of their leaves.
    pub fn children(&self, node: u32) -> Vec<Boxed> {
        let mut children = Vec::with_capacity(WIDTH);
        self.divide(node, WIDTH, &mut children);
        // The root of a tree of one leaf holds it twice.
        children.dedup();
        children
    }

    /// Adds `count` or fewer subtrees that take the place of the one below `node`, at least two.
    fn divide(&self, node: u32, count: usize, children: &mut Vec<Boxed>) {
        let binary = &self.tree.nodes[node as usize];
        let left = usize::from(self.choices[node as usize].left[count - 2]);
        for (side, count) in [left, count - left].into_iter().enumerate() {
            let (bounds, child) = (binary.bounds[side], binary.children[side]);
            match child {
                Child::Inner(inner) => match self.at_most(inner, count) {
                    1 => children.push((bounds, child)),
                    count => self.divide(inner, count, children),
                },
                Child::Leaf(_) => children.push((bounds, child)),
            }
        }
    }

    /// With how many subtrees in the place of the one below `node` to do, of `count` that are allowed.
    fn at_most(&self, node: u32, count: usize) -> usize {
        let fewer = self.choices[node as usize].fewer;
        (2..=count).rev().find(|&n| !fewer[n - 2]).unwrap_or(1)
    }
}

/// Chooses for the subtree below `node`, whose choices are `choices`: nodes are in depth-first order.
fn plan(tree: &Tree, node: u32, choices: &mut [Choice]) -> Forest {
    let binary = &tree.nodes[node as usize];
    let (own, rest) = choices.split_at_mut(1);
    let first = node + 1;
    let second = match binary.children[1] {
        Child::Inner(second) => second,
        Child::Leaf(_) => first + rest.len() as u32,
    };
    let parallel = rest.len() > PARALLEL_ABOVE;
    let (left, right) = rest.split_at_mut((second - first) as usize);
    let forest = |side: usize, choices: &mut [Choice]| match binary.children[side] {
        Child::Inner(inner) => plan(tree, inner, choices),
        Child::Leaf(_) => Forest { cost: [binary.bounds[side].half_area(); WIDTH - 1], records: [1; WIDTH - 1] },
    };
    let [left, right] = if parallel {
        rayon::join(|| forest(0, left), || forest(1, right)).into()
    } else {
        [forest(0, left), forest(1, right)]
    };
    let choice = &mut own[0];
    // Of 2, 3 and 4 subtrees.
    let mut divided = [(f32::INFINITY, 0); WIDTH - 1];
    for (i, best) in divided.iter_mut().enumerate() {
        for l in 0..=i {
            let cost = left.cost[l] + right.cost[i - l];
            if cost < best.0 || l == 0 {
                *best = (cost, left.records[l] + right.records[i - l]);
                choice.left[i] = l as u8 + 1;
            }
        }
    }
    let [two, three, four] = divided;
    let area = binary.bounds[0].union(binary.bounds[1]).half_area();
    let one = (area + four.0, 1 + four.1);
    choice.records = one.1;
    choice.fewer[0] = one.0 <= two.0;
    let up_to_two = if choice.fewer[0] { one } else { two };
    choice.fewer[1] = up_to_two.0 <= three.0;
    let up_to_three = if choice.fewer[1] { up_to_two } else { three };
    let forests = [one, up_to_two, up_to_three];
    Forest { cost: forests.map(|f| f.0), records: forests.map(|f| f.1) }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::accel::builder::build;

    /// The least areas of what may stand for a subtree: up to one, two, three and four nodes or leaves, with all that is below.
    fn least(tree: &Tree, bounds: Aabb, child: Child) -> [f32; WIDTH] {
        let own = bounds.half_area();
        let Child::Inner(node) = child else { return [own; WIDTH] };
        let node = &tree.nodes[node as usize];
        let [a, b] = [0, 1].map(|side| least(tree, node.bounds[side], node.children[side]));
        let divided = |count: usize| (1..count).map(|l| a[l - 1] + b[count - l - 1]).fold(f32::INFINITY, f32::min);
        let one = own + (2..=WIDTH).map(divided).fold(f32::INFINITY, f32::min);
        [1, 2, 3, 4].map(|most| (2..=most).map(divided).fold(one, f32::min))
    }

    /// The areas of all that stays below a node.
    fn areas(collapse: &Collapse, node: u32) -> f32 {
        let below = |(bounds, child): &Boxed| {
            bounds.half_area() + if let Child::Inner(inner) = *child { areas(collapse, inner) } else { 0.0 }
        };
        collapse.children(node).iter().map(below).sum()
    }

    #[test]
    fn rays_meet_the_fewest_records() {
        let mut random = crate::accel::random_numbers(23);
        for count in 2..60 {
            let mut corner = |size: f32| size * Vec3::new(random(), random(), random());
            let boxes: Vec<_> = (0..count).map(|_| corner(1.0)).collect();
            let boxes: Vec<_> = boxes.into_iter().map(|lo| Aabb { lo, hi: lo + corner(0.3) }).collect();
            let tree = build(&boxes).unwrap();
            let whole = tree.nodes[0].bounds[0].union(tree.nodes[0].bounds[1]);
            let expected = least(&tree, whole, Child::Inner(0))[0] - whole.half_area();
            let found = areas(&Collapse::of(&tree), 0);
            assert!((found - expected).abs() <= 1e-5 * expected, "{count} leaves: {found}, least {expected}");
        }
    }
}
