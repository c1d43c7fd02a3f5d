//! TODO

pub(crate) mod dispatch;
