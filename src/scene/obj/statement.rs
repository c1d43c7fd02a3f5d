//! What OBJ and MTL have in common: lines of words.

use std::borrow::Cow;

use rayon::prelude::*;

use crate::scene::error::{Location, SceneError};

/// A statement: a line, or several that end in a backslash but for the last.
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

/// The same in runs of about equal size, at most `count`.
pub(super) fn split_lines(bytes: &[u8], count: usize) -> Vec<Lines<'_>> {
    let Lines { mut rest, mut next_line } = statements(bytes);
    let size = rest.len().div_ceil(count.max(1)).max(1);
    let mut runs: Vec<&[u8]> = Vec::new();
    while !rest.is_empty() {
        let mut end = size.min(rest.len());
        // To the end of a statement: of a line that does not go on in the next one.
        while end < rest.len() {
            end += rest[end..].iter().position(|&byte| byte == b'\n').map_or(rest.len() - end, |i| i + 1);
            let line = rest[..end].strip_suffix(b"\n").unwrap_or(&rest[..end]);
            if !line.strip_suffix(b"\r").unwrap_or(line).ends_with(b"\\") {
                break;
            }
        }
        let (run, others) = rest.split_at(end);
        runs.push(run);
        rest = others;
    }
    let lines: Vec<usize> = runs.par_iter().map(|run| run.iter().filter(|&&byte| byte == b'\n').count()).collect();
    let run_of = |(run, lines): (_, usize)| {
        let first_line = next_line;
        next_line = next_line.saturating_add(u32::try_from(lines).unwrap_or(u32::MAX));
        Lines { rest: run, next_line: first_line }
    };
    runs.into_iter().zip(lines).map(run_of).collect()
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
            let mut text = Cow::Borrowed(first_line);
            while text.ends_with(b"\\") && !rest.is_empty() {
                let joined = text.to_mut();
                joined.pop();
                joined.push(b' ');
                joined.extend_from_slice(take_line(rest, next_line));
            }
            return Some(Statement { line, text });
        }
        None
    }
}

fn take_line<'a>(rest: &mut &'a [u8], next_line: &mut u32) -> &'a [u8] {
    let end = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
    let line = &rest[..end];
    *rest = rest.get(end + 1..).unwrap_or_default();
    *next_line = next_line.saturating_add(1);
    line.strip_suffix(b"\r").unwrap_or(line)
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
    /// Also returns how many there were.
    pub fn numbers<const N: usize>(&self, file: &str, least: usize) -> Result<([f64; N], usize), SceneError> {
        self.numbers_from(1, file, least)
    }

    /// The same of those from word number `first` on, the keyword being word 0.
    pub fn numbers_from<const N: usize>(
        &self,
        first: usize,
        file: &str,
        least: usize,
    ) -> Result<([f64; N], usize), SceneError> {
        let mut numbers = [0.0; N];
        let mut count = 0;
        for (number, word) in numbers.iter_mut().zip(self.words().skip(first)) {
            match parse_number(word) {
                Some(value) => *number = value,
                None => {
                    let expected = "a finite number of magnitude <= 1e30";
                    return Err(self.error(file, format!("{} has {}", self.quoted_keyword(), quoted(word)), expected));
                }
            }
            count += 1;
        }
        if count < least {
            let found = format!("{} has {count} numbers", self.quoted_keyword());
            return Err(self.error(file, found, format!("at least {least}")));
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
    (number.abs() <= crate::scene::validate::MAX_MAGNITUDE).then_some(number)
}

/// A word for a message, cut if it is long.
pub(super) fn quoted(word: &[u8]) -> String {
    const SHOWN: usize = 40;
    let text = String::from_utf8_lossy(&word[..word.len().min(SHOWN)]);
    let ellipsis = if word.len() > SHOWN { "…" } else { "" };
    format!("\"{}{ellipsis}\"", text.escape_debug())
}

/// For what `tobj` refuses although it has been checked.
pub(super) fn read_failed(file: &str, error: tobj::LoadError) -> SceneError {
    let expected = "statements that the MTL reader knows";
    SceneError::Statement { at: Location::file(file), found: error.to_string(), expected: expected.into() }
}
