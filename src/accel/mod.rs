//! Bounding volume hierarchies: boxes, construction, the packed form that shaders read, statistics.

mod aabb;
mod builder;
mod collapse;
mod copies;
mod leaf;
mod morton;
mod primitive;
mod quantised;
mod record;
mod statistics;

pub use aabb::Aabb;
pub use builder::{Child, MAX_DEPTH, Node, Tree, build};
pub use collapse::WIDTH;
pub use copies::copies;
pub use leaf::{Leaf, leaves};
pub use primitive::Primitive;
pub use quantised::Quantised;
pub use record::{MAX_RECORDS, Packed, Texel, pack};
pub use statistics::TreeStatistics;

/// Numbers in [0, 1) for tests, the same each time (Numerical Recipes, 7.1).
#[cfg(test)]
pub(crate) fn random_numbers(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    }
}
