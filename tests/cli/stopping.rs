//! Renderings and checks that are stopped.

use std::process::Child;
use std::time::{Duration, Instant};

use photolith::image::read;

use super::assets::scene_path;
use super::*;

#[test]
fn the_time_limit_stops_in_time_and_writes_the_image() {
    let directory = directory();
    let start = Instant::now();
    let spheres = scene_path("spheres");
    let output =
        run(directory.path(), &format!("render {} {LONG} -o out.pfm --time-limit 1.5 --json", spheres.display()));
    let elapsed = start.elapsed();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(text(&output.stderr).contains("time limit reached"), "{output:?}");
    let json = one_line(&output);
    assert_eq!(json["stopped"], true);
    assert!(json["spp_done"].as_u64().is_some_and(|n| n >= 1), "{json}");
    // Tests run beside each other: room for a busy machine, but nowhere near the hours of the whole work.
    // To get ready counts.
    let [setup, rendering] = ["setup_s", "render_s"].map(|key| json[key].as_f64().unwrap());
    assert!((1.0..4.0).contains(&(setup.min(1.5) + rendering)), "{setup} and {rendering} s");
    assert!(elapsed < Duration::from_secs(30), "{elapsed:?}");
    assert_eq!(names(directory.path()), ["ball.toml", "out.pfm"]);
    let (image, _) = read(&directory.path().join("out.pfm")).unwrap();
    // Every pixel was rendered; in the closed room hardly any sample remains dark.
    let dark = image.pixels().iter().filter(|p| !p.iter().all(|&c| c > 0.0 && c.is_finite())).count();
    assert!(dark < 512 * 512 / 1000, "{dark} pixels without light");
}

#[test]
fn the_time_limit_leaves_no_pixel_out() {
    let directory = directory();
    // Its meshes make it one in which some tiles go ahead, to try whether paths are worth reusing; and so large that it
    // takes more than the dispatches that are begun at once.
    let cat = scene_path("cat");
    let output = run(
        directory.path(),
        &format!(
            "render {} --scheduler queue --size 1024x640 --samples 100000 -o out.pfm --time-limit 0.001 --json",
            cat.display()
        ),
    );
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let json = one_line(&output);
    assert_eq!(json["stopped"], true);
    assert!(json["spp_done"].as_u64().is_some_and(|n| n >= 1), "{json}");
    assert!(json["reuse_gain"].as_f64().is_some_and(|gain| gain > 0.0), "{json}");
    let (image, _) = read(&directory.path().join("out.pfm")).unwrap();
    let dark = image.pixels().iter().filter(|p| !p.iter().all(|&c| c > 0.0 && c.is_finite())).count();
    assert!(dark < 1024 * 640 / 1000, "{dark} pixels without light");
}

/// The program at work with such arguments, after Ctrl-C.
#[cfg(unix)]
fn interrupted(directory: &Path, arguments: &str) -> Child {
    let mut child =
        program(directory).args(arguments.split(' ')).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // Compiled and at work by then, even on a busy machine; if not, what it begins with still runs.
    std::thread::sleep(Duration::from_secs(4));
    assert!(child.try_wait().unwrap().is_none(), "the program ended by itself");
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    child
}

#[cfg(unix)]
#[test]
fn ctrl_c_writes_what_there_is() {
    let directory = directory();
    let child = interrupted(directory.path(), &format!("render {} {LONG} -o out.png", scene_path("spheres").display()));
    let start = Instant::now();
    let output = child.wait_with_output().unwrap();
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    assert!(text(&output.stderr).contains("interrupted after"), "{output:?}");
    assert!(output.stdout.is_empty(), "{output:?}");
    assert_eq!(names(directory.path()), ["ball.toml", "out.png"]);
    let (image, metadata) = read(&directory.path().join("out.png")).unwrap();
    assert_eq!(image.width(), 512);
    assert!(metadata.get("Samples").unwrap().parse::<f64>().unwrap() >= 1.0);
}

#[cfg(unix)]
#[test]
fn ctrl_c_lets_the_running_case_end_and_reports_the_others_as_not_run() {
    let directory = directory();
    let child = interrupted(directory.path(), "check --jobs 1 --json --junit report.xml");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    let cases = &one_line(&output)["devices"][0]["cases"];
    let cases = cases.as_array().unwrap();
    let left: Vec<_> = cases.iter().filter(|c| c["verdict"] == "not_run").collect();
    assert!(!left.is_empty() && left.iter().all(|c| c["message"] == "interrupted"), "{output:?}");
    assert!(text(&output.stderr).contains(&format!("{} not run", left.len())), "{output:?}");
    assert!(fs::read_to_string(directory.path().join("report.xml")).unwrap().contains("interrupted"));
}

/// What `nohup` and jobs in the background of a script ignore stays ignored; a second request ends the program at once.
#[cfg(unix)]
#[test]
fn signals_that_are_ignored_stay_ignored() {
    let directory = directory();
    let d = directory.path();
    let send = |signal: &str, child: &Child| {
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    };
    let arguments = format!("render ball.toml {LONG} --time-limit 6 -o out.pfm");
    let script = format!("trap '' HUP INT; exec \"$0\" {arguments}");
    let child = Command::new("sh")
        .current_dir(d)
        .args(["-c", &script, env!("CARGO_BIN_EXE_photolith")])
        .env("XDG_CACHE_HOME", common::CACHE)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_secs(3));
    send("-HUP", &child);
    send("-INT", &child);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(text(&output.stderr).contains("time limit reached"), "{output:?}");

    // A pipe without a reader is waited for a while: not after a second request.
    assert!(Command::new("mkfifo").arg(d.join("pipe.pfm")).status().unwrap().success());
    let child = interrupted(d, &format!("render ball.toml {LONG} -o pipe.pfm"));
    std::thread::sleep(Duration::from_millis(1500));
    let start = Instant::now();
    send("-TERM", &child);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
}
