//! Known failures of drivers, declared as data.

use std::io;
use std::path::Path;

use serde::Deserialize;

use crate::check::cases;
use crate::files::read_regular;
use crate::scene::{Location, one_line};

/// Failures that are declared: they count as expected, and their passing as a fault.
///
/// ```toml
/// [[expected]]
/// driver = "Mesa 22.3"                # part of the driver's text
/// case = "triangles/edges"
/// reason = "issue or explanation"
/// ```
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectations {
    #[serde(default)]
    expected: Vec<Expectation>,
}

/// A declared failure.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// Part of the driver's text, in any case.
    pub driver: String,
    /// The case.
    pub case: String,
    /// Why.
    pub reason: String,
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
    #[error("{file}: there is no case '{case}'; `photolith check --list` names them")]
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
            if !cases().any(|c| c.name == e.case) {
                return Err(ExpectationsError::NoSuchCase { file, case: e.case.clone() });
            }
            for (field, text) in [("driver", &e.driver), ("reason", &e.reason)] {
                if text.trim().is_empty() {
                    return Err(ExpectationsError::Empty { file, case: e.case.clone(), field });
                }
            }
        }
        Ok(all)
    }

    /// The declaration of a case on a driver.
    pub fn of(&self, driver: &str, case: &str) -> Option<&Expectation> {
        let driver = driver.to_lowercase();
        self.expected.iter().find(|e| e.case == case && driver.contains(&e.driver.to_lowercase()))
    }
}
