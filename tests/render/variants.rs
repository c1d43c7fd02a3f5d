//! Ways of rendering a scene that may change no bit.
//!
//! Each subject is rendered by each scheduler, with and without a loop budget. What else is chosen (workgroups, samples a dispatch, the
//! general pipeline, the passage) goes round, so that any two choices meet in some rendering (a pairwise cover).

use photolith::RenderSettings;
use photolith::render::Scheduler;

/// What is rendered: a scene, and whether its paths are reused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Subject {
    Spheres,
    Glass,
    /// Paths of a group meet in the lanes of a subgroup.
    GlassReused,
    Cat,
    CatReused,
    /// Light is traced from the emitter as well.
    GlassCat,
    /// An emitter, and Russian roulette.
    Cornell,
}

const SUBJECTS: usize = Subject::Cornell as usize + 1;
/// Schedulers, with and without a loop budget.
const WAYS: usize = 8;
/// As on GPUs for [`Scheduler::Interleaved`], which is for them.
const SCHEDULERS: [(Scheduler, Option<bool>); 4] = [
    (Scheduler::Auto, None),
    (Scheduler::Inline, None),
    (Scheduler::Interleaved, Some(true)),
    (Scheduler::Queue, None),
];
/// Invocations in a workgroup, and such that share a pixel: `workgroup_size` and `split`.
const WORKGROUPS: [(Option<u32>, Option<u32>); 6] =
    [(None, None), (Some(8), None), (Some(32), None), (Some(64), None), (Some(128), None), (None, Some(4))];
const SAMPLES_PER_DISPATCH: [Option<u32>; 5] = [None, Some(1), Some(3), Some(7), Some(64)];

/// Choices of a rendering: of the subject, the scheduler, a loop budget, workgroups, samples a dispatch, the general pipeline, a passage.
const CHOICES: [usize; 7] = [SUBJECTS, SCHEDULERS.len(), 2, WORKGROUPS.len(), SAMPLES_PER_DISPATCH.len(), 2, 2];

/// What is chosen of each.
fn choice(subject: usize, way: usize) -> [usize; CHOICES.len()] {
    let workgroup = (way + subject) % WORKGROUPS.len();
    let samples = (way + 2 * subject) % SAMPLES_PER_DISPATCH.len();
    [subject, way / 2, way % 2, workgroup, samples, (way / 2 + subject) % 2, (way / 4 + subject) % 2]
}

/// A loop budget in which a sample of the scene ends, but not all samples of a dispatch: every path of the spheres has
/// 20 hits (two loops each in the general pipeline), and one of the cat takes some hundred steps through the BVH. With
/// a queue, all paths of a workgroup share the budget, and in the general pipeline all rays go through it.
pub fn small_budget(subject: Subject, scheduler: Scheduler) -> u32 {
    let queued = match scheduler {
        Scheduler::Inline | Scheduler::Interleaved => false,
        Scheduler::Queue | Scheduler::Auto => true,
    };
    match (subject, queued) {
        (Subject::Cat | Subject::CatReused, false) => 1500,
        (Subject::Cat, true) => 4000,
        // Half of it is for reusing the paths.
        (Subject::CatReused, true) => 8000,
        (Subject::GlassCat, false) => 1500,
        (Subject::GlassCat, true) => 4000,
        (Subject::Cornell, true) => 1000,
        (Subject::Spheres | Subject::Glass | Subject::GlassReused, true) => 15_000,
        (_, false) => 400,
    }
}

/// Every way of rendering the subject, whose usual settings are `base`.
pub fn variants(subject: Subject, base: &RenderSettings) -> Vec<RenderSettings> {
    let of = |way| {
        let [_, scheduler, budget, workgroup, samples, general, passage] = choice(subject as usize, way);
        let (scheduler, threads) = SCHEDULERS[scheduler];
        let (workgroup_size, split) = WORKGROUPS[workgroup];
        RenderSettings {
            scheduler,
            threads,
            workgroup_size,
            split,
            loop_budget: (budget == 1).then(|| small_budget(subject, scheduler)),
            samples_per_dispatch: SAMPLES_PER_DISPATCH[samples],
            general: general == 1,
            passage: (passage == 1).then_some(1 << 16),
            ..base.clone()
        }
    };
    (0..WAYS).map(of).collect()
}

#[test]
fn any_two_choices_meet() {
    let renderings: Vec<_> = (0..SUBJECTS).flat_map(|subject| (0..WAYS).map(move |way| choice(subject, way))).collect();
    for (i, &ways) in CHOICES.iter().enumerate() {
        for (j, &others) in CHOICES.iter().enumerate().skip(i + 1) {
            for (a, b) in (0..ways).flat_map(|a| (0..others).map(move |b| (a, b))) {
                assert!(renderings.iter().any(|r| r[i] == a && r[j] == b), "choice {a} of {i} never meets {b} of {j}");
            }
        }
    }
}
