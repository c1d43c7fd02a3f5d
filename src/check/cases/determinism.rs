//! The same bits, however the work is cut up.

use std::ops::ControlFlow;

use crate::check::lab::{Rendered, pixels_that_differ};
use crate::check::scenes::{Build, divided_room, emitters, room};
use crate::check::{Case, CheckError, Lab, Measured};
use crate::render::{Accel, RenderSettings, Renderer, Reuse, Scheduler, TriangleTest};
use crate::scene::Scene;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "determinism/repeat",
        what: "a room rendered twice, its paths reused",
        oracle: "the first image",
        quantity: "pixels whose bits differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| variants(lab, &divided_room(), |_| (), &[|_| ()]),
    },
    Case {
        name: "determinism/split",
        what: "one sample a dispatch, workgroups of 8 and 96, a small loop budget, with paths reused and not, all schedulers, lanes as threads of a GPU, \
               several invocations a pixel",
        oracle: "the image as usual",
        quantity: "pixels whose bits differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| {
            let cuts: [Change; 3] =
                [|s| s.samples_per_dispatch = Some(1), |s| s.workgroup_size = Some(8), |s| s.workgroup_size = Some(96)];
            let ways: [Change; 2] = [|s| s.scheduler = Scheduler::Inline, |s| s.scheduler = Scheduler::Queue];
            // Half of a budget is for reusing the paths.
            let with_reuse: [Change; 4] = [
                |s| s.threads = Some(true),
                |s| (s.scheduler, s.threads) = (Scheduler::Queue, Some(true)),
                |s| s.loop_budget = Some(1400),
                |s| (s.scheduler, s.loop_budget) = (Scheduler::Queue, Some(1400)),
            ];
            let without: [Change; 7] = [
                |s| s.loop_budget = Some(700),
                |s| s.threads = Some(true),
                |s| (s.scheduler, s.workgroup_size) = (Scheduler::Interleaved, Some(96)),
                |s| (s.scheduler, s.threads) = (Scheduler::Interleaved, Some(true)),
                |s| (s.scheduler, s.split, s.loop_budget) = (Scheduler::Inline, Some(2), Some(700)),
                |s| (s.scheduler, s.split, s.samples_per_dispatch) = (Scheduler::Interleaved, Some(4), Some(3)),
                |s| (s.scheduler, s.threads, s.loop_budget) = (Scheduler::Interleaved, Some(true), Some(700)),
            ];
            let (scene, off): (_, Change) = (divided_room(), |s| s.reuse = Reuse::Off);
            let reused = variants(lab, &scene, |s| s.reuse = Reuse::Always, &[&cuts[..], &ways, &with_reuse].concat())?;
            let plain = variants(lab, &scene, off, &[&cuts[..], &ways, &without].concat())?;
            let turns: [Change; 3] = [
                |s| (s.scheduler, s.split) = (Scheduler::Inline, Some(8)),
                |s| s.scheduler = Scheduler::Interleaved,
                |s| (s.scheduler, s.threads, s.samples_per_dispatch) = (Scheduler::Interleaved, Some(true), Some(1)),
            ];
            let mut emitters = emitters();
            emitters.size(32, 4);
            let lit = variants(lab, &emitters, off, &turns)?;
            Ok(Measured::new(reused.value + plain.value + lit.value, "24 variants, 1024 pixels".to_owned()))
        },
    },
    Case {
        name: "determinism/general",
        what: "the pipeline with every feature compiled in",
        oracle: "the pipeline specialised for the scene",
        quantity: "pixels whose bits differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| variants(lab, &room(), |_| (), &[|s| s.general = true]),
    },
    Case {
        name: "determinism/no-bvh",
        what: "the BVH, by both schedulers and with both triangle tests",
        oracle: "every triangle tested",
        quantity: "pixels whose bits differ",
        threshold: 0.0,
        full_only: false,
        measure: |lab| {
            let bvh: [Change; 2] = [
                |s| (s.accel, s.scheduler) = (Accel::Bvh, Scheduler::Inline),
                |s| (s.accel, s.scheduler) = (Accel::Bvh, Scheduler::Queue),
            ];
            let tests: [Change; 2] = [
                |s| (s.reuse, s.accel) = (Reuse::Off, Accel::None),
                |s| (s.reuse, s.accel, s.triangle_test) = (Reuse::Off, Accel::None, TriangleTest::MollerTrumbore),
            ];
            let scene = divided_room();
            let [watertight, other] = tests.map(|base| variants(lab, &scene, base, &bvh));
            Ok(Measured::new(watertight?.value + other?.value, "4 variants, 1024 pixels".to_owned()))
        },
    },
    Case {
        name: "determinism/stopped",
        what: "a rendering without reuse that is stopped before its end, as by a time limit",
        oracle: "the image of as many samples as were done",
        quantity: "pixels whose bits differ",
        threshold: 0.0,
        full_only: false,
        measure: stopped,
    },
];

type Change = fn(&mut RenderSettings);

fn variants(lab: &Lab, scene: &Scene, base: Change, changes: &[Change]) -> Result<Measured, CheckError> {
    let mut usual_settings = lab.settings(scene);
    base(&mut usual_settings);
    let usual: Rendered = lab.render_with(scene, &usual_settings)?;
    let mut differ = 0;
    for change in changes {
        let mut settings = usual_settings.clone();
        change(&mut settings);
        differ += usual.differing(&lab.render_with(scene, &settings)?);
    }
    Ok(pixels_that_differ(&usual.film, differ, format!("{} variant(s), 1024 pixels", changes.len())))
}

fn stopped(lab: &Lab) -> Result<Measured, CheckError> {
    let mut scene = room();
    scene.integrator.samples = 64;
    let mut settings = lab.settings(&scene);
    settings.samples_per_dispatch = Some(3);
    // How paths are shared depends on how many samples are asked for.
    settings.reuse = Reuse::Off;
    let mut renderer = Renderer::new(&lab.context, &scene, &settings)?;
    let film =
        renderer.render(|p| if 4 * p.done > p.total { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })?;
    let statistics = renderer.statistics().clone();
    let done = film.counts()[0];
    // The same sampler, for which 64 samples or some of them make no difference.
    settings.samples = done;
    let expected = lab.render_with(&scene, &settings)?;
    let differ = expected.differing(&Rendered { film, statistics });
    if done == 0 || done == 64 {
        return Ok(Measured::new(f64::INFINITY, format!("{done} of 64 samples were done")));
    }
    Ok(Measured::new(differ as f64, format!("stopped after {done} of 64 samples")))
}
