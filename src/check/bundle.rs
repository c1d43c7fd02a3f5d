//! What those who mend a driver ask for: a folder for each case that does not pass.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::check::report::CaseReport;
use crate::gpu::{Capture, CapturedBuffer, CapturedShader, DeviceInfo};
use crate::host::cpu_model;

/// Words that differ, of which a list is written: the first so many.
const MOST_LISTED: usize = 1000;

/// What a kernel should have written, and what it has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Evidence {
    /// What it was asked.
    pub name: String,
    /// By the oracle.
    pub expected: Vec<u32>,
    /// By the device.
    pub actual: Vec<u32>,
}

/// What is known of a case that does not pass.
pub(super) struct Bundle<'a> {
    pub device: &'a DeviceInfo,
    pub case: &'a CaseReport,
    pub capture: &'a Capture,
    pub evidence: &'a [Evidence],
    pub full: bool,
}

impl Bundle<'_> {
    /// Writes a folder of the case's name, with a dash for its slash, into `into`: whole or not at all. One that is there is replaced.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, into: &Path) -> io::Result<PathBuf> {
        fs::create_dir_all(into)?;
        let place = into.join(self.case.name.replace('/', "-"));
        let made = tempfile::Builder::new().prefix(".bundle-").tempdir_in(into)?;
        let put = |name: &str, bytes: &[u8]| fs::write(made.path().join(name), bytes);
        for (i, shader) in self.capture.shaders.iter().enumerate() {
            put(&format!("{}.spv", stem(i, &shader.name)), &shader.spirv)?;
            put(&format!("{}.json", stem(i, &shader.name)), interface(shader).as_bytes())?;
        }
        for (i, buffer) in self.capture.buffers.iter().enumerate() {
            put(&format!("{}.bin", stem(i, &buffer.name)), &buffer.bytes)?;
        }
        for (i, evidence) in self.evidence.iter().enumerate() {
            let words = |words: &[u32]| bytemuck::cast_slice::<_, u8>(words).to_vec();
            put(&format!("expected-{i}.bin"), &words(&evidence.expected))?;
            put(&format!("actual-{i}.bin"), &words(&evidence.actual))?;
            put(&format!("differences-{i}.txt"), differences(evidence).as_bytes())?;
        }
        put("README.md", self.readme().as_bytes())?;
        if place.exists() {
            // What is there makes room at once, and goes when the new one is in its place.
            let old = tempfile::Builder::new().prefix(".bundle-").tempdir_in(into)?;
            fs::rename(&place, old.path().join("old"))?;
        }
        fs::rename(made.path(), &place)?;
        readable_by_all(&place)?;
        Ok(place)
    }

    fn readme(&self) -> String {
        let Self { device, case, .. } = self;
        let mut text = format!("# {}\n\n", case.name);
        let mut row = |name: &str, value: &str| {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "| {name} | {} |", value.replace('|', "\\|").replace('\n', " "));
        };
        row("", "");
        row("---", "---");
        row("what", &case.what);
        row("oracle", &case.oracle);
        row("quantity", &case.quantity);
        row("measured", &case.measured.map_or("no number".to_owned(), |m| format!("{m:e}")));
        row("allowed", &format!("{:e}", case.threshold));
        row("verdict", case.verdict.word());
        row("message", case.message.as_deref().unwrap_or(""));
        row("detail", &case.detail);
        row("device", &device.name);
        row("driver", &device.driver);
        row("VkDriverId", &device.driver_id.to_string());
        row("Vulkan", &device.api_version);
        row("UUID", &device.uuid);
        row("lanes of a subgroup", &device.subgroup_size.to_string());
        row("CPU", &cpu_model().unwrap_or_else(|| std::env::consts::ARCH.to_owned()));
        row("system", &format!("{} {}", std::env::consts::OS, std::env::consts::ARCH));
        row("photolith", env!("CARGO_PKG_VERSION"));
        let full = if self.full { " --full" } else { "" };
        let _ = write!(text, "\nTo see it again: `photolith check --filter {}{full}`\n", case.name);
        self.list_shaders(&mut text);
        self.list_buffers(&mut text);
        self.list_evidence(&mut text);
        text
    }

    fn list_shaders(&self, text: &mut String) {
        text.push_str(
            "\n## Shaders\n\nSPIR-V as the driver was given it, in the order in which it was compiled, the last one last; the \
             entry point is `main`. Beside each, as JSON: values of specialization constants (bits), bindings of set 0, \
             bytes of push constants.\n\n",
        );
        for (i, shader) in self.capture.shaders.iter().enumerate() {
            let _ = writeln!(text, "- `{}.spv`: {} bytes", stem(i, &shader.name), shader.spirv.len());
        }
    }

    fn list_buffers(&self, text: &mut String) {
        text.push_str("\n## Buffers\n\nAs they were last uploaded or read, in 32-bit words, little-endian.\n\n");
        for (i, CapturedBuffer { name, bytes, length }) in self.capture.buffers.iter().enumerate() {
            let cut = if bytes.len() < *length { format!(" of {length}") } else { String::new() };
            let _ = writeln!(text, "- `{}.bin`: {name}, {}{cut} bytes", stem(i, name), bytes.len());
        }
    }

    fn list_evidence(&self, text: &mut String) {
        if self.evidence.is_empty() {
            text.push_str("\nThe number that was measured is made of many values; the oracle is in the program.\n");
            return;
        }
        text.push_str(
            "\n## Expected and actual values\n\nWords of 32 bits; all of them, and a list of those that differ.\n\n",
        );
        for (i, evidence) in self.evidence.iter().enumerate() {
            let differ = evidence.expected.iter().zip(&evidence.actual).filter(|(e, a)| e != a).count();
            let (name, words) = (&evidence.name, evidence.expected.len());
            let _ = writeln!(
                text,
                "- {name}: {differ} of {words} words differ: `expected-{i}.bin`, `actual-{i}.bin`, `differences-{i}.txt`"
            );
        }
    }
}

/// A name for files.
fn stem(index: usize, name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
    format!("{index:02}-{}", name.chars().map(plain).collect::<String>())
}

fn interface(shader: &CapturedShader) -> String {
    let bindings: Vec<_> =
        shader.bindings.iter().map(|(number, kind)| serde_json::json!({ "binding": number, "type": kind })).collect();
    let constants: Vec<_> =
        shader.constants.iter().map(|(id, value)| serde_json::json!({ "constant_id": id, "value": value })).collect();
    let all = serde_json::json!({
        "name": shader.name, "entry_point": "main", "bindings": bindings, "specialization": constants,
        "push_constant_bytes": shader.push_bytes,
    });
    format!("{all:#}\n")
}

fn differences(evidence: &Evidence) -> String {
    let mut text = String::from("word expected actual\n");
    let pairs = evidence.expected.iter().zip(&evidence.actual).enumerate();
    for (word, (expected, actual)) in pairs.filter(|(_, (e, a))| e != a).take(MOST_LISTED) {
        let _ = writeln!(text, "{word} {expected:#010x} {actual:#010x}");
    }
    text
}

/// A temporary folder is for its owner alone.
#[cfg(unix)]
fn readable_by_all(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(folder, fs::Permissions::from_mode(0o755))
}

#[cfg(not(unix))]
fn readable_by_all(_: &Path) -> io::Result<()> {
    Ok(())
}
