//! A folder for shaders changes no bit, whatever is in it.

use std::fs;

use photolith::gpu::DeviceKind;
use photolith::{Context, ContextOptions, RenderSettings, Validation};

use crate::harness::{assert_same_bits, render, shipped};

/// The folder holds a file for each kernel, which is made again if it is damaged: what the driver has made of it, or, under a
/// validation layer that does not know of shader objects (before 1.3.246) and on devices that have none, what it is given.
#[test]
fn kept_shaders_render_the_same_image() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = shipped("spheres", (32, 24), 4);
    let settings = RenderSettings::of(&scene);
    let without = Context::new(&ContextOptions { validation: Validation::Core, ..ContextOptions::default() });
    let without = without.expect("a device");
    let expected = render(&without, &scene, &settings);
    assert!(without.messages().all().is_empty(), "{:#?}", without.messages().all());
    let files = || -> Vec<_> {
        fs::read_dir(folder.path()).expect("a folder").map(|entry| entry.expect("a file").path()).collect()
    };
    let options = ContextOptions {
        validation: Validation::Core,
        shader_folder: Some(folder.path().to_owned()),
        ..ContextOptions::default()
    };
    // On CPUs that of the probe of loops, and what it has found (src/gpu/loops.rs).
    let expected_files = if without.info().kind == DeviceKind::Cpu { 3 } else { 1 };
    for run in ["first", "again", "of a damaged file", "after that"] {
        let context = Context::new(&options).expect("a device");
        assert_same_bits(&render(&context, &scene, &settings), &expected, run);
        // Each by itself: opened once more, the device has the same folder.
        let again = context.reopen().expect("the device once more");
        assert_same_bits(&render(&again, &scene, &settings), &expected, run);
        for context in [context, again] {
            assert!(context.messages().all().is_empty(), "{run}: {:#?}", context.messages().all());
        }
        assert_eq!(files().len(), expected_files, "{run}: {:?}", files());
        if run == "again" {
            for file in files() {
                let whole = fs::read(&file).expect("a file");
                fs::write(&file, &whole[..whole.len() / 2]).expect("a file");
            }
        }
    }
}
