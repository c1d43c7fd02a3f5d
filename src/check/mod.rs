//! The accuracy suite: named cases, each measured on a Vulkan device against an oracle that shares no code with the
//! shaders (a closed form, or double precision on the CPU), with a threshold.
//!
//! [`cases()`] lists them, [`run`] runs them on a device and gives a [`DeviceReport`], which prints as a table, JSON,
//! JUnit XML or Markdown. Failures of a driver that are known are declared in [`Expectations`].

mod bundle;
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

pub use crate::check::bundle::Evidence;
pub use crate::check::case::{Case, Measured};
pub use crate::check::cases::cases;
pub use crate::check::error::CheckError;
pub use crate::check::expectations::{
    Expectation, Expectations, ExpectationsError, Kind, VersionRange, written_expectations,
};
pub use crate::check::facts::{Fact, facts};
pub use crate::check::junit::junit;
pub use crate::check::lab::Lab;
pub use crate::check::markdown::markdown;
pub use crate::check::mutations::held_by;
pub use crate::check::report::{CaseReport, DeviceReport, Report, SCHEMA, Verdict};
pub use crate::check::runner::{RunOptions, provoke_validation, run};
