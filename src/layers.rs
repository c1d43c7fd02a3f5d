//! Who imports whom: no circle of modules, and nothing in `render` from a layer above. (A module's re-exports do not count.)

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{read_dir, read_to_string};
use std::path::Path;

/// The layers of `render` from the lowest on; modules of one layer may import each other. The longest path counts.
const LAYERS: [&[&str]; 12] = [
    &["settings", "error", "statistics", "kernel::layout", "film::tiling"],
    &["space"],
    &["light"],
    &["scene"],
    &["kernel"],
    &["plan"],
    &["film"],
    &["engine"],
    &["first_hit"],
    &["reuse", "gradient", "sampling", "light_tracing"],
    &["renderer"],
    &[""],
];

/// The text of each module of a folder, without tests and comments.
fn modules_in(folder: &Path, of_folder: &str, modules: &mut BTreeMap<String, String>) {
    for entry in read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        let is_root = ["mod", "lib", "main"].contains(&name);
        let module = if is_root { of_folder.to_owned() } else { format!("{of_folder}{name}::") };
        if path.is_dir() {
            modules_in(&path, &module, modules);
        } else if !name.ends_with("tests") && name != "layers" && !module.contains("tests::") {
            let text = read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
            let lines = code.lines().map(|line| line.split("//").next().unwrap());
            modules.entry(module).or_default().extend(lines.flat_map(|line| [line, "\n"]));
        }
    }
}

/// Takes a path, or a group of them after a prefix, from the beginning of a text.
fn take_paths(text: &mut &str, prefix: &str, paths: &mut Vec<String>) {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':').unwrap_or(text.len());
    let path = format!("{prefix}{}", &text[..end]);
    *text = &text[end..];
    if !(path.ends_with("::") && text.starts_with('{')) {
        return paths.push(path);
    }
    while !text.starts_with('}') {
        *text = text[1..].trim_start();
        if text.starts_with(|c: char| c.is_alphanumeric() || c == '_') {
            take_paths(text, &path, paths);
        }
    }
    *text = &text[1..];
}

/// The modules that a module names.
fn imports(module: &str, modules: &BTreeMap<String, String>) -> BTreeSet<String> {
    let (code, mut paths) = (&modules[module], Vec::new());
    for (i, _) in ["crate::", "super::"].iter().flat_map(|start| code.match_indices(start)) {
        let is_reexport = ["pub use ", "pub(crate) use ", "pub(super) use "].iter().any(|p| code[..i].ends_with(p));
        let is_start = !code[..i].ends_with(|c: char| c.is_alphanumeric() || c == ':');
        if is_start && !is_reexport {
            take_paths(&mut &code[i..], "", &mut paths);
        }
    }
    let parent =
        module.trim_end_matches(':').rsplit_once("::").map_or(String::new(), |(parent, _)| parent.to_owned() + "::");
    let module_of = |path: String| {
        let full = path.replacen("super::", &parent, 1).replacen("crate::", "", 1) + "::";
        let is_prefix = |name: &&String| !name.is_empty() && *name != module && full.starts_with(name.as_str());
        modules.keys().filter(is_prefix).max_by_key(|name| name.len()).cloned()
    };
    paths.into_iter().filter_map(module_of).collect()
}

fn layer(module: &str) -> Option<usize> {
    let within = module.strip_prefix("render::")?;
    let names = LAYERS.iter().enumerate().flat_map(|(i, names)| names.iter().map(move |name| (i, *name)));
    let of_module = names.filter(|(_, name)| name.is_empty() || within.starts_with(&format!("{name}::")));
    of_module.max_by_key(|(_, name)| name.len()).map(|(i, _)| i)
}

#[test]
fn modules_import_in_one_direction() {
    let mut modules = BTreeMap::new();
    modules_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), "", &mut modules);
    let mut all: BTreeMap<_, _> = modules.keys().map(|module| (module.clone(), imports(module, &modules))).collect();
    assert!(all.values().map(BTreeSet::len).sum::<usize>() > 500, "imports are found");
    for (module, imported) in &all {
        let above = imported.iter().filter(|other| layer(module).is_some_and(|own| layer(other) > Some(own)));
        assert_eq!(above.collect::<Vec<_>>(), [""; 0], "{module} imports from above");
    }
    // Who imports nothing, and whom nobody imports, is on no circle.
    loop {
        let before = all.len();
        let named: BTreeSet<_> = all.values().flatten().cloned().collect();
        all.retain(|module, imported| !imported.is_empty() && named.contains(module));
        let left: BTreeSet<_> = all.keys().cloned().collect();
        all.values_mut().for_each(|imported| imported.retain(|other| left.contains(other)));
        if all.len() == before {
            break;
        }
    }
    assert!(all.is_empty(), "circles: {all:#?}");
}
