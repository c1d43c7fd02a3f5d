//! `photolith info`.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use glam::DVec3;
use photolith::RenderSettings;
use photolith::accel::BvhStatistics;
use photolith::render::{Audience, Features, Prepared, Setting, explain};
use photolith::scene::Scene;
use serde_json::json;

use super::options::SceneOptions;
use super::text::{bytes, counted};
use super::{exit, heading, output};

/// Arguments of `photolith info`.
#[derive(Args)]
pub struct InfoArgs {
    /// Scene file (.toml) or mesh (.obj), or - for either of them from standard input
    #[arg(help_heading = heading::SCENE, display_order = 0)]
    scene: PathBuf,

    /// Print one line of JSON on stdout
    #[arg(long, help_heading = heading::OUTPUT)]
    json: bool,

    #[command(flatten)]
    options: SceneOptions,
}

/// Describes the scene. Needs no device.
pub fn run(args: &InfoArgs) -> anyhow::Result<ExitCode> {
    let (scene, settings) = args.options.load(&args.scene)?;
    let prepared = Prepared::of(&scene, &settings)?;
    let (features, bvh) = (prepared.features(), prepared.bvh());
    let text = if args.json {
        format!("{}\n", as_json(&scene, &settings, features, bvh))
    } else {
        as_text(&scene, &settings, features, bvh)
    };
    output::print(&text)?;
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

fn as_text(scene: &Scene, settings: &RenderSettings, features: &Features, bvh: Option<&BvhStatistics>) -> String {
    let b = bounds(scene);
    let film = &scene.film;
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{}", scene.source);
    let _ = writeln!(
        out,
        "  image      {}×{}, {} per pixel, depth {}",
        film.width,
        film.height,
        counted(scene.integrator.samples as usize, "sample", "samples"),
        scene.integrator.max_depth
    );
    let contents = [
        counted(scene.spheres.len(), "sphere", "spheres"),
        counted(scene.meshes.len(), "mesh", "meshes"),
        counted(scene.triangle_count(), "triangle", "triangles"),
        counted(scene.materials.len(), "material", "materials"),
        counted(scene.lights.len(), "point light", "point lights"),
    ];
    let _ = writeln!(out, "  contents   {}", contents.join(", "));
    let _ = writeln!(out, "  bounds     {} to {}", b.lo, b.hi);
    for mesh in &scene.meshes {
        let triangles = counted(mesh.triangles.len(), "triangle", "triangles");
        let dropped = match mesh.degenerate_dropped {
            0 => String::new(),
            n => format!(", {} dropped", counted(n, "degenerate face", "degenerate faces")),
        };
        let _ = writeln!(out, "  mesh       {}: {triangles}{dropped}", mesh.name);
    }
    for material in &scene.materials {
        let _ = writeln!(out, "  material   {}: {}", material.name, material.surface.bsdf.name());
    }
    if let Some(t) = bvh {
        let _ = writeln!(
            out,
            "  BVH        {}, {} of {}, depth {}, SAH cost {:.2}, {}, built in {:.3} s",
            counted(t.nodes, "node", "nodes"),
            counted(t.leaves, "leaf", "leaves"),
            counted(t.primitives, "primitive", "primitives"),
            t.depth,
            t.sah_cost,
            bytes(t.bytes as u64),
            t.build_seconds
        );
    }
    let techniques = Setting::ALL.iter().filter(|setting| matches!(setting.audience, Audience::Technique { .. }));
    let techniques: Vec<_> = techniques.map(|setting| format!("{} {}", setting.name, setting.get(settings))).collect();
    let _ = writeln!(out, "  techniques {}", techniques.join(", "));
    let features = explain(features);
    for (heading, compiled) in [("pipeline is specialised for", true), ("left out", false)] {
        let _ = writeln!(out, "  {heading}");
        for (name, _, why) in features.iter().filter(|f| f.1 == compiled) {
            let _ = writeln!(out, "    {name:<18} {why}");
        }
    }
    out
}

fn as_json(
    scene: &Scene,
    settings: &RenderSettings,
    features: &Features,
    bvh: Option<&BvhStatistics>,
) -> serde_json::Value {
    let b = bounds(scene);
    let explained: serde_json::Map<_, _> = explain(features)
        .into_iter()
        .map(|(name, on, why)| (name.to_owned(), json!({ "compiled": on, "why": why })))
        .collect();
    let settings: serde_json::Map<_, _> =
        Setting::ALL.iter().map(|setting| (setting.name.to_owned(), json!(setting.get(settings)))).collect();
    json!({
        "schema": "photolith-info-2",
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
        "materials": scene.materials.iter().map(|m| json!({ "name": m.name, "type": m.surface.bsdf.name() }))
            .collect::<Vec<_>>(),
        "point_lights": scene.lights.len(),
        "bounds": [b.lo.to_array(), b.hi.to_array()],
        "bvh": bvh.map(|t| json!({
            "nodes": t.nodes, "leaves": t.leaves, "primitives": t.primitives, "depth": t.depth,
            "sah_cost": t.sah_cost, "bytes": t.bytes, "build_s": t.build_seconds,
        })),
        "settings": settings,
        "features": explained,
    })
}
