//! What is known of drivers, declared as data: cases that fail, that must not be run, that fail now and then.

mod built_in;
mod pattern;
mod version;
mod written;

use std::io;
use std::path::Path;

use serde::Deserialize;

use crate::check::cases;
use crate::files::read_regular;
use crate::gpu::DeviceInfo;
use crate::scene::{Location, one_line};

pub use crate::check::expectations::version::VersionRange;
pub use crate::check::expectations::written::written_expectations;

/// Declarations about cases on drivers.
///
/// ```toml
/// [[expected]]
/// kind = "fail"                       # or "skip", "flake"; "fail" by default
/// driver = "llvmpipe"                 # part of the driver's text; any driver by default
/// version = ">=24.1, <25.1"           # of the driver; any by default
/// lanes = 4                           # of a subgroup; any number by default
/// case = "query/*"                    # * stands for any characters, ? for one
/// reason = "issue or explanation"
/// ```
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectations {
    #[serde(default)]
    expected: Vec<Expectation>,
}

/// What is declared of a case.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// It fails, or cannot be measured; that it passes is a fault of the declaration.
    #[default]
    Fail,
    /// It must not be run: it hangs, or takes the program with it.
    Skip,
    /// It fails now and then.
    Flake,
}

/// A declaration.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// What is declared.
    #[serde(default)]
    pub kind: Kind,
    /// Part of the driver's text, in any case.
    pub driver: Option<String>,
    /// Versions of the driver.
    pub version: Option<VersionRange>,
    /// Lanes of a subgroup.
    pub lanes: Option<u32>,
    /// The case, or several by wildcards.
    pub case: String,
    /// Why.
    pub reason: String,
}

impl Expectation {
    fn is_for(&self, device: &DeviceInfo, case: &str) -> bool {
        let of_driver = |part: &String| device.driver.to_lowercase().contains(&part.to_lowercase());
        let of_version =
            |range: &VersionRange| version::version_of(&device.driver).is_some_and(|version| range.contains(&version));
        self.driver.as_ref().is_none_or(of_driver)
            && self.version.as_ref().is_none_or(of_version)
            && self.lanes.is_none_or(|lanes| lanes == device.subgroup_size)
            && pattern::matches(&self.case, case)
    }
}

/// What is wrong with an expectation file.
#[derive(Debug, thiserror::Error)]
pub enum ExpectationsError {
    /// The file cannot be read.
    #[error("{file} cannot be read: {reason}")]
    Read {
        /// The file.
        file: String,
        /// The system's word.
        reason: std::io::Error,
    },
    /// It is not what it should be.
    #[error("{at}: {problem}")]
    Syntax {
        /// Where.
        at: Location,
        /// What.
        problem: String,
    },
    /// It declares a case that does not exist.
    #[error("{file}: there is no case '{case}'; `photolith check --full --list` names them")]
    NoSuchCase {
        /// The file.
        file: String,
        /// The name.
        case: String,
    },
    /// A field that must say something is empty.
    #[error("{file}: the declaration of '{case}' has an empty {field}")]
    Empty {
        /// The file.
        file: String,
        /// The case.
        case: String,
        /// The field.
        field: &'static str,
    },
}

impl Expectations {
    /// Reads a file.
    ///
    /// # Errors
    /// See [`ExpectationsError`].
    pub fn load(path: &Path) -> Result<Self, ExpectationsError> {
        let file = path.display().to_string();
        let text = read_regular(path)
            .and_then(|bytes| {
                String::from_utf8(bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
            })
            .map_err(|reason| ExpectationsError::Read { file: file.clone(), reason })?;
        Self::parse(&text, &file)
    }

    /// Reads a text; `file` is for messages.
    ///
    /// # Errors
    /// See [`ExpectationsError`].
    pub fn parse(text: &str, file: &str) -> Result<Self, ExpectationsError> {
        let file = file.to_owned();
        let all: Self = toml::from_str(text).map_err(|error| ExpectationsError::Syntax {
            at: Location::of_byte(&file, text, error.span().map_or(0, |span| span.start)),
            problem: one_line(error.message()),
        })?;
        for e in &all.expected {
            if !cases().any(|c| pattern::matches(&e.case, c.name)) {
                return Err(ExpectationsError::NoSuchCase { file, case: e.case.clone() });
            }
            for (field, text) in [("driver", e.driver.as_ref()), ("reason", Some(&e.reason))] {
                if text.is_some_and(|text| text.trim().is_empty()) {
                    return Err(ExpectationsError::Empty { file, case: e.case.clone(), field });
                }
            }
        }
        Ok(all)
    }

    /// These, and others for what these do not declare.
    pub fn or(mut self, others: Self) -> Self {
        self.expected.extend(others.expected);
        self
    }

    /// The first declaration for a case on a device.
    pub fn of(&self, device: &DeviceInfo, case: &str) -> Option<&Expectation> {
        self.expected.iter().find(|e| e.is_for(device, case))
    }
}
