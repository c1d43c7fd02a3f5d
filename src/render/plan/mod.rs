//! Cutting a rendering into work: what is prepared on the host, and how it is launched.

pub(crate) mod dispatch;
pub(crate) mod distribution;
pub(crate) mod exclusions;
pub(crate) mod launch;
pub(crate) mod pace;
pub(crate) mod prepared;
pub(crate) mod scheduler;
pub(crate) mod split;
