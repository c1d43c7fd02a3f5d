//! From the text of a scene file to its tables.

use std::ops::Range;

use serde::Deserialize;
use toml::de::{DeTable, DeValue, Deserializer};

use crate::scene::error::{Location, SceneError};
use crate::scene::format::{SceneTable, VERSION};
use crate::scene::locate::{context_of, context_of_syntax};

/// Parts that a scene has one of, each a table.
const SINGLE: [&str; 5] = ["camera", "film", "integrator", "background", "environment"];

/// Parts that a scene can have several of, each a table in an array.
const LISTS: [&str; 7] = ["texture", "material", "sphere", "mesh", "model", "instance", "light"];

/// Reads the tables. `file` is the name for messages.
pub(super) fn parse(text: &str, file: &str) -> Result<SceneTable, SceneError> {
    let locate = |span: Option<&Range<usize>>| match span {
        Some(span) => Location::of_byte(file, text, span.start),
        None => Location::file(file),
    };
    let document = DeTable::parse(text).map_err(|error| {
        let context = error.span().map_or_else(String::new, |span| context_of_syntax(text, &span));
        let message = syntax(error.message(), text, error.span());
        SceneError::Format { at: locate(error.span().as_ref()), context, message }
    })?;
    if document.get_ref().iter().all(|(name, _)| name.get_ref() != "version") {
        let message = format!("`version` is missing, expected version = {VERSION}");
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
        let message = match missing_key(error.message()) {
            Some(key) => format!("`{key}` is missing, expected {}", expected(key)),
            None if error.message().contains("overflowed") => {
                let number = error.span().and_then(|span| text.get(span)).unwrap_or_default();
                format!("found the number `{number}`, expected one of magnitude <= 1e30")
            }
            None => one_line(error.message()),
        };
        SceneError::Format { at: locate(error.span().as_ref()), context, message }
    })
}

fn missing_key(message: &str) -> Option<&str> {
    message.trim().strip_prefix("missing field `")?.strip_suffix('`')
}

/// What a key that has no default may be.
fn expected(key: &str) -> &'static str {
    match key {
        "camera" => "a table [camera] with position, target and horizontal_fov",
        "position" | "target" | "center" => "three numbers, such as [0, 0, 1]",
        "power" => "three numbers >= 0, such as [10, 10, 10]",
        "horizontal_fov" => "an angle between 0 and 180 degrees, both excluded",
        "radius" => "a number > 0",
        "material" => "the name of a [[material]]",
        "of" => "the name of a [[mesh]] or [[model]]",
        "name" => "a name of its own, in quotation marks",
        "file" => "the name of a file, in quotation marks",
        "type" => {
            "a type, in quotation marks: a material is diffuse, mirror, dielectric, pbr or emitter, a light is point, spot or directional"
        }
        _ => "a value",
    }
}

/// What the parser says of what is not TOML, with what is there.
fn syntax(message: &str, text: &str, span: Option<Range<usize>>) -> String {
    let start = span.as_ref().map_or(text.len(), |span| span.start.min(text.len()));
    let ends_word = |c: char| c.is_whitespace() || ",[]{}=#".contains(c);
    let (before, after) = text.split_at_checked(start).unwrap_or((text, ""));
    let begin = before.rfind(ends_word).map_or(0, |at| at + before[at..].chars().next().map_or(1, char::len_utf8));
    let line = after.lines().next().unwrap_or_default();
    let end = line.char_indices().skip(1).find(|(_, c)| ends_word(*c)).map_or(line.len(), |(at, _)| at);
    let word = format!("{}{}", &before[begin..], &line[..end]);
    // What the parser points at may be more than a word.
    let pointed = span.and_then(|span| text.get(span)).filter(|text| text.len() > word.len() && !text.contains('\n'));
    let word = pointed.map_or(word, str::to_owned);
    const SHOWN: usize = 40;
    let found = match word.trim() {
        "" if after.trim().is_empty() => "the end of the file".to_owned(),
        "" => "the end of the line".to_owned(),
        comment if comment.starts_with('#') => "the end of the line".to_owned(),
        word if word.chars().count() > SHOWN => format!("`{}…`", word.chars().take(SHOWN).collect::<String>()),
        word => format!("`{word}`"),
    };
    let message = one_line(message);
    let message = message.replace(", expected nothing", ", expected a number");
    match message.as_str() {
        "duplicate key" => format!("{found} is there twice, expected once"),
        message if message.contains("must be quoted") => {
            format!("found {found}, expected a number, true, false, an array or a string in quotation marks")
        }
        message if message.contains("expected") => format!("found {found}: {message}"),
        message => format!("found {found}: {message}, expected TOML"),
    }
}

/// A parser's words in one line, and those of its language in plain ones.
pub(crate) fn one_line(message: &str) -> String {
    let plain = [
        ("\n", ", "),
        ("expected i64", "expected an integer of 64 bits"),
        ("expected f64", "expected a number"),
        (" as i128", ""),
        ("wanted string or table", "expected a string"),
        ("invalid type: map", "invalid type: table or date"),
        ("invalid type: sequence", "invalid type: array"),
        ("missing field ", "expected a value, found none of "),
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
