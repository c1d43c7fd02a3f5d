//! Bounding volume hierarchies: boxes, construction, the packed form that shaders read, statistics.

mod aabb;
mod builder;
mod collapse;
mod quantised;
mod record;
mod statistics;

pub use aabb::Aabb;
pub use builder::{Child, MAX_DEPTH, Node, Tree, build};
pub use quantised::Quantised;
pub use record::{MAX_RECORDS, Packed, Primitive, Texel, pack};
pub use statistics::TreeStatistics;
