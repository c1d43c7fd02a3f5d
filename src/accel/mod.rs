//! Bounding volume hierarchies: boxes, construction, the packed form that shaders read, statistics.

mod aabb;
mod builder;
mod record;
mod statistics;

pub use aabb::Aabb;
pub use builder::{Child, MAX_DEPTH, Node, Tree, build};
pub use record::{Primitive, Record, pack};
pub use statistics::TreeStatistics;
