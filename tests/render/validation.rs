//! Synchronization validation has nothing to say about any shipped scene, nor has GPU-assisted validation about ray queries. (All other
//! tests here run under core validation; that a layer would say something is tested with `check`.)

use std::ops::ControlFlow;

use photolith::render::{Accel, QueryBuild, Reuse, Scheduler, TriangleTest};
use photolith::{Context, RenderSettings, Renderer, Validation};

use crate::harness::{SCENES, render, shipped, spheres_and_cat, watched};

/// Renders every scene small, with several dispatches in flight, each with the settings that compile other code.
fn render_everything(context: &Context) {
    for name in SCENES {
        let scene = shipped(name, (16, 12), 4);
        let settings = RenderSettings { samples_per_dispatch: Some(1), ..RenderSettings::of(&scene) };
        render(context, &scene, &settings);
    }
    let scene = shipped("cornell", (16, 12), 4);
    let base = RenderSettings { samples_per_dispatch: Some(1), ..RenderSettings::of(&scene) };
    for settings in [
        RenderSettings { general: true, ..base.clone() },
        RenderSettings { count_steps: true, ..base.clone() },
        RenderSettings { accel: Accel::None, triangle_test: TriangleTest::MollerTrumbore, ..base.clone() },
        RenderSettings { scheduler: Scheduler::Inline, loop_budget: Some(500), ..base.clone() },
        RenderSettings { scheduler: Scheduler::Queue, loop_budget: Some(500), ..base.clone() },
        RenderSettings { passage: Some(1 << 10), ..base.clone() },
    ] {
        render(context, &scene, &settings);
    }
    // Paths on their own, then such that serve several pixels.
    let mesh = shipped("cat", (16, 12), 4);
    let own = RenderSettings { samples_per_dispatch: Some(1), reuse: Reuse::Off, ..RenderSettings::of(&mesh) };
    let reused = RenderSettings { reuse: Reuse::Always, ..own.clone() };
    for settings in [
        RenderSettings { scheduler: Scheduler::Interleaved, threads: Some(true), ..own.clone() },
        RenderSettings { scheduler: Scheduler::Interleaved, split: Some(4), ..own.clone() },
        RenderSettings { scheduler: Scheduler::Inline, split: Some(4), ..own },
        RenderSettings { scheduler: Scheduler::Inline, ..reused.clone() },
        RenderSettings { scheduler: Scheduler::Queue, ..reused.clone() },
        RenderSettings { passage: Some(1 << 10), ..reused },
    ] {
        render(context, &mesh, &settings);
    }
    if context.info().ray_query.is_some() {
        render_by_queries(context);
    }
    // One renderer, used again, and stopped early.
    let mut renderer = Renderer::new(context, &scene, &base).expect("a renderer");
    renderer.render(|_| ControlFlow::Continue(())).expect("a film");
    let film = renderer.render(|_| ControlFlow::Break(())).expect("a film");
    assert!(renderer.statistics().stopped && film.counts().iter().all(|&n| n < 4));
}

/// Of meshes, alone and among spheres.
fn render_by_queries(context: &Context) {
    for scene in [shipped("cat", (16, 12), 4), spheres_and_cat((16, 12), 4)] {
        for accel in [Accel::RayQuery, Accel::RayQueryTriangles] {
            for query_build in [QueryBuild::Plain, QueryBuild::Compacted] {
                let settings = RenderSettings { accel, query_build, ..RenderSettings::of(&scene) };
                render(context, &scene, &settings);
            }
        }
    }
}

/// Where there are ray queries, and a layer that looks into them.
#[test]
fn gpu_assisted_validation_of_ray_queries_is_silent() {
    let core = watched(Validation::Core);
    if core.info().ray_query.is_some() && core.validation_layer().is_some_and(|version| version >= (1, 4, 300)) {
        render_by_queries(&watched(Validation::GpuAssisted));
    }
}

#[test]
fn synchronization_validation_is_silent() {
    // The device fails the test when it is dropped, if there was a message.
    render_everything(&watched(Validation::Synchronization));
}
