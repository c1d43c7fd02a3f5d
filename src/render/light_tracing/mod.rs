//! TODO

pub(crate) mod splats;
