//! Wavefront OBJ output.

use crate::polygonize::Mesh;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

/// The mesh as OBJ text, coordinates to five decimals.
pub fn to_text(mesh: &Mesh) -> String {
    let mut text = String::from(
        "# A sitting cat, y up, facing +z, one unit tall: an implicit surface, polygonised.\n\
         # Made by photolith: cargo run --release --example sculpt_cat\n\
         # Licence: CC0-1.0 (public domain dedication)\n\
         o cat\n",
    );
    for p in &mesh.positions {
        let [x, y, z] = p.to_array().map(coordinate);
        // Writing to a String cannot fail.
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text
}

/// Five decimals without trailing zeros, and without a negative zero.
fn coordinate(value: f64) -> String {
    let fixed = format!("{value:.5}");
    let short = fixed.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { String::from("0") } else { String::from(short) }
}

/// Writes `text` to `path` so that a reader sees the old file or the new one, never a part.
///
/// # Errors
/// Whatever the file system reports; the temporary file is removed then.
pub fn write_atomically(path: &Path, text: &str) -> io::Result<()> {
    let temporary = path.with_extension("obj.tmp");
    std::fs::write(&temporary, text).and_then(|()| std::fs::rename(&temporary, path)).inspect_err(|_| {
        // The first error is the one to report.
        let _ = std::fs::remove_file(&temporary);
    })
}
