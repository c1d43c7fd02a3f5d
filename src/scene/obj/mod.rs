//! Wavefront OBJ and MTL.
//!
//! The `tobj` crate reads both. Its messages name no line, and it stumbles over much that is legal but rare (it panics
//! at `Kd` with one number, divides by weights, takes lines of three vertices for faces, knows no continuation lines),
//! hence each statement is checked first, and it is given those alone that the renderer needs, in their plainest form.
//!
//! Source: Wavefront, *Advanced Visualizer Manual*, appendix B1 (Object Files) and the MTL format of 1995.

mod library;
mod mesh;
mod mtl;
mod parse;
mod preview;
mod statement;

pub use mtl::{MtlMaterial, parse_mtl};
pub use parse::{Face, Obj, parse_obj};

pub(super) use mesh::{MaterialSource, MeshRequest, NormalsChoice};
pub(super) use preview::preview;
