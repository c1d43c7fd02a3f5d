//! Measures run time against error, and cost against size.
//!
//! - [`convergence`]: seeds × sample counts × configurations, interleaved, against a [`Reference`] whose own noise is
//!   known, subtracted, and never undercut.
//! - [`growth`]: scenes made here ([`generate`]), larger from row to row.
//! - [`rays`]: rays a second of each kind, without shading.
//!
//! Results are plain data ([`report`]) that becomes a table, CSV, Markdown or JSON, and a [`plot`].

mod configuration;
pub mod convergence;
mod error;
mod format;
pub mod generate;
pub mod growth;
mod machine;
pub mod plot;
pub mod rays;
mod reference;
pub mod report;
pub mod statistics;
mod summary;
mod watched;

pub use crate::bench::configuration::{Configuration, Vary, combine};
pub use crate::bench::error::BenchError;
pub use crate::bench::machine::Machine;
pub use crate::bench::reference::{Origin, Reference};
pub use crate::bench::summary::{ConfigurationSummary, Row, TimeToTarget};
