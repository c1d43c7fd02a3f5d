//! Wavefront OBJ and MTL.
//!
//! Files are read as exporters write them: what is not used cannot refuse a file. OBJ is read by as many threads as pay: meshes of
//! millions of triangles take longer to read than to build a BVH over.
//!
//! Source: Wavefront, *Advanced Visualizer Manual*, appendix B1 (Object Files) and the MTL format of 1995.

mod library;
mod map;
mod material;
mod mesh;
mod model;
mod mtl;
mod names;
mod parse;
mod polygon;
mod statement;
mod surface;

pub use crate::scene::obj::model::{ASTRAY, Corner, Face, NONE, Obj};
pub use crate::scene::obj::parse::parse_obj;

pub(super) use crate::scene::obj::mesh::{MaterialSource, MeshRequest, NormalsChoice, VertexColors, load};
