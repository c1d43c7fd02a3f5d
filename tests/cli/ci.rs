//! What is shipped for continuous integration: its shell runs here, with the program and with stand-ins.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use super::*;

fn shipped(name: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap()
}

/// The texts after lines that end with `head`, each as long as lines are further in than that line.
fn blocks(yaml: &str, head: &str) -> Vec<String> {
    let indent = |line: &str| line.len() - line.trim_start().len();
    let lines: Vec<&str> = yaml.lines().collect();
    let heads = lines.iter().enumerate().filter(|(_, line)| line.trim_end().ends_with(head));
    heads
        .map(|(i, line)| {
            let inside = lines[i + 1..].iter().take_while(|l| l.trim().is_empty() || indent(l) > indent(line));
            let own = lines.get(i + 1).map_or(0, |l| indent(l));
            inside.map(|l| format!("{}\n", l.get(own..).unwrap_or(""))).collect()
        })
        .collect()
}

/// A folder for programs, in front of others.
struct Programs(PathBuf);

impl Programs {
    fn new(directory: &Path) -> Self {
        let folder = directory.join("programs");
        fs::create_dir(&folder).unwrap();
        Self(folder)
    }

    /// A program that is a script.
    fn script(&self, name: &str, text: &str) {
        use std::os::unix::fs::PermissionsExt;
        let path = self.0.join(name);
        fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    fn photolith(&self) {
        std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_photolith"), self.0.join("photolith")).unwrap();
    }

    /// Runs a shell in `directory`.
    fn run(&self, directory: &Path, shell: &[&str], script: &str, variables: &[(&str, &str)]) -> Output {
        let path = format!("{}:/usr/bin:/bin", self.0.display());
        Command::new(shell[0])
            .args(&shell[1..])
            .args(["-c", script])
            .current_dir(directory)
            .env("PATH", path)
            .env("XDG_CACHE_HOME", common::CACHE)
            .envs(variables.iter().copied())
            .output()
            .unwrap()
    }
}

/// As GitHub calls it.
const BASH: [&str; 5] = ["bash", "--noprofile", "--norc", "-eo", "pipefail"];
const SH: [&str; 2] = ["sh", "-e"];
const TWO_CASES: &str = "sampling/log loops/nested";

#[test]
fn the_action_installs_what_is_asked_for() {
    let directory = tempfile::tempdir().unwrap();
    let d = directory.path();
    let programs = Programs::new(d);
    programs.script("sudo", "echo \"$@\" >>called");
    programs.script("cargo", "echo cargo \"$@\" >>called");
    let install = &blocks(&shipped("action.yml"), "run: |")[0];
    let called = |driver: &str, validate: &str| {
        let variables = [("DRIVER", driver), ("VALIDATE", validate), ("ACTION", "/the action")];
        let output = programs.run(d, &BASH, install, &variables);
        assert!(output.status.success(), "{output:?}");
        let called = fs::read_to_string(d.join("called")).unwrap();
        fs::remove_file(d.join("called")).unwrap();
        called
    };
    let built = called("lavapipe", "");
    assert!(built.contains("mesa-vulkan-drivers") && built.contains("ninja-build"), "{built}");
    assert!(built.contains("cargo install --locked --path /the action") && !built.contains("validation"), "{built}");
    programs.script("photolith", "");
    let there = called("system", "core");
    assert!(there.contains("libvulkan1 vulkan-validationlayers"), "{there}");
    assert!(!there.contains("mesa") && !there.contains("cargo"), "{there}");
}

#[test]
fn the_action_checks_and_keeps_what_was_found() {
    let directory = tempfile::tempdir().unwrap();
    let d = directory.path();
    let programs = Programs::new(d);
    programs.photolith();
    let check = &blocks(&shipped("action.yml"), "run: |")[1];
    put(d, "known.toml", "[[expected]]\ncase = \"loops/*\"\nreason = \"a test\"\n");
    let run = |expectations: &str| {
        let variables = [
            ("FILTER", TWO_CASES),
            ("EXPECTATIONS", expectations),
            ("DEVICE", ""),
            ("FULL", "false"),
            ("VALIDATE", ""),
            ("STRICT", "true"),
            ("GITHUB_OUTPUT", "output"),
            ("GITHUB_STEP_SUMMARY", "summary"),
        ];
        programs.run(d, &BASH, check, &variables)
    };
    let output = run("");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let read = |name: &str| fs::read_to_string(d.join(name)).unwrap();
    assert_eq!(read("output"), "code=0\n");
    assert!(read("summary").contains("2 of 2 pass") && read("photolith.xml").contains("name=\"nested\""));
    // It passes, though it is declared to fail.
    let output = run("known.toml");
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(read("output").ends_with("code=1\n") && read("photolith.xml").contains("type=\"PASSES\""));
    let json: Value = serde_json::from_str(&read("photolith.json")).unwrap();
    assert_eq!(json["devices"][0]["cases"].as_array().unwrap().len(), 2);
}

#[test]
fn the_template_of_gitlab_checks() {
    let directory = tempfile::tempdir().unwrap();
    let d = directory.path();
    let programs = Programs::new(d);
    programs.photolith();
    let scripts = blocks(&shipped(".gitlab/photolith.gitlab-ci.yml"), "- |");
    assert_eq!(scripts.len(), 1);
    let variables = [
        ("PHOTOLITH_FILTER", TWO_CASES),
        ("PHOTOLITH_DEVICE", "0"),
        ("PHOTOLITH_EXPECTATIONS", ""),
        ("PHOTOLITH_STRICT", "1"),
    ];
    let output = programs.run(d, &SH, &scripts[0], &variables);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let xml = fs::read_to_string(d.join("photolith.xml")).unwrap();
    assert_eq!(xml.matches("<testcase ").count(), 2, "{xml}");
}

#[test]
fn the_block_of_the_page_tells_what_a_code_means() {
    let directory = tempfile::tempdir().unwrap();
    let d = directory.path();
    let programs = Programs::new(d);
    programs.script("photolith", "exit \"$CODE\"");
    let page = shipped("docs/ci.md");
    let script = page.split("```sh\n").nth(1).unwrap().split("```").next().unwrap();
    for (code, words) in [("0", "is right"), ("1", "a case fails"), ("3", "no driver"), ("6", "broke down (code 6)")] {
        let output = programs.run(d, &SH, script, &[("CODE", code)]);
        assert_eq!(output.status.code(), code.parse().ok(), "{output:?}");
        assert!(text(&output.stdout).contains(words), "{output:?}");
    }
}

#[test]
fn the_page_names_what_is_shipped() {
    let page = shipped("docs/ci.md");
    for name in [".gitlab/photolith.gitlab-ci.yml", "Containerfile", "action.yml"] {
        assert!(page.contains(name) && !shipped(name).is_empty(), "{name}");
    }
}
