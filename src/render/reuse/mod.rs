//! Paths that serve several pixels (shaders/lib/reuse.glsl): where that is tried, the pilot pass that tells whether it pays, and what
//! is decided by it.

pub(crate) mod decision;
pub(crate) mod pilot;
pub(crate) mod pilot_statistics;
pub(crate) mod policy;
