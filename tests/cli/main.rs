//! The program from outside: exit codes, what stdout and stderr carry, and the files that it leaves.

#[path = "../common/assets.rs"]
mod assets;
#[path = "../common/mod.rs"]
mod common;

mod bench;
mod checkpoint;
#[cfg(unix)]
mod ci;
mod compare;
mod errors;
mod noise;
mod outputs;
mod stopping;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

const CAMERA: &str = "[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\nhorizontal_fov = 40\n";
const BALL: &str = "[[material]]\nname = \"white\"\ntype = \"diffuse\"\nreflectance = [0.8, 0.8, 0.8]\n\
                    [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"white\"\n";
const SKY: &str = "[background]\nradiance = [1, 1, 1]\n";

/// Hours of work, to be stopped.
const LONG: &str = "--size 512x512 --samples 1000000";

fn program(directory: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_photolith"));
    command.current_dir(directory).stdin(Stdio::null()).env_remove("RUST_LOG").env("XDG_CACHE_HOME", common::CACHE);
    command
}

/// Runs the program in `directory` with arguments that have no spaces.
fn run(directory: &Path, arguments: &str) -> Output {
    program(directory).args(arguments.split_ascii_whitespace()).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

/// A directory with a small good scene, `ball.toml`.
fn directory() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    put(directory.path(), "ball.toml", &format!("version = 1\n{CAMERA}{SKY}{BALL}"));
    directory
}

fn put(directory: &Path, name: &str, content: &str) {
    fs::write(directory.join(name), content).expect("a file");
}

fn names(directory: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Asserts the exit code, that stdout is empty, and that the one message has the words and is no panic.
fn assert_fails(output: &Output, code: i32, words: &[&str], what: &str) {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{what}: {output:?}");
    assert!(output.stdout.is_empty(), "{what}: {output:?}");
    assert!(!stderr.contains("panicked"), "{what}: {stderr}");
    for word in words {
        assert!(stderr.contains(word), "{what}: {stderr:?} should contain {word:?}");
    }
}

fn one_line(output: &Output) -> Value {
    let stdout = text(&output.stdout);
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    serde_json::from_str(stdout).expect("JSON")
}
