//! From an error to its line: which part of a scene file holds a value, and which value holds a byte.
//!
//! Used only once something is wrong: the text is parsed again, so that loading a good file pays nothing.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::scene::error::{Entity, Location};

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

/// What a value or key belongs to, as the start of a message: `sphere 2: radius: `. Empty if it belongs to nothing.
pub(super) fn context_of(text: &str, span: &Range<usize>) -> String {
    let (document, _) = DeTable::parse_recoverable(text);
    let entities = entities(document.get_ref());
    let holder = entities.into_iter().find(|(_, value)| is_within(value, span));
    holder.map_or_else(String::new, |(mut context, value)| {
        append_key(&mut context, value, span);
        context
    })
}

/// What a place where the file is not TOML belongs to: the entity whose header is the last before it.
pub(super) fn context_of_syntax(text: &str, span: &Range<usize>) -> String {
    let start = span.start.min(text.len());
    let line_start = text.as_bytes()[..start].iter().rposition(|&byte| byte == b'\n').map_or(0, |newline| newline + 1);
    if text.as_bytes()[line_start..].trim_ascii_start().starts_with(b"[") {
        // A header itself.
        return String::new();
    }
    let (document, _) = DeTable::parse_recoverable(text);
    let before = entities(document.get_ref()).into_iter().filter(|(_, value)| value.span().start <= start);
    before.max_by_key(|(_, value)| value.span().start).map_or_else(String::new, |(context, _)| context)
}

/// The parts of the file, each with its context, such as `sphere 2: `.
fn entities<'a, 'i>(document: &'a DeTable<'i>) -> Vec<(String, &'a Spanned<DeValue<'i>>)> {
    let mut entities = Vec::new();
    for (name, value) in document {
        match value.get_ref() {
            DeValue::Array(elements) => {
                let elements = elements.iter().enumerate();
                entities.extend(elements.map(|(i, element)| (format!("{} {}: ", name.get_ref(), i + 1), element)));
            }
            _ => entities.push((format!("{}: ", name.get_ref()), value)),
        }
    }
    entities
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
