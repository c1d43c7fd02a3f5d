//! What OBJ and MTL have in common: lines of words.

use std::borrow::Cow;

use rayon::prelude::*;

use crate::scene::error::{Location, SceneError};

/// A statement: a line, or several that end in a backslash (and white space) but for the last.
pub(super) struct Statement<'a> {
    /// Of its first line, counted from 1.
    pub line: u32,
    text: Cow<'a, [u8]>,
}

/// The statements of some lines of a file, in order, without empty lines and comments.
#[derive(Clone)]
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    next_line: u32,
}

/// The statements of a file.
pub(super) fn statements(bytes: &[u8]) -> Lines<'_> {
    const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
    Lines { rest: bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes), next_line: 1 }
}

/// The file in UTF-8 if it begins with a byte order mark of UTF-16, else as it is.
pub(super) fn decoded(bytes: &[u8]) -> Cow<'_, [u8]> {
    let unit: fn([u8; 2]) -> u16 = match bytes {
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        _ => return Cow::Borrowed(bytes),
    };
    let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]])).collect();
    Cow::Owned(String::from_utf16_lossy(&units).into_bytes())
}

/// Whether a byte ends a line. `\r\n` ends one line, not two.
fn ends_line(byte: &u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// The first line, without its end, and what follows it.
fn split_line(bytes: &[u8]) -> (&[u8], &[u8]) {
    let end = bytes.iter().position(ends_line).unwrap_or(bytes.len());
    let (line, rest) = bytes.split_at(end);
    let end = if rest.starts_with(b"\r\n") { 2 } else { rest.len().min(1) };
    (line, &rest[end..])
}

fn count_lines(bytes: &[u8]) -> usize {
    let starts_second = |pair: &&[u8]| *pair == b"\r\n";
    bytes.iter().filter(|byte| ends_line(byte)).count() - bytes.windows(2).filter(starts_second).count()
}

/// The line without the backslash at its end, if it goes on in the next line. That of a comment does not.
fn continued(line: &[u8]) -> Option<&[u8]> {
    let line = line.trim_ascii_end().strip_suffix(b"\\")?;
    let starts_comment = |pair: &[u8]| pair[0].is_ascii_whitespace() && pair[1] == b'#';
    let is_comment = line.trim_ascii_start().starts_with(b"#") || line.windows(2).any(starts_comment);
    (!is_comment).then_some(line)
}

/// The same in runs of about equal size, at most `count`.
pub(super) fn split_lines(bytes: &[u8], count: usize) -> Vec<Lines<'_>> {
    let Lines { mut rest, mut next_line } = statements(bytes);
    let size = rest.len().div_ceil(count.max(1)).max(1);
    let mut runs: Vec<&[u8]> = Vec::new();
    while !rest.is_empty() {
        let mut end = size.min(rest.len());
        // To the end of a statement: of a line that does not go on in the next one.
        end = line_start(rest, end);
        while end < rest.len() {
            let (line, others) = split_line(&rest[end..]);
            end = rest.len() - others.len();
            if continued(line).is_none() {
                break;
            }
        }
        let (run, others) = rest.split_at(end);
        runs.push(run);
        rest = others;
    }
    let lines: Vec<usize> = runs.par_iter().map(|run| count_lines(run)).collect();
    let run_of = |(run, lines): (_, usize)| {
        let first_line = next_line;
        next_line = next_line.saturating_add(u32::try_from(lines).unwrap_or(u32::MAX));
        Lines { rest: run, next_line: first_line }
    };
    runs.into_iter().zip(lines).map(run_of).collect()
}

/// The start of the line that holds a place.
fn line_start(bytes: &[u8], place: usize) -> usize {
    let place = if place < bytes.len() && bytes[..place + 1].ends_with(b"\r\n") { place - 1 } else { place };
    bytes[..place].iter().rposition(ends_line).map_or(0, |end| end + 1)
}

impl<'a> Iterator for Lines<'a> {
    type Item = Statement<'a>;

