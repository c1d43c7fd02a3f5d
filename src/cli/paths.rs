//! Files that a command reads and writes.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use photolith::files;

/// Checks that no output would take the place of an input or of another output. What is no file, such as a pipe or
/// `/dev/null`, may be named as often as one likes.
///
/// # Errors
/// Two names are of one file.
pub fn check_apart<'a>(
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    outputs: impl IntoIterator<Item = (&'static str, &'a PathBuf)>,
) -> Result<()> {
    let inputs: Vec<_> = inputs.into_iter().filter_map(|path| place(path)).collect();
    let mut taken: Vec<(&str, PathBuf)> = Vec::new();
    for (option, path) in outputs {
        let Some(place) = place(path) else { continue };
        if inputs.contains(&place) {
            bail!("{option} {}: this file is also read, expected another one", path.display());
        }
        if let Some((other, _)) = taken.iter().find(|(_, other)| *other == place) {
            bail!("{option} {}: {other} writes this file too, expected another one", path.display());
        }
        taken.push((option, place));
    }
    Ok(())
}

/// Where a file is or would be; `None` for what is there but no file.
fn place(path: &Path) -> Option<PathBuf> {
    if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        return None;
    }
    // A link whose file is not there yet stands for that file.
    let target = files::target(path);
    let path = target.as_deref().unwrap_or(path);
    if let Ok(found) = fs::canonicalize(path) {
        return Some(found);
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(match (fs::canonicalize(folder), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_file_has_many_names() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("a"), "").unwrap();
        fs::create_dir(at("d")).unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink("a", at("link")).unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink("later", at("link to later")).unwrap();
        let check = |inputs: &[&str], outputs: &[&str]| {
            let (inputs, outputs): (Vec<_>, Vec<_>) =
                (inputs.iter().map(|n| at(n)).collect(), outputs.iter().map(|n| at(n)).collect());
            let names = ["--one", "--two"];
            check_apart(&inputs, names.into_iter().zip(&outputs)).map_err(|error| error.to_string())
        };
        assert!(check(&["a"], &["b", "c"]).is_ok());
        assert!(check(&["a", "a"], &["d", "d"]).is_ok(), "folders are for others to refuse");
        assert!(check(&["a"], &["d/../a"]).unwrap_err().starts_with("--one "));
        assert!(
            check(&["a"], &["b", "d/../b"]).unwrap_err().ends_with("--one writes this file too, expected another one")
        );
        #[cfg(unix)]
        assert!(check(&["a"], &["b", "link"]).unwrap_err().starts_with("--two "));
        #[cfg(unix)]
        assert!(check(&["a"], &["later", "link to later"]).unwrap_err().starts_with("--two "));
        let null = PathBuf::from("/dev/null");
        assert!(check_apart([&null], [("--one", &null), ("--two", &null)]).is_ok());
    }
}
