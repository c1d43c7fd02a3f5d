//! Scene description, scene files, OBJ and MTL. No GPU types.

mod description;

pub use description::*;
