//! What drivers say of themselves before they are loaded: the manifests that the Vulkan loader looks for (its document
//! LoaderDriverInterface.md, "Driver Discovery").

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::{env, fs};

use serde_json::Value;

/// A version of Vulkan: major and minor.
pub(super) type ApiVersion = (u32, u32);

/// The lowest version of Vulkan that the manifests of lavapipe name, whichever the loader takes; `None` if it finds none, or one that
/// cannot be read.
pub(super) fn lavapipe_api_version() -> Option<ApiVersion> {
    lowest(&manifests(|name| env::var_os(name)))
}

fn lowest(manifests: &[PathBuf]) -> Option<ApiVersion> {
    let of_lavapipe = |path: &&PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().contains("lvp"));
    let versions: Option<Vec<_>> = manifests.iter().filter(of_lavapipe).map(|path| api_version(path)).collect();
    versions?.into_iter().min()
}

fn api_version(manifest: &Path) -> Option<ApiVersion> {
    let text = fs::read_to_string(manifest).ok()?;
    let json: Value = serde_json::from_str(&text).ok()?;
    let mut parts = json["ICD"]["api_version"].as_str()?.split('.').map(str::parse);
    Some((parts.next()?.ok()?, parts.next()?.ok()?))
}

/// The manifests that a loader sees in such an environment, on Linux.
fn manifests(variable: impl Fn(&str) -> Option<OsString>) -> Vec<PathBuf> {
    let list = |name: &str| variable(name).filter(|value| !value.is_empty());
    let paths = |value: OsString| env::split_paths(&value).collect::<Vec<_>>();
    if let Some(value) = list("VK_DRIVER_FILES").or_else(|| list("VK_ICD_FILENAMES")) {
        return paths(value).into_iter().flat_map(files).collect();
    }
    let home = |below: &str| list("HOME").map(|home| PathBuf::from(home).join(below));
    let user = |name: &str, below: &str| list(name).map(PathBuf::from).or_else(|| home(below));
    let system = |name: &str, otherwise: &str| paths(list(name).unwrap_or_else(|| otherwise.into()));
    let mut folders: Vec<PathBuf> = user("XDG_CONFIG_HOME", ".config").into_iter().collect();
    folders.extend(system("XDG_CONFIG_DIRS", "/etc/xdg"));
    folders.push("/etc".into());
    folders.extend(user("XDG_DATA_HOME", ".local/share"));
    folders.extend(system("XDG_DATA_DIRS", "/usr/local/share:/usr/share"));
    let added = list("VK_ADD_DRIVER_FILES").map(paths).unwrap_or_default();
    added.into_iter().chain(folders.into_iter().map(|folder| folder.join("vulkan/icd.d"))).flat_map(files).collect()
}

/// A file, or those in a folder.
fn files(path: PathBuf) -> Vec<PathBuf> {
    match fs::read_dir(&path) {
        Ok(entries) => entries.flatten().map(|entry| entry.path()).collect(),
        Err(_) => vec![path],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(folder: &Path, name: &str, text: &str) -> PathBuf {
        fs::create_dir_all(folder).expect("a folder");
        let path = folder.join(name);
        fs::write(&path, text).expect("a manifest");
        path
    }

    fn of_version(version: &str) -> String {
        format!(
            r#"{{"ICD": {{"api_version": "{version}", "library_path": "lib.so"}}, "file_format_version": "1.0.0"}}"#
        )
    }

    #[test]
    fn the_oldest_lavapipe_counts() {
        let folder = tempfile::tempdir().expect("a folder");
        let of = |name: &str, text: &str| manifest(folder.path(), name, text);
        let other = of("radeon_icd.x86_64.json", &of_version("1.0.1"));
        assert_eq!(lowest(std::slice::from_ref(&other)), None);
        let new = of("lvp_icd.json", &of_version("1.4.305"));
        assert_eq!(lowest(&[other.clone(), new.clone()]), Some((1, 4)));
        let old = of("lvp_icd.x86_64.json", &of_version("1.1.230"));
        assert_eq!(lowest(&[new.clone(), old]), Some((1, 1)));
        let missing = folder.path().join("lvp_none.json");
        for unreadable in [missing, of("lvp_1.json", "{"), of("lvp_2.json", "{}"), of("lvp_3.json", &of_version("new"))]
        {
            assert_eq!(lowest(&[new.clone(), unreadable.clone()]), None, "{}", unreadable.display());
        }
    }

    #[test]
    fn manifests_are_where_the_loader_finds_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |below: &str| manifest(&folder.path().join(below), "lvp_icd.json", &of_version("1.4.1"));
        let (chosen, of_user, of_system) = (at("chosen"), at("home/.config/vulkan/icd.d"), at("share/vulkan/icd.d"));
        let with = |set: &[(&str, PathBuf)]| {
            manifests(|name| set.iter().find(|(known, _)| *known == name).map(|(_, value)| value.clone().into()))
        };
        let home = ("HOME", folder.path().join("home"));
        let share = ("XDG_DATA_DIRS", folder.path().join("share"));
        let found = with(&[home.clone(), share.clone()]);
        assert!(found.contains(&of_user) && found.contains(&of_system) && !found.contains(&chosen), "{found:?}");
        for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
            assert_eq!(with(&[home.clone(), share.clone(), (variable, chosen.clone())]), [chosen.as_path()]);
            assert_eq!(with(&[home.clone(), (variable, folder.path().join("chosen"))]), [chosen.as_path()]);
        }
        assert!(with(&[home, ("VK_ADD_DRIVER_FILES", chosen.clone())]).contains(&chosen));
    }
}
