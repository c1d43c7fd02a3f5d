//! What a case is.

use crate::check::{CheckError, Lab};

/// One claim about accuracy, and how it is measured.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// `topic/claim`.
    pub name: &'static str,
    /// What is done.
    pub what: &'static str,
    /// What it is compared with.
    pub oracle: &'static str,
    /// What the measured number is.
    pub quantity: &'static str,
    /// The largest number that passes.
    pub threshold: f64,
    /// Runs only where the full size is asked for.
    pub full_only: bool,
    pub(super) measure: fn(&Lab) -> Result<Measured, CheckError>,
}

/// A measured number.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// To be held against [`Case::threshold`]; NaN never passes.
    pub value: f64,
    /// Sizes and circumstances, for people.
    pub detail: String,
}

impl Measured {
    /// A number with a remark.
    pub fn new(value: f64, detail: impl Into<String>) -> Self {
        Self { value, detail: detail.into() }
    }
}

impl Case {
    /// Measures on the device of `lab`.
    ///
    /// # Errors
    /// The device or the renderer fails.
    pub fn measure(&self, lab: &Lab) -> Result<Measured, CheckError> {
        (self.measure)(lab)
    }

    /// Whether a measured number passes.
    pub fn passes(&self, measured: &Measured) -> bool {
        measured.value <= self.threshold
    }
}
