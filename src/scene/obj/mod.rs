//! Wavefront OBJ and MTL.
//!
//! OBJ is read here, by as many threads as pay: meshes of millions of triangles take longer to read than to build a
//! tree over. MTL is read by the `tobj` crate. Its messages name no line, and it stumbles over much that is legal but
//! rare (it panics at `Kd` with one number), hence each statement is checked first, and it is given those alone that the
//! renderer needs, in their plainest form.
//!
//! Source: Wavefront, *Advanced Visualizer Manual*, appendix B1 (Object Files) and the MTL format of 1995.

mod library;
mod mesh;
mod mtl;
mod parse;
mod polygon;
mod preview;
mod statement;

pub use mtl::{MtlMaterial, parse_mtl};
pub use parse::{Corner, Face, NONE, Obj, parse_obj};

pub(super) use mesh::{MaterialSource, MeshRequest, NormalsChoice};
pub(super) use preview::preview;
