//! The accuracy suite: named cases, each measured on a Vulkan device against an oracle that shares no code with the
//! shaders (a closed form, or double precision on the CPU), with a threshold.
//!
//! [`cases()`] lists them, [`run`] runs them on a device and gives a [`DeviceReport`], which prints as a table, JSON,
//! JUnit XML or Markdown. Failures of a driver that are known are declared in [`Expectations`].

mod case;
mod cases;
mod error;
mod expectations;
mod facts;
mod junit;
mod lab;
mod markdown;
mod mutations;
pub(crate) mod probe;
mod report;
mod rng;
mod runner;
pub(crate) mod scenes;
mod statistics;

pub use case::{Case, Measured};
pub use cases::cases;
pub use error::CheckError;
pub use expectations::{Expectation, Expectations, ExpectationsError};
pub use facts::{Fact, facts};
pub use junit::junit;
pub use lab::Lab;
pub use markdown::markdown;
pub use mutations::held_by;
pub use report::{CaseReport, DeviceReport, Report, SCHEMA, Verdict};
pub use runner::{RunOptions, provoke_validation, run};
