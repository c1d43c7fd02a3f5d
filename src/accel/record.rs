//! The packed tree as the shaders read it: one 64-byte record for inner nodes and leaves alike.
//!
//! ```text
//! inner node   lo0 | child0,  hi0 | child1,  lo1 | -,  hi1 | -
//! triangle     v0 | surface,  v1 | attributes,  v2 | light,  normal | 1
//! sphere       centre | surface,  (radius, ±1/radius, -) | -,  - | light,  - | 2
//! ```
//! A child is the index of a record, with the sign bit set for a leaf. Integers are stored as float bits. Leaves
//! follow the inner nodes.

use glam::Vec3;
use rayon::prelude::*;

use super::aabb::Aabb;
use super::builder::{Child, Tree};

/// Sixteen floats: four texels.
pub type Record = [f32; 16];

/// A primitive that a leaf holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Primitive {
    /// A triangle; front is the side from which the vertices run counter-clockwise.
    Triangle {
        /// Corners.
        vertices: [Vec3; 3],
        /// Unit geometric normal, towards the front.
        normal: Vec3,
        /// Texel of the material.
        surface: u32,
        /// First of three texels with vertex normals, or −1.
        attributes: i32,
        /// Number of its light, or −1.
        light: i32,
    },
    /// A sphere.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius.
        radius: f32,
        /// The normal points to the centre.
        inward: bool,
        /// Texel of the material.
        surface: u32,
        /// Number of its light, or −1.
        light: i32,
    },
}

impl Primitive {
    /// The box around it, widened: a sphere's by the rounding of its corners, a triangle's by one unit in the last
    /// place, so that a ray within the plane of a face is inside of the box and not on its border.
    pub fn bounds(&self) -> Aabb {
        match *self {
            Self::Triangle { vertices, .. } => {
                let Aabb { lo, hi } = Aabb::around(vertices);
                // The last term is for coordinates of 0; the shader's reciprocals make 1e10 of it (safe_inverse).
                let ulp = |v: Vec3| v.abs() * f32::EPSILON + 1e-20;
                Aabb { lo: lo - ulp(lo), hi: hi + ulp(hi) }
            }
            Self::Sphere { center, radius, .. } => {
                let r = Vec3::splat(radius * (1.0 + 4.0 * f32::EPSILON)) + 2.0 * f32::EPSILON * center.abs();
                Aabb { lo: center - r, hi: center + r }
            }
        }
    }

    fn record(&self) -> Record {
        match *self {
            Self::Triangle { vertices: [a, b, c], normal: n, surface, attributes, light } => [
                a.x,
                a.y,
                a.z,
                f32::from_bits(surface), //
                b.x,
                b.y,
                b.z,
                f32::from_bits(attributes as u32), //
                c.x,
                c.y,
                c.z,
                f32::from_bits(light as u32), //
                n.x,
                n.y,
                n.z,
                1.0,
            ],
            Self::Sphere { center: c, radius, inward, surface, light } => {
                let curvature = if inward { -1.0 / radius } else { 1.0 / radius };
                [
                    c.x,
                    c.y,
                    c.z,
                    f32::from_bits(surface), //
                    radius,
                    curvature,
                    0.0,
                    0.0, //
                    0.0,
                    0.0,
                    0.0,
                    f32::from_bits(light as u32), //
                    0.0,
                    0.0,
                    0.0,
                    2.0,
                ]
            }
        }
    }
}

/// Packs a tree and its primitives: `nodes.len()` inner records, then one leaf record for each entry of `order`.
pub fn pack(tree: &Tree, primitives: &[Primitive]) -> Vec<Record> {
    let first_leaf = tree.nodes.len() as u32;
    let link = |child| match child {
        Child::Inner(node) => f32::from_bits(node),
        Child::Leaf(leaf) => f32::from_bits((first_leaf + leaf) | 0x8000_0000),
    };
    let inner = tree.nodes.par_iter().map(|node| {
        let [a, b] = node.bounds;
        [
            a.lo.x,
            a.lo.y,
            a.lo.z,
            link(node.children[0]), //
            a.hi.x,
            a.hi.y,
            a.hi.z,
            link(node.children[1]), //
            b.lo.x,
            b.lo.y,
            b.lo.z,
            0.0, //
            b.hi.x,
            b.hi.y,
            b.hi.z,
            0.0,
        ]
    });
    let leaves = tree.order.par_iter().map(|&p| primitives[p as usize].record());
    inner.chain(leaves).collect()
}