    fn next(&mut self) -> Option<Statement<'a>> {
        let Self { rest, next_line } = self;
        while !rest.is_empty() {
            let line = *next_line;
            let first_line = take_line(rest, next_line);
            let first_byte = first_line.iter().find(|byte| !byte.is_ascii_whitespace());
            if first_byte.is_none_or(|&byte| byte == b'#') {
                continue;
            }
            let Some(mut part) = continued(first_line) else {
                return Some(Statement { line, text: Cow::Borrowed(first_line) });
            };
            let mut joined = Vec::new();
            loop {
                joined.extend_from_slice(part);
                joined.push(b' ');
                let next = take_line(rest, next_line);
                let Some(goes_on) = continued(next) else {
                    joined.extend_from_slice(next);
                    break;
                };
                part = goes_on;
            }
            let text = Cow::Owned(joined);
            return Some(Statement { line, text });
        }
        None
    }
}

fn take_line<'a>(rest: &mut &'a [u8], next_line: &mut u32) -> &'a [u8] {
    let (line, others) = split_line(rest);
    *rest = others;
    *next_line = next_line.saturating_add(1);
    line
}

impl Statement<'_> {
    /// All words up to a comment.
    pub fn words(&self) -> impl Iterator<Item = &[u8]> {
        let words = self.text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        words.take_while(|word| word[0] != b'#')
    }

    /// The keyword; not empty.
    pub fn keyword(&self) -> &[u8] {
        self.words().next().unwrap_or_default()
    }

    /// What follows the keyword, as one name that may have spaces in it. Bytes that are not UTF-8 become U+FFFD.
    pub fn name(&self) -> String {
        let text = self.text.trim_ascii();
        String::from_utf8_lossy(text.get(self.keyword().len()..).unwrap_or_default()).trim().to_owned()
    }

    /// The numbers after the keyword, of which there must be `least`, and at most `N` are read; the others are 0.
    ///
    /// # Errors
    /// The line, what is there, and what should be.
    pub fn numbers<const N: usize>(&self, file: &str, least: usize) -> Result<[f64; N], SceneError> {
        let numbers = self.numbers_from(1, least);
        numbers.map(|(numbers, _)| numbers).map_err(|(found, expected)| self.error(file, found, expected))
    }

    /// The same from word number `first` on, the keyword being word 0, and how many there were.
    ///
    /// # Errors
    /// What is there, and what should be.
    pub fn numbers_from<const N: usize>(
        &self,
        first: usize,
        least: usize,
    ) -> Result<([f64; N], usize), (String, Cow<'static, str>)> {
        let mut numbers = [0.0; N];
        let mut count = 0;
        for (number, word) in numbers.iter_mut().zip(self.words().skip(first)) {
            match parse_number(word) {
                Some(value) => *number = value,
                None => {
                    let found = format!("{} has {}", self.quoted_keyword(), quoted(word));
                    return Err((found, "a finite number of magnitude <= 1e30".into()));
                }
            }
            count += 1;
        }
        if count < least {
            return Err((format!("{} has {count} numbers", self.quoted_keyword()), format!("at least {least}").into()));
        }
        Ok((numbers, count))
    }

    pub fn error(&self, file: &str, found: String, expected: impl Into<Cow<'static, str>>) -> SceneError {
        SceneError::Statement { at: Location::line(file, self.line), found, expected: expected.into() }
    }

    pub fn quoted_keyword(&self) -> String {
        quoted(self.keyword())
    }
}

/// A finite number of usable magnitude.
fn parse_number(word: &[u8]) -> Option<f64> {
    let number: f64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    (number.abs() <= crate::scene::limits::MAX_MAGNITUDE).then_some(number)
}

/// A word for a message, cut if it is long.
pub(super) fn quoted(word: &[u8]) -> String {
    const SHOWN: usize = 40;
    let text = String::from_utf8_lossy(&word[..word.len().min(SHOWN)]);
    let ellipsis = if word.len() > SHOWN { "…" } else { "" };
    format!("\"{}{ellipsis}\"", text.escape_debug())
}
