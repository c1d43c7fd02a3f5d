//! Which scheduler a rendering gets: whether rays wait for each other before they walk the tree (shaders/path_queue.comp), or lanes
//! shade and walk in turns (shaders/path_turns.comp).

use super::super::driver::DriverFacts;
use super::super::features::Features;
use super::super::kernels::Schedule;
use super::super::settings::Scheduler;

/// Expected records that a ray reads in the tree (its SAH cost) from which on it pays to let rays wait for each other.
/// Lavapipe 22.3.6 (for 25.0.7, see below): at 2.3 that takes 1.1 to 1.25 times the time, at 5 1.06, at 6.8 .9 to 1.03, at 12 .84, at 20
/// less by a fifth to a third.
const FAR_WALK: f64 = 8.0;
/// The same where a driver skips branches that no lane takes, if the tree is seen in so much of the picture. Lavapipe 25.0.7: at 2.3 to 3
/// the queue takes .94 to 1.2 times the time, at 5.2 .85 and at 6.8 .79 to .93 (heaps of balls), at 5.95 1.0 (lamps), at 7.8 .87 to
/// .94 (a ball of 80 triangles in a room), but 1.25 where that is small.
const FAR_WALK_IN_SIGHT: f64 = 4.0;
/// So much of the picture.
const IN_SIGHT: f64 = 0.1;
/// From how many on it pays where the lanes of a group exchange their paths, which without waiting are in registers already: at 13 the
/// queue takes 1.03 times the time, at 17 a cat that fills the view takes 1.0, at 18 a mesh in a room .82 (25.0.7).
const FAR_WALK_OF_GROUPS: f64 = 14.0;
/// The same of groups on drivers that execute branches which no lane takes. Lavapipe 22.3.6, 16 and 64 samples: at 12 the queue takes 1.4
/// times the time, at 14.5 (an armadillo under a lamp) 1.1, at 15.9 1.16 (a cat in a room) and .92 to .96 (a bunny), at 17.8 (a height
/// field under a lamp) 1.15 to 1.23, at 22.4 1.0 (a dragon in a room under a lamp) and .84 (the same under a point).
const FAR_WALK_OF_GROUPS_IN_ALL_BRANCHES: f64 = 18.0;
/// Where a driver skips branches that no lane takes, it pays too if most rays come near the tree: from so many records on that a ray
/// from the camera reads, whether it meets the tree or not. Lavapipe 25.0.7, paths reused: at 1.0 (small meshes in rooms) the queue
/// takes .97 to 1.0 of the time, at 3 .82, at 3.4 .73, at 5 (among 64 lamps) .86, at 8 (300 spheres) .80. Where there is glass, paths
/// differ so much in length that it pays on other drivers too: with 16 samples 22.3.6 takes .71 to 1.09, .89 in the mean (seven scenes);
/// unless lanes read each other's registers in one instruction, when it takes 1.0 to 1.3 times the time (six scenes).
const SEEN_WALK: f64 = 2.0;
/// What a record of these counts: other rays read more.
const OF_SEEN: f64 = 2.0;
/// Samples times records beyond these from which on a rendering gains what it takes longer to start with the larger kernel: .12
/// to .2 s, where a sample gains 35 to 150 ns for each record (22.3.6).
const LONG_RENDERING: f64 = 1.5e6;
/// The same where what the driver has made of the kernel is kept, but of samples times the square of these records: of the
/// time that is gained, 15 to 80 ns for each, times the part of the whole that it is. There only the first start of all takes
/// longer, by .4 to .8 s, for which a tenth of a short rendering is too little (16 samples of a bunny in a room), a third of it
/// is not (2 samples of dragons). (25.0.7.)
const WORTH_OF_FIRST_START: f64 = 1.5e7;

/// What the choice depends on.
pub(super) struct Job<'a> {
    pub features: &'a Features,
    pub facts: &'a DriverFacts,
    /// The tree's SAH cost; none without a tree.
    pub sah_cost: Option<f64>,
    /// The part of the picture that shows boxes around the tree.
    pub seen: f64,
    /// All that does not emit is in the tree, and the camera and the lights are outside of it.
    pub seen_from_outside: bool,
    /// What the driver makes of kernels is kept between starts.
    pub keeps_kernels: bool,
    /// Of all pixels together.
    pub samples: f64,
    /// Paths may serve several pixels.
    pub reuse: bool,
}

