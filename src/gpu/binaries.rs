//! What a driver has made of shaders, or is given, kept on disk from one start of the program to the next.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::files::read_small;
use crate::hash::digest;

/// Files that together take more are too many: those that nobody has asked for the longest go, until half of it is left.
const MOST_BYTES: u64 = 64 << 20;
const SUFFIX: &str = "shader";
const UNFINISHED: &str = "shader-tmp";

/// A folder of binaries. What cannot be read or written is as good as not there: it only takes time to make it anew.
#[derive(Debug, Clone)]
pub(super) struct BinaryStore {
    folder: PathBuf,
    most_bytes: u64,
}

impl BinaryStore {
    /// In this folder, which need not exist.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), most_bytes: MOST_BYTES }
    }

    /// What was kept for exactly this identity: all that the binary depends on.
    pub fn load(&self, identity: &[u8]) -> Option<Vec<u8>> {
        let path = self.path(identity);
        let bytes = read_small(&path, self.most_bytes).ok()?;
        let binary = binary_of(&bytes, identity)?.to_vec();
        // In use: others go first.
        let _ = File::options().append(true).open(&path).and_then(|f| f.set_modified(SystemTime::now()));
        Some(binary)
    }

    /// Keeps a binary.
    pub fn keep(&self, identity: &[u8], binary: &[u8]) {
        if let Err(error) = self.write(identity, binary) {
            log::debug!("{}: a shader is not kept: {error}", self.folder.display());
        }
    }

    fn write(&self, identity: &[u8], binary: &[u8]) -> std::io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        self.make_room(binary.len() as u64)?;
        let mut file = tempfile::Builder::new().suffix(&format!(".{UNFINISHED}")).tempfile_in(&self.folder)?;
        file.write_all(&(identity.len() as u64).to_le_bytes())?;
        file.write_all(identity)?;
        file.write_all(&digest(binary).to_le_bytes())?;
        file.write_all(binary)?;
        file.persist(self.path(identity))?;
        Ok(())
    }

    fn path(&self, identity: &[u8]) -> PathBuf {
        self.folder.join(format!("{:016x}.{SUFFIX}", digest(identity)))
    }

    /// Removes old binaries if there would be too many with so many bytes more.
    fn make_room(&self, more: u64) -> std::io::Result<()> {
        let mut kept = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            // What was never finished goes too. Others may be at it at the same time.
            if path.extension().is_some_and(|e| e == SUFFIX || e == UNFINISHED)
                && let Ok(metadata) = fs::metadata(&path)
            {
                kept.push((metadata.modified()?, metadata.len(), path));
            }
        }
        let mut bytes = more + kept.iter().map(|(_, bytes, _)| bytes).sum::<u64>();
        if bytes <= self.most_bytes {
            return Ok(());
        }
        kept.sort();
        for (_, size, path) in kept {
            if bytes <= self.most_bytes / 2 {
                break;
            }
            let _ = fs::remove_file(path);
            bytes -= size;
        }
        Ok(())
    }
}

/// The binary in a file, if it is whole and of this identity.
fn binary_of<'a>(bytes: &'a [u8], identity: &[u8]) -> Option<&'a [u8]> {
    let (length, rest) = bytes.split_first_chunk()?;
    let (found, rest) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    let (sum, binary) = rest.split_first_chunk()?;
    (found == identity && u64::from_le_bytes(*sum) == digest(binary)).then_some(binary)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_kept_whole_and_for_the_same_identity_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let store = BinaryStore::new(&folder.path().join("not/yet/there"));
        assert_eq!(store.load(b"a"), None);
        store.keep(b"a", b"binary of a");
        store.keep(b"b", b"");
        assert_eq!(store.load(b"a").as_deref(), Some(&b"binary of a"[..]));
        assert_eq!(store.load(b"b").as_deref(), Some(&b""[..]));
        assert_eq!(store.load(b"c"), None);
        // Another identity in the place of this one, a file cut short or damaged, and a folder where a file should be.
        fs::copy(store.path(b"b"), store.path(b"c")).unwrap();
        assert_eq!(store.load(b"c"), None);
        let whole = fs::read(store.path(b"a")).unwrap();
        for cut in 0..whole.len() {
            fs::write(store.path(b"a"), &whole[..cut]).unwrap();
            assert_eq!(store.load(b"a"), None, "{cut} bytes");
            let mut damaged = whole.clone();
            damaged[cut] ^= 4;
            fs::write(store.path(b"a"), damaged).unwrap();
            assert_eq!(store.load(b"a"), None, "byte {cut}");
        }
        fs::remove_file(store.path(b"a")).unwrap();
        fs::create_dir(store.path(b"a")).unwrap();
        assert_eq!(store.load(b"a"), None);
        store.keep(b"a", b"nowhere to go");
        assert_eq!(store.load(b"b").as_deref(), Some(&b""[..]));
    }

    #[test]
    fn what_was_asked_for_last_stays() {
        let folder = tempfile::tempdir().unwrap();
        let store = BinaryStore { folder: folder.path().to_owned(), most_bytes: 1000 };
        let age = |name: &[u8], seconds| {
            let file = File::options().append(true).open(store.path(name)).unwrap();
            file.set_modified(SystemTime::now() - std::time::Duration::from_secs(seconds)).unwrap();
        };
        for (name, seconds) in [(b"a", 50), (b"b", 40), (b"c", 30), (b"d", 20)] {
            store.keep(name, &[1; 200]);
            age(name, seconds);
        }
        assert!(store.load(b"a").is_some());
        fs::write(folder.path().join("of-somebody-else"), [0; 5000]).unwrap();
        store.keep(b"e", &[1; 200]);
        let left: Vec<_> = [b"a", b"b", b"c", b"d", b"e"].into_iter().filter(|n| store.load(*n).is_some()).collect();
        assert_eq!(left, [b"a", b"e"]);
        assert!(folder.path().join("of-somebody-else").exists());
    }
}
