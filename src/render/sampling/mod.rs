//! TODO

pub(crate) mod dual;
pub(crate) mod sample_map;
pub(crate) mod sobol;
pub(crate) mod stopping;
