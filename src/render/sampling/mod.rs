//! Where samples go (the sample map), and when there are enough (two halves and their noise).

pub(crate) mod allocation;
pub(crate) mod dual;
pub(crate) mod emitter_edges;
pub(crate) mod multiplier;
pub(crate) mod sample_map;
pub(crate) mod sample_map_decision;
pub(crate) mod stopping;
