//! Bounding volume hierarchies: boxes, construction, the packed form that shaders read, statistics.

mod aabb;
mod binning;
mod builder;
mod collapse;
mod copies;
mod leaf;
mod leaf_order;
mod morton;
mod primitive;
mod quantised;
mod record;
mod statistics;

pub use crate::accel::aabb::Aabb;
pub use crate::accel::builder::{Child, MAX_DEPTH, Node, Tree, build};
pub use crate::accel::collapse::WIDTH;
pub use crate::accel::copies::copies;
pub use crate::accel::leaf::{Leaf, leaves};
pub use crate::accel::primitive::Primitive;
pub use crate::accel::quantised::Quantised;
pub use crate::accel::record::{MAX_RECORDS, Packed, Passable, Texel, pack};
pub use crate::accel::statistics::BvhStatistics;

/// Numbers in [0, 1) for tests, the same each time (Numerical Recipes, 7.1).
#[cfg(test)]
pub(crate) fn random_numbers(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    }
}
