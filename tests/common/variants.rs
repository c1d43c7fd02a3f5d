//! Ways of rendering a scene.

use photolith::render::{Feature, Reuse, Scheduler};
use photolith::{RenderSettings, Scene};

/// A loop budget in which a sample of the scene ends, but not all samples of a dispatch: every path of the spheres has
/// 20 hits (two loops each in the general pipeline), and one of the cat takes some hundred steps through the tree. With
/// a queue, all paths of a workgroup share the budget, and in the general pipeline all rays go through it.
pub fn small_budget(name: &str, scheduler: Scheduler, reused: bool) -> u32 {
    match (name, scheduler) {
        ("cat", Scheduler::Inline | Scheduler::Interleaved) => 1500,
        ("glass cat", Scheduler::Inline | Scheduler::Interleaved) => 1500,
        ("glass cat", Scheduler::Queue | Scheduler::Auto) => 4000,
        (_, Scheduler::Inline | Scheduler::Interleaved) => 400,
        // Half of it is for reusing the paths.
        ("cat", Scheduler::Queue | Scheduler::Auto) if reused => 8000,
        ("cat", Scheduler::Queue | Scheduler::Auto) => 4000,
        ("cornell", Scheduler::Queue | Scheduler::Auto) => 1000,
        (_, Scheduler::Queue | Scheduler::Auto) => 15_000,
    }
}

/// Every way of rendering that may change no bit.
pub fn variants(name: &str, scene: &Scene, reuse: Reuse) -> Vec<(String, RenderSettings)> {
    let base = RenderSettings { reuse, ..RenderSettings::of(scene) };
    // Only the cat is in a tree.
    let reused = reuse == Reuse::Auto && name == "cat";
    let mut all = vec![("a second run".to_owned(), base.clone())];
    for n in [1, 3, 7, 64] {
        all.push((
            format!("{n} samples per dispatch"),
            RenderSettings { samples_per_dispatch: Some(n), ..base.clone() },
        ));
    }
    for n in [8, 64, 128] {
        all.push((format!("workgroups of {n}"), RenderSettings { workgroup_size: Some(n), ..base.clone() }));
    }
    all.push(("the film through a passage".to_owned(), RenderSettings { passage: Some(1 << 16), ..base.clone() }));
    all.push(("general pipeline".to_owned(), RenderSettings { general: true, ..base.clone() }));
    for (feature, unneeded) in Feature::ALL {
        all.push((format!("+{feature}"), RenderSettings { unneeded: Some(unneeded), ..base.clone() }));
    }
    for scheduler in [Scheduler::Inline, Scheduler::Interleaved, Scheduler::Queue] {
        // As on GPUs, which that is for.
        let threads = (scheduler == Scheduler::Interleaved).then_some(true);
        let base = RenderSettings { threads, ..base.clone() };
        let budget = Some(small_budget(name, scheduler, reused));
        all.push((format!("{scheduler:?}"), RenderSettings { scheduler, ..base.clone() }));
        all.push((
            format!("{scheduler:?}, loop budget {budget:?}"),
            RenderSettings { scheduler, loop_budget: budget, ..base.clone() },
        ));
        all.push((
            format!("{scheduler:?}, all at once"),
            RenderSettings {
                scheduler,
                samples_per_dispatch: Some(5),
                workgroup_size: Some(32),
                loop_budget: budget,
                general: true,
                ..base.clone()
            },
        ));
    }
    for scheduler in [Scheduler::Inline, Scheduler::Interleaved] {
        let split = RenderSettings { scheduler, split: Some(4), ..base.clone() };
        all.push((format!("{scheduler:?}, split"), split.clone()));
        let loop_budget = Some(small_budget(name, scheduler, reused));
        all.push((
            format!("{scheduler:?}, split, all at once"),
            RenderSettings { samples_per_dispatch: Some(5), loop_budget, general: true, ..split },
        ));
    }
    all
}