impl Job<'_> {
    /// How rays are scheduled.
    pub fn schedule(&self, scheduler: Scheduler) -> Schedule {
        let groups_meet_in_memory = self.reuse && !self.facts.groups_fit;
        // Among lights, of which one is chosen, and where paths are reused, a kernel holds too much for more: with lamps it needs 163
        // registers instead of 92, and takes 1.1 to 2.4 times as long; with one point .70 (a bunny in a room) to .81 (a dragon of
        // glass) (H100, 1024×1024).
        let one_light = self.features.lights <= 1 && !self.features.emitter;
        let turns_pay = self.features.tree && one_light;
        let choice = match scheduler {
            _ if self.features.brute_force => Schedule::Inline,
            _ if groups_meet_in_memory => Schedule::Queue,
            Scheduler::Auto if self.facts.queue && self.waiting_pays() => Schedule::Queue,
            Scheduler::Auto if self.facts.threads && turns_pay => Schedule::Turns,
            Scheduler::Auto | Scheduler::Inline => Schedule::Inline,
            Scheduler::Turns if self.features.tree => Schedule::Turns,
            Scheduler::Turns => Schedule::Inline,
            Scheduler::Queue if self.features.tree || self.reuse => Schedule::Queue,
            Scheduler::Queue => Schedule::Inline,
        };
        if choice == Schedule::Turns && self.reuse { Schedule::Inline } else { choice }
    }

    fn waiting_pays(&self) -> bool {
        let Some(sah_cost) = self.sah_cost else { return false };
        // Where all surfaces are in the tree, all rays are led to it, and the lanes of a group have them at the same time (a
        // bunny, an armadillo, a dragon and a landscape without anything else): there waiting takes lavapipe 22.3.6, which
        // executes branches that no lane takes, 1.04 to 1.4 times the time; 25.0.7 1.0, .9, .91 and .84.
        if self.reuse && !self.facts.skips_branches && self.features.constant_spheres + self.features.facets == 0 {
            return false;
        }
        // Of an object or a landscape that is alone, lit and seen from outside, paths are short too, and where groups have them at
        // the same time waiting takes 1.03 to 1.22 times the time (25.0.7: an armadillo, height fields; without reuse .88 to 1.2, an
        // armadillo of glass on a plane .98).
        let specular = self.features.mirror || self.features.dielectric;
        if self.reuse && self.seen_from_outside && !specular {
            return false;
        }
        // Paths of one hit are short: where all have their shadow ray at the same time, waiting takes 1.08 to 1.25 times the time on
        // 25.0.7 (terrain, meshes in rooms). Among lights the choice takes longer than the rays, and not always as long: there it
        // takes .83 to 1.04 (one room of 64 lights 1.12). 22.3.6 takes 1.04 to 1.45 with either.
        let one_light = self.features.lights <= 1 && !self.features.emitter;
        if !self.features.has_long_paths() && (one_light || !self.facts.skips_branches) {
            return false;
        }
        let far = match (self.reuse, self.facts.skips_branches) {
            (false, true) if self.seen >= IN_SIGHT => FAR_WALK_IN_SIGHT,
            (false, _) => FAR_WALK,
            (true, true) => FAR_WALK_OF_GROUPS,
            (true, false) => FAR_WALK_OF_GROUPS_IN_ALL_BRANCHES,
        };
        let seen_counts =
            self.reuse && (self.facts.skips_branches || (self.features.dielectric && !self.facts.shuffles));
        let of_seen = if seen_counts { OF_SEEN * (sah_cost * self.seen - SEEN_WALK) } else { 0.0 };
        let records = (sah_cost - far).max(of_seen).max(0.0);
        if self.keeps_kernels {
            records * records * self.samples >= WORTH_OF_FIRST_START
        } else {
            records * self.samples >= LONG_RENDERING
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::driver::Sharers;
    use super::super::super::settings::RenderSettings;
    use super::*;
    use crate::bench::generate::terrain;
    use crate::check::scenes::{Build, divided_room, glass, lamps, room, v};
    use crate::scene::Scene;

    const GPU: DriverFacts = DriverFacts {
        loop_budget: 1 << 20,
        workgroup_size: 128,
        queue: false,
        reuse: Sharers::Threads,
        threads: true,
        shuffles: true,
        groups_fit: true,
        invocations: 1 << 19,
        skips_branches: true,
        queue_regions: 1024,
    };

    /// A CPU.
    const LANES: DriverFacts = DriverFacts { queue: true, reuse: Sharers::Lanes, threads: false, ..GPU };

    /// One whose driver executes branches that no lane takes.
    const LANES_IN_ALL_BRANCHES: DriverFacts = DriverFacts { skips_branches: false, shuffles: false, ..LANES };

    fn chosen(scene: &Scene, facts: &DriverFacts, reuse: bool, scheduler: Scheduler) -> Schedule {
        chosen_for_walks_of(20.0, 1.0, scene, facts, reuse, scheduler)
    }

    /// Of so many records, in a tree that so much of the picture shows.
    fn chosen_for_walks_of(
        records: f64,
        seen: f64,
        scene: &Scene,
        facts: &DriverFacts,
        reuse: bool,
        scheduler: Scheduler,
    ) -> Schedule {
        let features = Features::of(scene, &RenderSettings::of(scene));
        let sah_cost = features.tree.then_some(records);
        let keeps_kernels = true;
        let seen_from_outside = false;
        let samples = 1e9;
        let job = Job { features: &features, facts, sah_cost, seen, seen_from_outside, keeps_kernels, samples, reuse };
        job.schedule(scheduler)
    }

    #[test]
    fn threads_take_turns_in_a_tree_under_one_point() {
        let auto = |scene: &Scene, reuse| chosen(scene, &GPU, reuse, Scheduler::Auto);
        assert_eq!(auto(&divided_room(), false), Schedule::Turns);
        // Paths are shared by the lanes of a subgroup.
        assert_eq!(auto(&divided_room(), true), Schedule::Inline);
        assert_eq!(auto(&lamps(), false), Schedule::Inline);
        assert_eq!(auto(&room(), false), Schedule::Inline);
    }

    #[test]
    fn lanes_of_a_cpu_let_rays_wait() {
        for reuse in [false, true] {
            assert_eq!(chosen(&divided_room(), &LANES, reuse, Scheduler::Auto), Schedule::Queue);
        }
        assert_eq!(chosen(&room(), &LANES, true, Scheduler::Auto), Schedule::Inline);
    }

    #[test]
    fn rays_wait_where_walks_are_long() {
        let waits = |records, seen, facts: &DriverFacts, reuse| {
            chosen_for_walks_of(records, seen, &divided_room(), facts, reuse, Scheduler::Auto) == Schedule::Queue
        };
        // Without sharing paths.
        assert_eq!([3.0, 5.0].map(|records| waits(records, 1.0, &LANES, false)), [false, true]);
        assert_eq!([7.0, 9.0].map(|records| waits(records, 0.05, &LANES, false)), [false, true]);
        assert_eq!([7.0, 9.0].map(|records| waits(records, 1.0, &LANES_IN_ALL_BRANCHES, false)), [false, true]);
        // All of the picture shows the tree.
        assert_eq!([1.0, 16.0].map(|records| waits(records, 1.0, &LANES, true)), [false, true]);
        assert_eq!(
            [9.0, 16.0, 19.0].map(|records| waits(records, 1.0, &LANES_IN_ALL_BRANCHES, true)),
            [false, false, true]
        );
    }

    #[test]
    fn rays_wait_if_that_gains_what_the_larger_kernel_takes_longer_to_start() {
        let scene = divided_room();
        let features = &Features::of(&scene, &RenderSettings::of(&scene));
        // With so many records beyond those of walks that are too short.
        let waits = |records: f64, samples, keeps_kernels| {
            let job = Job {
                features,
                facts: &LANES,
                sah_cost: Some(FAR_WALK_OF_GROUPS + records),
                seen: 0.0,
                seen_from_outside: false,
                keeps_kernels,
                samples,
                reuse: true,
            };
            job.schedule(Scheduler::Auto) == Schedule::Queue
        };
        let (few, many) = (131_072.0, 1_048_576.0);
        assert_eq!([(2.0, many), (16.0, few)].map(|(records, samples)| waits(records, samples, true)), [false, true]);
        assert_eq!([(1.0, many), (2.0, many)].map(|(records, samples)| waits(records, samples, false)), [false, true]);
        assert!(!waits(-9.0, 1e12, true) && !waits(-9.0, 1e12, false));
    }

    #[test]
    fn rays_wait_where_glass_is_seen() {
        let mut scene = divided_room();
        scene.sphere(v(0.0, 0.5, -4.0), 0.3, glass(1.5));
        let waits = |seen, facts: &DriverFacts, reuse| {
            chosen_for_walks_of(12.0, seen, &scene, facts, reuse, Scheduler::Auto) == Schedule::Queue
        };
        assert_eq!([0.1, 0.3].map(|seen| waits(seen, &LANES_IN_ALL_BRANCHES, true)), [false, true]);
        assert!(waits(0.1, &LANES_IN_ALL_BRANCHES, false));
        let shuffling = DriverFacts { shuffles: true, ..LANES_IN_ALL_BRANCHES };
        assert!(!waits(0.3, &shuffling, true));
    }

    #[test]
    fn rays_do_not_wait_where_a_scene_is_seen_from_outside() {
        let mut scene = terrain(2000);
        let waits = |scene: &Scene, facts: &DriverFacts, reuse| {
            let features = &Features::of(scene, &RenderSettings::of(scene));
            let (sah_cost, keeps_kernels) = (Some(20.0), true);
            let job = Job {
                features,
                facts,
                sah_cost,
                seen: 1.0,
                seen_from_outside: true,
                keeps_kernels,
                samples: 1e9,
                reuse,
            };
            job.schedule(Scheduler::Auto) == Schedule::Queue
        };
        assert_eq!([false, true].map(|reuse| waits(&scene, &LANES, reuse)), [true, false]);
        scene.sphere(v(0.0, 0.5, -4.0), 0.3, glass(1.5));
        assert!(waits(&scene, &LANES, true));
    }

    #[test]
    fn what_is_asked_for_is_taken_where_it_can_be() {
        let asked = |scene: &Scene, reuse| {
            [Scheduler::Inline, Scheduler::Turns, Scheduler::Queue].map(|s| chosen(scene, &GPU, reuse, s))
        };
        assert_eq!(asked(&divided_room(), false), [Schedule::Inline, Schedule::Turns, Schedule::Queue]);
        assert_eq!(asked(&divided_room(), true), [Schedule::Inline, Schedule::Inline, Schedule::Queue]);
        assert_eq!(asked(&room(), false), [Schedule::Inline; 3]);
    }
}
