//! What a run of the suite found, as data.

use serde::{Deserialize, Serialize};

use crate::check::Fact;

/// Schema of the JSON form of [`Report`].
pub const SCHEMA: &str = "photolith-check-1";

/// What became of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Measured, and within the threshold.
    Pass,
    /// Measured, and beyond the threshold.
    Fail,
    /// Beyond the threshold, as declared for this driver.
    ExpectedFail,
    /// Declared to fail on this driver, but it passes: the declaration is out of date.
    UnexpectedPass,
    /// Could not be measured.
    Error,
    /// A validation layer reported something meanwhile.
    Validation,
    /// Took longer than allowed.
    Timeout,
    /// The device was lost.
    DeviceLost,
    /// Not begun, because the device was lost or hangs, or the run was interrupted.
    NotRun,
    /// The device lacks what the case asks for.
    NotSupported,
    /// Not begun, as declared for this driver.
    Skipped,
    /// Beyond the threshold now and then: declared so for this driver, or seen to pass when it was run again.
    Flake,
}

impl Verdict {
    /// Whether the suite may pass with it.
    pub fn is_good(self) -> bool {
        matches!(self, Self::Pass | Self::ExpectedFail | Self::NotSupported | Self::Skipped | Self::Flake)
    }

    /// Whether it tells nothing against the driver, nor for it: neither measured to the end nor failed.
    pub fn is_skip(self) -> bool {
        matches!(self, Self::ExpectedFail | Self::NotRun | Self::NotSupported | Self::Skipped | Self::Flake)
    }

    /// What people are told of how many cases have it, beside those that pass; none of a plain failure.
    pub fn counted_as(self) -> Option<&'static str> {
        match self {
            Self::ExpectedFail => Some("failed as declared"),
            Self::Flake => Some("flaky"),
            Self::NotSupported => Some("not supported"),
            Self::Skipped => Some("skipped as declared"),
            Self::NotRun => Some("not run"),
            _ => None,
        }
    }

    /// One or two words.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "FAIL",
            Self::ExpectedFail => "expected",
            Self::UnexpectedPass => "PASSES",
            Self::Error => "ERROR",
            Self::Validation => "VALIDATION",
            Self::Timeout => "TIMEOUT",
            Self::DeviceLost => "DEVICE LOST",
            Self::NotRun => "not run",
            Self::NotSupported => "unsupported",
            Self::Skipped => "skipped",
            Self::Flake => "flaky",
        }
    }
}

/// A case on a device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CaseReport {
    /// [`Case::name`](crate::check::Case::name).
    pub name: String,
    /// What was done.
    pub what: String,
    /// What it was compared with.
    pub oracle: String,
    /// What the number is.
    pub quantity: String,
    /// The largest that passes.
    pub threshold: f64,
    /// The number; `None` if there is none, or it is not finite.
    pub measured: Option<f64>,
    /// Sizes and circumstances.
    pub detail: String,
    /// Time it took.
    pub seconds: f64,
    /// What became of it.
    pub verdict: Verdict,
    /// Why, where it is not a plain pass.
    pub message: Option<String>,
}

/// The suite on one device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DeviceReport {
    /// Name of the device.
    pub device: String,
    /// Driver and its version.
    pub driver: String,
    /// Discrete, integrated, virtual or CPU.
    pub kind: String,
    /// Lanes of a subgroup (0 in reports of versions that did not tell).
    #[serde(default)]
    pub lanes: u32,
    /// Vulkan version.
    pub api_version: String,
    /// The host's processor: CPU drivers give other bits on other ones.
    pub host_cpu: String,
    /// Full sizes, else the quick ones.
    pub full: bool,
    /// Validation layers were on.
    pub validation: bool,
    /// What the driver's arithmetic does.
    pub facts: Vec<Fact>,
    /// All cases that were selected.
    pub cases: Vec<CaseReport>,
    /// When it began, in seconds since 1970 (0 in reports of versions that did not tell).
    #[serde(default)]
    pub started: u64,
    /// Seconds in all.
    pub seconds: f64,
}

impl DeviceReport {
    /// Whether every case is good.
    pub fn passes(&self) -> bool {
        self.cases.iter().all(|c| c.verdict.is_good())
    }

    /// Number of cases with a verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.cases.iter().filter(|c| c.verdict == verdict).count()
    }

    /// How many cases neither pass nor plainly fail, for people: a comma before each number.
    pub fn others(&self) -> String {
        let others = [Verdict::ExpectedFail, Verdict::Flake, Verdict::NotSupported, Verdict::Skipped, Verdict::NotRun];
        let counted = others.into_iter().filter_map(|verdict| {
            let count = self.count(verdict);
            verdict.counted_as().filter(|_| count > 0).map(|words| format!(", {count} {words}"))
        });
        counted.collect()
    }
}

/// The suite on one or more devices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`SCHEMA`].
    pub schema: String,
    /// Version of photolith.
    pub version: String,
    /// One for each device.
    pub devices: Vec<DeviceReport>,
}

impl Report {
    /// A report of this version.
    pub fn new(devices: Vec<DeviceReport>) -> Self {
        Self { schema: SCHEMA.to_owned(), version: env!("CARGO_PKG_VERSION").to_owned(), devices }
    }
}

/// Runs of the same driver on the same host at the same sizes, put together: of a case that was run twice the later run
/// counts.
pub(super) fn combined(reports: &[Report]) -> Vec<DeviceReport> {
    let mut all: Vec<DeviceReport> = Vec::new();
    for next in reports.iter().flat_map(|r| &r.devices) {
        let key = |d: &DeviceReport| (d.device.clone(), d.driver.clone(), d.host_cpu.clone(), d.full);
        let Some(known) = all.iter_mut().find(|known| key(known) == key(next)) else {
            all.push(next.clone());
            continue;
        };
        for case in &next.cases {
            match known.cases.iter_mut().find(|c| c.name == case.name) {
                Some(old) => *old = case.clone(),
                None => known.cases.push(case.clone()),
            }
        }
        known.seconds += next.seconds;
    }
    all
}
