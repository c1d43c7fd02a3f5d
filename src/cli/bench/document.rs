//! Sections of Markdown documents that a command writes.

use std::io::Write as _;
use std::path::Path;

use anyhow::{Context as _, Result, bail};
use photolith::files::{check_writable, write_whole};

/// Checks that [`write_section`] could write to `path`.
///
/// # Errors
/// It could not.
pub fn check(path: &Path, name: &str) -> Result<()> {
    check_writable(path)?;
    replace_section(&read(path)?, name, "").with_context(|| path.display().to_string())?;
    Ok(())
}

/// Puts the command line, `text` and the plot in place of a section of a document, which is made if it is not there.
///
/// # Errors
/// The file cannot be read or written, or a section begins and does not end.
pub fn write_section(path: &Path, name: &str, text: &str, plot: Option<&Path>) -> Result<()> {
    let old = read(path)?;
    let mut body = format!("```sh\n{}\n```\n\n{text}", command_line());
    if let Some(plot) = plot {
        body.push_str(&format!("\n![{name}]({})\n", relative(plot, path)));
    }
    let new = replace_section(&old, name, &body).with_context(|| path.display().to_string())?;
    Ok(write_whole(path, |out| out.write_all(new.as_bytes()))?)
}

/// The document as it is; empty if there is none yet.
fn read(path: &Path) -> Result<String> {
    if !path.is_file() {
        return Ok(String::new());
    }
    std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

/// The command as it was given, without the program's folder.
fn command_line() -> String {
    let arguments = std::env::args().skip(1);
    std::iter::once("photolith".to_owned()).chain(arguments).collect::<Vec<_>>().join(" ")
}

fn replace_section(old: &str, name: &str, body: &str) -> Result<String> {
    let (begin, end) = (format!("<!-- begin {name} -->"), format!("<!-- end {name} -->"));
    let section = format!("{begin}\n{body}{end}");
    let Some(from) = old.find(&begin) else {
        let gap = if old.is_empty() { "" } else { "\n" };
        return Ok(format!("{old}{gap}{section}\n"));
    };
    let Some(length) = old[from..].find(&end) else { bail!("found '{begin}', expected '{end}' after it") };
    Ok(format!("{}{section}{}", &old[..from], &old[from + length + end.len()..]))
}

/// The plot as seen from the document, where it is below the document's folder.
fn relative(plot: &Path, document: &Path) -> String {
    let folder = document.parent().unwrap_or(Path::new(""));
    plot.strip_prefix(folder).unwrap_or(plot).display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_added_and_replaced() {
        let first = replace_section("# Title\n", "a", "old\n").unwrap();
        assert_eq!(first, "# Title\n\n<!-- begin a -->\nold\n<!-- end a -->\n");
        let both = replace_section(&first, "b", "other\n").unwrap();
        let again = replace_section(&both, "a", "new\n").unwrap();
        assert_eq!(again, both.replace("old", "new"));
        assert!(replace_section("<!-- begin a -->", "a", "x").is_err());
        assert_eq!(replace_section("", "a", "x\n").unwrap(), "<!-- begin a -->\nx\n<!-- end a -->\n");
    }

    #[test]
    fn plots_are_linked_from_the_document() {
        assert_eq!(relative(Path::new("docs/plots/a.svg"), Path::new("docs/measurements.md")), "plots/a.svg");
        assert_eq!(relative(Path::new("a.svg"), Path::new("b.md")), "a.svg");
    }
}
