//! TODO

pub(crate) mod screened_poisson;
