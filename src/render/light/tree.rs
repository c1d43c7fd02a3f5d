//! A binary tree over lights: what is near each other and shines the same way is below the same node.
//!
//! Conty Estevez and Kulla, "Importance sampling of many lights with adaptive tree splitting" (HPG 2018).

use glam::DVec3;

use crate::render::light::emitter::{Cone, Light};

/// What a node stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Link {
    /// The number of its light.
    Light(u32),
    /// The second of two children, the first being the next node, and the end of what is below.
    Inner { second: u32, end: u32 },
}

/// A node: the lights below it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LightNode {
    lo: DVec3,
    hi: DVec3,
    /// Sum over its lights.
    pub strength: f64,
    /// Contains the directions around which its lights emit.
    pub cone: Cone,
    pub link: Link,
}

impl LightNode {
    fn of(light: &Light, number: u32) -> Self {
        let (lo, hi) = light.bounds();
        Self { lo, hi, strength: light.strength(), cone: light.cone(), link: Link::Light(number) }
    }

    fn union(&self, other: &Self) -> Self {
        Self {
            lo: self.lo.min(other.lo),
            hi: self.hi.max(other.hi),
            strength: self.strength + other.strength,
            cone: self.cone.union(other.cone),
            link: self.link,
        }
    }

    /// Of its box.
    pub fn center(&self) -> DVec3 {
        (self.lo + self.hi) / 2.0
    }

    /// Of its box.
    pub fn half_size(&self) -> DVec3 {
        (self.hi - self.lo) / 2.0
    }
}

/// Levels below the root in which splits follow the cost; below they halve, so that no leaf is deeper than 8 + 24.
const HALVE_BELOW: u32 = 8;

/// The tree, in depth-first order.
pub(crate) struct LightTree {
    pub nodes: Vec<LightNode>,
    /// Levels below the root.
    pub depth: u32,
}

impl LightTree {
    /// Builds the tree over lights, of which there is at least one.
    pub fn of(lights: &[Light]) -> Self {
        let mut leaves: Vec<_> = lights.iter().zip(0..).map(|(light, i)| LightNode::of(light, i)).collect();
        let mut tree = Self { nodes: Vec::with_capacity(2 * lights.len() - 1), depth: 0 };
        tree.add(&mut leaves, 0);
        tree
    }

    /// Adds the subtree over these leaves.
    fn add(&mut self, leaves: &mut [LightNode], depth: u32) {
        self.depth = self.depth.max(depth);
        let index = self.nodes.len();
        let rest = leaves[1..].iter();
        self.nodes.push(rest.fold(leaves[0], |node, leaf| node.union(leaf)));
        if leaves.len() == 1 {
            return;
        }
        let middle = arrange(leaves, depth);
        let (first, second) = leaves.split_at_mut(middle);
        self.add(first, depth + 1);
        let link = self.nodes.len() as u32;
        self.add(second, depth + 1);
        self.nodes[index].link = Link::Inner { second: link, end: self.nodes.len() as u32 };
    }
}

/// Sorts leaves along an axis and returns where to cut them.
fn arrange(leaves: &mut [LightNode], depth: u32) -> usize {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (lo, hi) = leaves.iter().fold(none, |(lo, hi), n| (lo.min(n.center()), hi.max(n.center())));
    let axis = (hi - lo).max_position();
    leaves.sort_by(|a, b| a.center()[axis].total_cmp(&b.center()[axis]));
    if depth >= HALVE_BELOW {
        return leaves.len() / 2;
    }
    let left = costs(leaves.iter());
    let right = costs(leaves.iter().rev());
    let n = leaves.len();
    (1..n)
        .min_by(|&a, &b| (left[a - 1] + right[n - a - 1]).total_cmp(&(left[b - 1] + right[n - b - 1])))
        .unwrap_or(n / 2)
}

/// Of the first, the first two, and so on: strength times size and spread of directions, what choosing by the node
/// alone cannot tell apart.
fn costs<'a>(leaves: impl Iterator<Item = &'a LightNode>) -> Vec<f64> {
    let mut sum: Option<LightNode> = None;
    let cost = |leaf: &LightNode| {
        let node = sum.as_ref().map_or(*leaf, |sum| sum.union(leaf));
        sum = Some(node);
        let d = node.hi - node.lo;
        let area = d.x * d.y + d.y * d.z + d.z * d.x;
        // The cone's solid angle, and the quarter sphere around its edge.
        let spread = 1.0 - node.cone.angle.cos() + 0.5 * node.cone.angle.sin();
        node.strength * area * spread.max(1e-3)
    };
    leaves.map(cost).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::render::light::emitter::LightShape;

    #[test]
    fn every_light_is_at_the_end_of_one_path() {
        for count in [1usize, 2, 3, 64, 1000] {
            let lights: Vec<_> = (0..count)
                .map(|i| {
                    let x = (i * 7919 % 1000) as f64;
                    let p = DVec3::new(x, (i * 104_729 % 1000) as f64, 0.0);
                    let shape = match i % 3 {
                        0 => LightShape::Point(p),
                        1 => LightShape::Triangle([p, p + DVec3::X, p + DVec3::Y]),
                        _ => LightShape::Sphere { center: p, radius: 0.5, inward: false },
                    };
                    Light::new(shape, [1.0 + x, 1.0, 0.5])
                })
                .collect();
            let tree = LightTree::of(&lights);
            assert_eq!(tree.nodes.len(), 2 * count - 1);
            assert!(tree.depth <= 31, "{count} lights: depth {}", tree.depth);
            let mut met = vec![0; count];
            let mut open = vec![(0u32, tree.nodes.len() as u32)];
            while let Some((node, expected_end)) = open.pop() {
                match tree.nodes[node as usize].link {
                    Link::Light(light) => {
                        assert_eq!(expected_end, node + 1);
                        met[light as usize] += 1;
                    }
                    Link::Inner { second, end } => {
                        assert_eq!(expected_end, end);
                        open.extend([(node + 1, second), (second, end)]);
                    }
                }
            }
            assert!(met.iter().all(|&n| n == 1), "{met:?}");
        }
    }

    #[test]
    fn lights_that_are_ever_farther_apart_make_no_deep_tree() {
        let light = |i: i32| {
            let at = DVec3::new(1.1f64.powi(i), 1.05f64.powi(i), 0.0);
            Light {
                shape: LightShape::Sphere { center: at, radius: 0.1, inward: false },
                radiance: [1.0; 3],
                primitive: 0,
                mean: 1.0,
            }
        };
        let lights: Vec<_> = (-300..700).map(light).collect();
        let tree = LightTree::of(&lights);
        // Each cut takes one light off, until lights are halved.
        let most = HALVE_BELOW + lights.len().next_power_of_two().ilog2();
        assert!(tree.depth > most / 2 && tree.depth <= most, "depth {}, at most {most}", tree.depth);
    }

    #[test]
    fn cones_contain_what_they_join() {
        let a = Cone { axis: DVec3::X, angle: 0.3 };
        let b = Cone { axis: DVec3::Y, angle: 0.1 };
        let c = a.union(b);
        for (axis, angle) in [(a.axis, a.angle), (b.axis, b.angle)] {
            assert!(c.axis.angle_between(axis) + angle <= c.angle + 1e-9);
        }
        assert!(a.union(Cone { axis: -DVec3::X, angle: 0.1 }).angle >= PI);
    }
}
