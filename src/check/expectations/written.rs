//! What a run has found, as declarations for the next.

use std::fmt::Write;

use crate::check::expectations::version::version_of;
use crate::check::report::{CaseReport, DeviceReport, Report, Verdict};

/// A file of declarations by which the same run would pass: each case that does not pass is declared for the very driver, version and
/// number of lanes.
pub fn written_expectations(report: &Report) -> String {
    let mut out = String::from("# Written by `photolith check --write-expectations`.\n");
    for device in &report.devices {
        for case in &device.cases {
            if let Some(kind) = kind_of(case.verdict) {
                push(&mut out, device, case, kind);
            }
        }
    }
    out
}

/// What is to be declared of a case.
fn kind_of(verdict: Verdict) -> Option<&'static str> {
    match verdict {
        Verdict::Fail | Verdict::ExpectedFail | Verdict::Error => Some("fail"),
        Verdict::Timeout | Verdict::DeviceLost | Verdict::Skipped => Some("skip"),
        Verdict::Flake => Some("flake"),
        // A message of a validation layer is excused by nothing.
        Verdict::Pass | Verdict::UnexpectedPass | Verdict::Validation | Verdict::NotRun | Verdict::NotSupported => None,
    }
}

fn push(out: &mut String, device: &DeviceReport, case: &CaseReport, kind: &str) {
    let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
    // The name of the driver without its version, which stands by itself.
    let version = version_of(&device.driver).map(|v| v.iter().map(u32::to_string).collect::<Vec<_>>().join("."));
    let driver = match &version {
        Some(version) => device.driver.split(version.as_str()).next().unwrap_or_default().trim(),
        None => device.driver.as_str(),
    };
    let reason = match (&case.message, case.measured) {
        (Some(message), _) => message.clone(),
        (None, Some(measured)) => format!("{} {measured:e}, allowed {:e}", case.quantity, case.threshold),
        (None, None) => case.verdict.word().to_owned(),
    };
    // Writing to a String cannot fail.
    let _ = write!(out, "\n[[expected]]\nkind = \"{kind}\"\n");
    if !driver.is_empty() {
        let _ = writeln!(out, "driver = {}", quoted(driver));
    }
    if let Some(version) = version {
        let _ = writeln!(out, "version = \"={version}\"");
    }
    if device.lanes > 0 {
        let _ = writeln!(out, "lanes = {}", device.lanes);
    }
    let _ = writeln!(out, "case = {}\nreason = {}", quoted(&case.name), quoted(&reason));
}
