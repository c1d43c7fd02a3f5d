//! Where to keep what can be made again.

use std::env;
use std::path::PathBuf;

/// This program's folder among the user's caches (XDG Base Directory Specification, or its counterpart elsewhere), which
/// need not exist; `None` where there is none.
pub fn user_cache() -> Option<PathBuf> {
    // A relative path is to be ignored, and an empty one is relative.
    let absolute = |name| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = absolute("XDG_CACHE_HOME")
        .or_else(|| absolute("LOCALAPPDATA"))
        .or_else(|| absolute("HOME").map(|home| home.join(".cache")))?;
    Some(base.join("photolith"))
}
