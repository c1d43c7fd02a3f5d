//! Wavefront OBJ and MTL.
//!
//! Read by this module itself and not by a library, because a message has to name the line, because exporters write
//! much that is legal but rare (`Kd` with one number, lines of three vertices, statements over several lines), and
//! because area-weighted normals need the file's own vertices, before they are split by material. The tests compare
//! the triangles with those of the `tobj` crate.
//!
//! Source: Wavefront, *Advanced Visualizer Manual*, appendix B1 (Object Files) and the MTL format of 1995.

mod library;
mod mesh;
mod mtl;
mod parse;
mod preview;
mod statement;

pub use mtl::{MtlMaterial, parse_mtl};
pub use parse::{Corner, Face, Obj, parse_obj};

pub(super) use mesh::{MaterialSource, MeshRequest, NormalsChoice};
pub(super) use preview::preview;
