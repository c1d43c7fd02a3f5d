//! TODO

pub(crate) mod dispatch;
pub(crate) mod exclusions;
