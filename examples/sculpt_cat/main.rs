//! Models a sitting cat as an implicit surface and writes it as a closed triangle mesh.
//!
//! `cargo run --release --example sculpt_cat -- [OUT.obj]`, by default to `assets/meshes/cat.obj`.
//! The same bytes on every run and machine.

mod cat;
mod field;
mod obj;
mod polygonize;

use cat::Cat;
use glam::{DVec3, dvec3, ivec3};
use polygonize::{Lattice, Mesh, march, relax};
use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let path = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("assets/meshes/cat.obj"), PathBuf::from);
    let mesh = sculpt();
    let text = obj::to_text(&mesh);
    if let Err(error) = obj::write_atomically(&path, &text) {
        eprintln!("{}: {error}", path.display());
        return ExitCode::FAILURE;
    }
    let (low, high) = bounds(&mesh);
    println!("{}: {} bytes", path.display(), text.len());
    println!("{} vertices, {} triangles", mesh.positions.len(), mesh.triangles.len());
    println!("bounds {low:.5} to {high:.5}");
    ExitCode::SUCCESS
}

/// The cat, scaled to a height of 1, centred on x = z = 0 and standing on y = 0.
fn sculpt() -> Mesh {
    let cat = Cat::new();
    let field = |p| cat.field(p);
    let lattice =
        Lattice { lower: dvec3(-0.53, -0.13, -0.62), spacing: 0.027, cells: ivec3(41, 52, 48), warp: |p| cat.focus(p) };
    let mut mesh = march(&field, &lattice);
    relax(&mut mesh, &field, 8);
    let (low, high) = bounds(&mesh);
    let foot = dvec3(0.5 * (low.x + high.x), low.y, 0.5 * (low.z + high.z));
    for p in &mut mesh.positions {
        *p = (*p - foot) / (high.y - low.y);
    }
    mesh
}

fn bounds(mesh: &Mesh) -> (DVec3, DVec3) {
    mesh.positions.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)))
}
