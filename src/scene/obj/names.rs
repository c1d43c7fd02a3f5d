//! Names as they are written in OBJ and MTL files: of files on another machine, quoted, escaped, in another case.

use std::fs;
use std::path::{Path, PathBuf};

use crate::scene::read::Files;

/// The file that `name` means, from the folder of the file that names it, if it may be read: the one of exactly that name, else of one of its other
/// readings, each in any case; of an absolute name, or one of another machine, also what lies beside.
pub(super) fn find_file(files: Files<'_>, name: &str) -> Option<PathBuf> {
    let folder = files.base_dir?;
    let is_there = |path: &PathBuf| path.is_file() && files.may_read(path);
    readings(name).iter().find_map(|reading| {
        let exact = folder.join(reading);
        if is_there(&exact) {
            return Some(exact);
        }
        let parts: Vec<&str> = reading.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
        // The whole path first, then without its first folders.
        (0..parts.len()).find_map(|first| in_any_case(folder, &parts[first..]).filter(is_there))
    })
}

/// What `mtllib` names, if it is not one file: several, of which those with spaces are quoted.
pub(super) fn file_names(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut rest = uncommented(text);
    while let Some(first) = rest.chars().next() {
        let (name, after) = match first {
            '"' | '\'' if rest[1..].contains(first) => rest[1..].split_once(first).unwrap_or((rest, "")),
            _ => rest.split_once(char::is_whitespace).unwrap_or((rest, "")),
        };
        names.push(name.to_owned());
        rest = after.trim_start();
    }
    names
}

/// A material's name for comparison with others of another spelling: without comment and quotation marks, in lower case.
pub(super) fn loose(name: &str) -> String {
    unquoted(uncommented(name)).to_lowercase()
}

/// What a file's name may mean, from the literal on.
fn readings(name: &str) -> Vec<String> {
    let mut readings = vec![name.to_owned()];
    let mut add = |reading: String| {
        if !reading.is_empty() && !readings.contains(&reading) {
            readings.push(reading);
        }
    };
    for name in [name, uncommented(name)] {
        let plain = unquoted(name);
        add(plain.to_owned());
        add(plain.replace("\\ ", " "));
        // Windows' separator, doubled by some exporters.
        let portable = plain.replace('\\', "/");
        let portable = match portable.split_once(':') {
            Some((drive, path)) if drive.len() == 1 => path.to_owned(),
            _ => portable.strip_prefix("file://").unwrap_or(&portable).to_owned(),
        };
        add(percent_decoded(&portable));
        add(portable);
    }
    readings
}

/// Without a comment at the end. In `Material #1` there is none.
fn uncommented(text: &str) -> &str {
    let starts_comment = |(at, _): &(usize, &str)| {
        text[..*at].ends_with(char::is_whitespace) && !text[at + 1..].starts_with(|c: char| c.is_ascii_digit())
    };
    let end = text.match_indices('#').find(starts_comment).map_or(text.len(), |(at, _)| at);
    text[..end].trim()
}

fn unquoted(text: &str) -> &str {
    let inner = |mark: char| text.strip_prefix(mark)?.strip_suffix(mark);
    inner('"').or_else(|| inner('\'')).unwrap_or(text).trim()
}

/// With `%20` and the like as what they stand for.
fn percent_decoded(text: &str) -> String {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let code = after.get(..2).filter(|_| first == b'%').and_then(|hex| std::str::from_utf8(hex).ok());
        match code.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A file in a folder by the parts of its path; where one is not there, another that differs in case only.
fn in_any_case(folder: &Path, parts: &[&str]) -> Option<PathBuf> {
    let mut path = folder.to_owned();
    for part in parts {
        let exact = path.join(part);
        path = if exact.exists() { exact } else { entry_in_any_case(&path, part)? };
    }
    path.is_file().then_some(path)
}

/// The first such entry by its name, so that the same is found each time.
fn entry_in_any_case(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.to_lowercase();
    // Bytes that are not UTF-8 are the same in the name that is looked for.
    let is_it = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().to_lowercase() == name;
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    fs::read_dir(folder).ok()?.flatten().filter(is_it).map(|entry| entry.path()).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_however_they_are_named() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("Tex")).unwrap();
        for name in ["my plate.mtl", "Tex/a.mtl", "b.mtl", "half \"inch\".mtl", "no#1.mtl"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        for (name, expected) in [
            ("my plate.mtl", "my plate.mtl"),
            ("\"my plate.mtl\"", "my plate.mtl"),
            ("'my plate.mtl'", "my plate.mtl"),
            ("\"my plate.mtl\" # of the plate", "my plate.mtl"),
            ("my\\ plate.mtl", "my plate.mtl"),
            ("my%20plate.mtl", "my plate.mtl"),
            ("MY PLATE.MTL", "my plate.mtl"),
            ("./my plate.mtl", "my plate.mtl"),
            ("C:\\Users\\me\\my plate.mtl", "my plate.mtl"),
            ("\"C:\\\\Users\\\\me\\\\b.mtl\"", "b.mtl"),
            ("\\\\server\\share\\B.mtl", "b.mtl"),
            ("/home/me/model/b.mtl", "b.mtl"),
            ("file:///C:/model/b.mtl", "b.mtl"),
            ("tex\\A.mtl", "Tex/a.mtl"),
            ("D:/project/tex/a.mtl", "Tex/a.mtl"),
            ("half \"inch\".mtl", "half \"inch\".mtl"),
            ("no#1.mtl", "no#1.mtl"),
            ("b.mtl # all of them", "b.mtl"),
        ] {
            assert_eq!(
                find_file(Files::new(Some(folder.path()), false), name),
                Some(folder.path().join(expected)),
                "{name}"
            );
        }
        for name in ["", "\"", "c.mtl", "..", "Tex", "a.mtl", "C:", "%", "my", "\\"] {
            assert_eq!(find_file(Files::new(Some(folder.path()), false), name), None, "{name}");
        }
    }

    #[test]
    fn several_names() {
        assert_eq!(file_names("a.mtl b.mtl"), ["a.mtl", "b.mtl"]);
        assert_eq!(file_names("\"a b.mtl\"  'c.mtl' d # e"), ["a b.mtl", "c.mtl", "d"]);
        assert_eq!(file_names("\"a b"), ["\"a", "b"]);
        assert_eq!(file_names(""), [""; 0]);
    }

    #[test]
    fn spellings_of_a_material() {
        assert_eq!(loose("\"Red\" # of the front"), "red");
        assert_ne!(loose("Material #1"), loose("Material #2"));
    }
}
