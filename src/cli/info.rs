//! `photolith info`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use glam::DVec3;
use photolith::accel::TreeStatistics;
use photolith::render::Features;
use photolith::scene::{Scene, Surface};
use serde_json::json;

use super::devices::bytes;
use super::exit;
use super::options::SceneOptions;

/// Arguments of `photolith info`.
#[derive(Args)]
pub struct InfoArgs {
    /// Scene file (.toml) or mesh (.obj)
    scene: PathBuf,

    #[command(flatten)]
    options: SceneOptions,

    /// Print one line of JSON on stdout
    #[arg(long)]
    json: bool,
}

/// Describes the scene. Needs no device.
pub fn run(args: &InfoArgs) -> anyhow::Result<ExitCode> {
    let (scene, settings) = args.options.load(&args.scene)?;
    let features = Features::of(&scene, &settings);
    let tree = photolith::render::tree_statistics(&scene, &settings);
    if args.json {
        println!("{}", as_json(&scene, &features, tree.as_ref()));
    } else {
        print_text(&scene, &features, tree.as_ref());
    }
    Ok(ExitCode::from(exit::OK))
}

struct Bounds {
    lo: DVec3,
    hi: DVec3,
}

fn bounds(scene: &Scene) -> Bounds {
    let start = Bounds { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY };
    let points = scene.meshes.iter().flat_map(|m| m.positions.iter().map(|&p| (p, 0.0)));
    let spheres = scene.spheres.iter().map(|s| (s.center, s.radius));
    points.chain(spheres).fold(start, |b, (p, r)| Bounds { lo: b.lo.min(p - r), hi: b.hi.max(p + r) })
}

fn kind(surface: &Surface) -> &'static str {
    match surface {
        Surface::Diffuse { .. } => "diffuse",
        Surface::Mirror { .. } => "mirror",
        Surface::Dielectric { .. } => "dielectric",
        Surface::Emitter { .. } => "emitter",
    }
}

fn print_text(scene: &Scene, features: &Features, tree: Option<&TreeStatistics>) {
    let b = bounds(scene);
    let film = &scene.film;
    println!("{}", scene.source);
    println!(
        "  image      {}×{}, {} samples per pixel, depth {}",
        film.width, film.height, scene.integrator.samples, scene.integrator.max_depth
    );
    println!(
        "  contents   {} spheres, {} meshes, {} triangles, {} materials, {} point lights",
        scene.spheres.len(),
        scene.meshes.len(),
        scene.triangle_count(),
        scene.materials.len(),
        scene.lights.len()
    );
    println!("  bounds     {} to {}", b.lo, b.hi);
    for mesh in &scene.meshes {
        let dropped = match mesh.degenerate_dropped {
            0 => String::new(),
            n => format!(", {n} degenerate faces dropped"),
        };
        println!("  mesh       {}: {} triangles{dropped}", mesh.name, mesh.triangles.len());
    }
    for material in &scene.materials {
        println!("  material   {}: {}", material.name, kind(&material.surface));
    }
    if let Some(t) = tree {
        println!(
            "  tree       {} nodes, {} leaves of {} primitives, depth {}, SAH cost {:.2}, {}, built in {:.3} s",
            t.nodes,
            t.leaves,
            t.primitives,
            t.depth,
            t.sah_cost,
            bytes(t.bytes as u64),
            t.build_seconds
        );
    }
    println!("  pipeline is specialised for");
    let features = features.explain();
    for (name, _, why) in features.iter().filter(|f| f.1) {
        println!("    {name:<18} {why}");
    }
    println!("  left out");
    for (name, _, why) in features.iter().filter(|f| !f.1) {
        println!("    {name:<18} {why}");
    }
}

fn as_json(scene: &Scene, features: &Features, tree: Option<&TreeStatistics>) -> serde_json::Value {
    let b = bounds(scene);
    let explained: serde_json::Map<_, _> = features
        .explain()
        .into_iter()
        .map(|(name, on, why)| (name.to_owned(), json!({ "compiled": on, "why": why })))
        .collect();
    json!({
        "schema": "photolith-info-1",
        "scene": scene.source,
        "width": scene.film.width,
        "height": scene.film.height,
        "samples": scene.integrator.samples,
        "max_depth": scene.integrator.max_depth,
        "spheres": scene.spheres.len(),
        "meshes": scene.meshes.iter().map(|m| json!({
            "name": m.name, "triangles": m.triangles.len(), "degenerate_dropped": m.degenerate_dropped
        })).collect::<Vec<_>>(),
        "triangles": scene.triangle_count(),
        "materials": scene.materials.iter().map(|m| json!({ "name": m.name, "type": kind(&m.surface) }))
            .collect::<Vec<_>>(),
        "point_lights": scene.lights.len(),
        "bounds": [b.lo.to_array(), b.hi.to_array()],
        "tree": tree.map(|t| json!({
            "nodes": t.nodes, "leaves": t.leaves, "primitives": t.primitives, "depth": t.depth,
            "sah_cost": t.sah_cost, "bytes": t.bytes, "build_s": t.build_seconds,
        })),
        "features": explained,
    })
}
