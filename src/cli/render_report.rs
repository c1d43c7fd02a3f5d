//! What `photolith render` says about a rendering: in the image's file, in the checkpoint, and as JSON.

use std::path::Path;

use photolith::image::Metadata;
use photolith::render::{Setting, shaders_hash};
use photolith::scene::{Scene, fingerprint};
use photolith::{Context, RenderSettings, Renderer};
use serde_json::json;

use super::develop_options::Development;

/// What the image's file says of how it was made.
pub fn metadata(scene: &Scene, settings: &RenderSettings, context: &Context, renderer: &Renderer) -> Metadata {
    let mut m = Metadata::new();
    m.push("Software", format!("photolith {}", env!("CARGO_PKG_VERSION")));
    m.push("Scene", &scene.source);
    let statistics = renderer.statistics();
    m.push("Samples", statistics.mean_samples_per_pixel);
    if let Some(adaptive) = settings.adaptive {
        m.push("NoiseTarget", adaptive.noise);
    }
    if let Some(reached) = statistics.adaptive {
        m.push("Noise", reached.noise);
    }
    if let Some(limit) = settings.time_limit {
        m.push("TimeLimit", limit.as_secs_f64());
    }
    if statistics.stopped {
        m.push("Stopped", true);
    }
    if statistics.most_samples_per_pixel > statistics.samples_per_pixel {
        m.push("FewestSamples", statistics.samples_per_pixel);
        m.push("MostSamples", statistics.most_samples_per_pixel);
    }
    push_settings(&mut m, scene, settings, context);
    m
}

/// All that a sample depends on.
pub fn identity(scene: &Scene, settings: &RenderSettings, context: &Context) -> Metadata {
    let mut m = Metadata::new();
    m.push("Program", format!("photolith {}, shaders {:016x}", env!("CARGO_PKG_VERSION"), shaders_hash()));
    m.push("Size", format!("{}x{}", scene.film.width, scene.film.height));
    push_settings(&mut m, scene, settings, context);
    m.push("Scene", format!("{:016x}", fingerprint(scene)));
    m
}

fn push_settings(m: &mut Metadata, scene: &Scene, settings: &RenderSettings, context: &Context) {
    m.push("MaxDepth", scene.integrator.max_depth);
    m.push("Indirect", scene.integrator.indirect);
    m.push("RussianRoulette", scene.integrator.russian_roulette.map_or("off".to_owned(), |hit| hit.to_string()));
    for setting in Setting::ALL {
        if let Some(key) = setting.metadata {
            m.push(key, setting.get(settings));
        }
    }
    m.push("Filter", format!("{:?}", scene.film.filter));
    m.push("Device", &context.info().name);
    m.push("Driver", &context.info().driver);
}

/// The camera that was used.
fn camera(scene: &Scene) -> serde_json::Value {
    let camera = &scene.camera;
    let perspective = camera.orthographic_width.is_none();
    json!({
        "position": camera.position.to_array(),
        "target": camera.target.to_array(),
        "up": camera.up.to_array(),
        "horizontal_fov": perspective.then_some(camera.horizontal_fov),
        "orthographic_width": camera.orthographic_width,
        "lens_radius": camera.lens.map(|lens| lens.radius),
        "focus": camera.lens.map(|lens| lens.focus),
        "filter": format!("{:?}", scene.film.filter),
    })
}

/// What `--json` prints.
pub fn report(
    context: &Context,
    scene: &Scene,
    settings: &RenderSettings,
    renderer: &Renderer,
    development: Development,
    setup_seconds: f64,
    output: &Path,
) -> serde_json::Value {
    let s = renderer.statistics();
    let per_second = |n: u64| if s.render_seconds > 0.0 { n as f64 / s.render_seconds / 1e6 } else { 0.0 };
    let stages: serde_json::Map<_, _> = s.stages.iter().map(|t| (t.stage.to_owned(), json!(t.seconds))).collect();
    json!({
        "schema": "photolith-render-2",
        "output": output.display().to_string(),
        "camera": camera(scene),
        "exposure": development.exposure,
        "exposure_auto": development.auto,
        "tone": development.tone.name(),
        "transparent": development.transparent,
        "setup_s": setup_seconds,
        "render_s": s.render_seconds,
        "spp_done": s.samples_per_pixel,
        "spp_mean": s.mean_samples_per_pixel,
        "spp_most": s.most_samples_per_pixel,
        "adaptive": s.adaptive.map(|a| json!({
            "noise_target": settings.adaptive.map(|a| a.noise),
            "noise": a.noise,
            "noisiest_tile": a.noisiest_tile,
            "rounds": a.rounds,
            "unused_samples": a.unused_samples,
        })),
        "stopped": s.stopped,
        "samples": s.samples,
        "rays": s.rays,
        "shadow_rays": s.shadow_rays,
        "reused_samples": s.reused_samples,
        "multiplied_pixels": s.multiplied_pixels,
        "gradients": s.gradients,
        "light_paths": s.light_paths,
        "reuse_gain": s.reuse_gain,
        "bvh_steps": s.bvh_steps,
        "bad_samples": s.bad_samples,
        "msamples_per_s": per_second(s.samples),
        "mrays_per_s": per_second(s.rays + s.shadow_rays),
        "dispatches": s.dispatches,
        "stages_s": stages,
        "device": context.info().name,
        "driver": context.info().driver,
        "bvh": renderer.bvh().map(|t| json!({
            "nodes": t.nodes,
            "leaves": t.leaves,
            "primitives": t.primitives,
            "depth": t.depth,
            "sah_cost": t.sah_cost,
            "bytes": t.bytes,
            "build_s": t.build_seconds,
        })),
        "peak_device_bytes": context.memory().1,
        "version": env!("CARGO_PKG_VERSION"),
    })
}
