//! From the text of a scene file to its tables.

use std::ops::Range;

use serde::Deserialize;
use toml::de::{DeTable, DeValue, Deserializer};

use super::error::{Location, SceneError};
use super::format::{SceneTable, VERSION};
use super::locate::{context_of, context_of_syntax};

/// Parts that a scene has one of, each a table.
const SINGLE: [&str; 4] = ["camera", "film", "integrator", "background"];

/// Parts that a scene can have several of, each a table in an array.
const LISTS: [&str; 4] = ["material", "sphere", "mesh", "light"];

/// Reads the tables. `file` is the name for messages.
pub(super) fn parse(text: &str, file: &str) -> Result<SceneTable, SceneError> {
    let locate = |span: Option<&Range<usize>>| match span {
        Some(span) => Location::of_byte(file, text, span.start),
        None => Location::file(file),
    };
    let document = DeTable::parse(text).map_err(|error| {
        let context = error.span().map_or_else(String::new, |span| context_of_syntax(text, &span));
        SceneError::Format { at: locate(error.span().as_ref()), context, message: one_line(error.message()) }
    })?;
    if document.get_ref().iter().all(|(name, _)| name.get_ref() != "version") {
        let message = format!("missing field `version`, expected version = {VERSION}");
        return Err(SceneError::Format { at: locate(Some(&(0..0))), context: String::new(), message });
    }
    // A file of another version may well have other keys: the version is what to complain about.
    if let Some((found, span)) = version(document.get_ref()).filter(|&(found, _)| found != VERSION) {
        return Err(SceneError::Version { at: locate(Some(&span)), found: found.to_string() });
    }
    if let Some((context, message, span)) = misshapen(document.get_ref()) {
        return Err(SceneError::Format { at: locate(Some(&span)), context, message });
    }
    SceneTable::deserialize(Deserializer::from(document)).map_err(|error| {
        let context = error.span().map_or_else(String::new, |span| context_of(text, &span));
        SceneError::Format { at: locate(error.span().as_ref()), context, message: one_line(error.message()) }
    })
}

/// A parser's words in one line, and those of its language in plain ones.
pub(crate) fn one_line(message: &str) -> String {
    let plain = [
        ("\n", ", "),
        ("expected i64", "expected an integer"),
        ("expected f64", "expected a number"),
        (" as i128", ""),
        ("wanted string or table", "expected a string"),
    ];
    plain.iter().fold(message.trim().to_owned(), |message, (from, to)| message.replace(from, to))
}

/// The version that a file claims to be of, if that is an integer, and where it says so.
fn version(document: &DeTable<'_>) -> Option<(i64, Range<usize>)> {
    let (_, value) = document.iter().find(|(name, _)| name.get_ref() == "version")?;
    let integer = value.get_ref().as_integer()?;
    let version = i64::from_str_radix(integer.as_str(), integer.radix()).ok()?;
    Some((version, value.span()))
}

/// The first part that is not a table, or not an array of tables, as it should be: context, message and place. (Serde
/// would take an array for a table's values in the order of their definition.)
fn misshapen(document: &DeTable<'_>) -> Option<(String, String, Range<usize>)> {
    let is_table = |value: &DeValue<'_>| value.as_table().is_some();
    for (name, value) in document {
        let (key, found) = (name.get_ref().as_ref(), value.get_ref().type_str());
        if SINGLE.contains(&key) && !is_table(value.get_ref()) {
            let message = format!("invalid type: {found}, expected one table: [{key}]");
            return Some((format!("{key}: "), message, value.span()));
        }
        if LISTS.contains(&key) {
            let Some(elements) = value.get_ref().as_array() else {
                let message = format!("invalid type: {found}, expected an array of tables: [[{key}]]");
                return Some((format!("{key}: "), message, value.span()));
            };
            if let Some((index, element)) = elements.iter().enumerate().find(|(_, e)| !is_table(e.get_ref())) {
                let found = element.get_ref().type_str();
                let message = format!("invalid type: {found}, expected a table: [[{key}]]");
                return Some((format!("{key} {}: ", index + 1), message, element.span()));
            }
        }
    }
    None
}
