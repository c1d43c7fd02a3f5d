//! From an error to its line: which part of a scene file holds a value, and which value holds a byte.
//!
//! Used only once something is wrong: the text is parsed again, so that loading a good file pays nothing.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{Entity, Location};

/// The place of an entity's value; of the entity itself if the file leaves the value to its default; of the file if
/// the entity is not in it.
pub(super) fn locate_value(text: &str, file: &str, entity: Entity, field: &str) -> Location {
    match find_value(text, entity, field) {
        Some(offset) => Location::of_byte(file, text, offset),
        None => Location::file(file),
    }
}

fn find_value(text: &str, entity: Entity, field: &str) -> Option<usize> {
    let (document, _) = DeTable::parse_recoverable(text);
    let (key, index) = entity.key();
    let (_, value) = document.get_ref().iter().find(|(name, _)| name.get_ref() == key)?;
    let value = match index {
        None => value,
        Some(index) => value.get_ref().as_array()?.get(index)?,
    };
    let table = value.get_ref().as_table()?;
    let of_field = table.iter().find(|(name, _)| name.get_ref() == field);
    Some(of_field.map_or(value.span().start, |(_, value)| value.span().start))
}

/// The version that a file claims to be of, if that is an integer, and where it says so.
pub(super) fn version_in(text: &str) -> Option<(i64, usize)> {
    let (document, _) = DeTable::parse_recoverable(text);
    let (_, value) = document.get_ref().iter().find(|(name, _)| name.get_ref() == "version")?;
    let integer = value.get_ref().as_integer()?;
    let version = i64::from_str_radix(integer.as_str(), integer.radix()).ok()?;
    Some((version, value.span().start))
}

/// What a byte of the file belongs to, as the start of a message: `sphere 2: radius: `. Empty if it belongs to nothing.
pub(super) fn context_of(text: &str, span: &Range<usize>) -> String {
    let (document, _) = DeTable::parse_recoverable(text);
    let mut context = String::new();
    for (name, value) in document.get_ref() {
        let mut is_there = false;
        match value.get_ref() {
            DeValue::Array(elements) => {
                let holder = elements.iter().enumerate().find(|(_, element)| is_within(element, span));
                if let Some((index, element)) = holder {
                    context = format!("{} {}: ", name.get_ref(), index + 1);
                    append_key(&mut context, element, span);
                    is_there = true;
                }
            }
            _ if is_within(value, span) => {
                context = format!("{}: ", name.get_ref());
                append_key(&mut context, value, span);
                is_there = true;
            }
            _ => {}
        }
        if is_there {
            break;
        }
    }
    context
}

fn append_key(context: &mut String, table: &Spanned<DeValue<'_>>, span: &Range<usize>) {
    let entries = table.get_ref().as_table().into_iter().flatten();
    // A span on the key itself is an unknown key, which the message names.
    for (name, _) in entries.filter(|(_, value)| is_within(value, span)) {
        context.push_str(name.get_ref());
        context.push_str(": ");
    }
}

/// Whether the span lies in the value or, since the span of a table is that of its header, in a key or value inside.
fn is_within(value: &Spanned<DeValue<'_>>, span: &Range<usize>) -> bool {
    let contains = |outer: Range<usize>| outer.start <= span.start && span.end <= outer.end;
    contains(value.span())
        || match value.get_ref() {
            DeValue::Table(table) => table.iter().any(|(name, value)| contains(name.span()) || is_within(value, span)),
            DeValue::Array(elements) => elements.iter().any(|element| is_within(element, span)),
            _ => false,
        }
}
