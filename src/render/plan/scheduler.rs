//! Which scheduler a rendering gets: whether rays wait for each other before they traverse the BVH (shaders/path_queue.comp), or lanes
//! shade and traverse in turns (shaders/path_interleaved.comp).

use crate::render::kernel::Schedule;
use crate::render::kernel::driver_traits::DriverTraits;
use crate::render::kernel::features::Features;
use crate::render::settings::Scheduler;

/// Expected records that a ray reads in the BVH (its SAH cost) from which on it pays to let rays wait for each other.
const LONG_TRAVERSAL: f64 = 8.0;
/// The same if the BVH is seen in so much of the picture.
const LONG_TRAVERSAL_IN_SIGHT: f64 = 4.0;
/// So much of the picture.
const IN_SIGHT: f64 = 0.1;
/// Where the lanes of a group exchange their paths, which without waiting are in registers already, most rays must come near the BVH:
/// from so many records on that a ray reads, whether it meets the BVH or not.
const LONG_TRAVERSAL_OF_GROUPS: f64 = 3.0;
/// As many times the records of rays from the camera do others read.
const OF_CAMERA_RAYS: f64 = 2.0;
/// Samples times the square of the records beyond these from which on a rendering gains what its first start takes longer with the
/// larger kernel: the time that is gained, times the part of the whole that it is.
const WORTH_OF_FIRST_START: f64 = 1.5e7;

/// What the choice depends on.
pub(crate) struct Job<'a> {
    pub features: &'a Features,
    pub traits: &'a DriverTraits,
    /// The BVH's SAH cost; none without a BVH.
    pub sah_cost: Option<f64>,
    /// The part of the picture that shows boxes around the BVH.
    pub seen: f64,
    /// All that does not emit is in the BVH, and the camera and the lights are outside of it.
    pub seen_from_outside: bool,
    /// Of all pixels together.
    pub samples: f64,
    /// Paths may serve several pixels.
    pub reuse: bool,
}

impl Job<'_> {
    /// How rays are scheduled.
    pub fn schedule(&self, scheduler: Scheduler) -> Schedule {
        // Among lights, of which one is chosen, and where paths are reused, a kernel holds too much for more: with emitters it needs 163
        // registers instead of 92, and takes 1.1 to 2.4 times as long; with one point .70 (a bunny in a room) to .81 (a dragon of
        // glass) (H100, 1024×1024).
        let one_light = self.features.lights <= 1 && !self.features.emitter;
        let interleaving_pays = self.features.bvh && one_light;
        let choice = match scheduler {
            // What finds leaves by itself has no steps to deal out.
            _ if self.features.brute_force || self.features.ray_query => Schedule::Inline,
            Scheduler::Auto if self.traits.queue && self.waiting_pays() => Schedule::Queue,
            Scheduler::Auto if self.traits.threads && interleaving_pays => Schedule::Interleaved,
            Scheduler::Auto | Scheduler::Inline => Schedule::Inline,
            Scheduler::Interleaved if self.features.bvh => Schedule::Interleaved,
            Scheduler::Interleaved => Schedule::Inline,
            Scheduler::Queue if self.features.bvh || self.reuse => Schedule::Queue,
            Scheduler::Queue => Schedule::Inline,
        };
        if choice == Schedule::Interleaved && self.reuse { Schedule::Inline } else { choice }
    }

    fn waiting_pays(&self) -> bool {
        let Some(sah_cost) = self.sah_cost else { return false };
        // Of an object or a landscape that is alone, lit and seen from outside, paths are short, and groups have them at the same time.
        let specular = self.features.mirror || self.features.dielectric;
        if self.reuse && self.seen_from_outside && !specular {
            return false;
        }
        // Paths of one hit are short, and all have their shadow ray at the same time; among lights the choice takes longer than the
        // rays, and not always as long.
        let one_light = self.features.lights <= 1 && !self.features.emitter;
        if !self.features.has_long_paths() && one_light {
            return false;
        }
        let records = match self.reuse {
            true => OF_CAMERA_RAYS * sah_cost * self.seen - LONG_TRAVERSAL_OF_GROUPS,
            false if self.seen >= IN_SIGHT => sah_cost - LONG_TRAVERSAL_IN_SIGHT,
            false => sah_cost - LONG_TRAVERSAL,
        };
        records > 0.0 && records * records * self.samples >= WORTH_OF_FIRST_START
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::generate::terrain;
    use crate::check::scenes::{Build, divided_room, emitters, glass, room, v};
    use crate::render::kernel::driver_traits::Sharers;
    use crate::render::scene::tables::Tables;
    use crate::render::settings::RenderSettings;
    use crate::render::space::RenderSpace;
    use crate::scene::Scene;

    const GPU: DriverTraits = DriverTraits {
        loop_budget: 1 << 20,
        workgroup_size: 128,
        queue: false,
        reuse: Sharers::Threads,
        threads: true,
        shuffles: true,
        groups_fit: true,
        tables_in_arrays: false,
        invocations: 1 << 19,
        queue_regions: 1024,
    };

    /// A CPU.
    const LANES: DriverTraits = DriverTraits { queue: true, reuse: Sharers::Lanes, threads: false, ..GPU };

    fn features_of(scene: &Scene) -> Features {
        let settings = RenderSettings::of(scene);
        Features::new(scene, &Tables::new(scene, &RenderSpace::of(scene), &settings), &settings)
    }

    fn chosen(scene: &Scene, traits: &DriverTraits, reuse: bool, scheduler: Scheduler) -> Schedule {
        chosen_for_walks_of(20.0, 1.0, scene, traits, reuse, scheduler)
    }

    /// Of so many records, in a BVH that so much of the picture shows.
    fn chosen_for_walks_of(
        records: f64,
        seen: f64,
        scene: &Scene,
        traits: &DriverTraits,
        reuse: bool,
        scheduler: Scheduler,
    ) -> Schedule {
        let features = features_of(scene);
        let sah_cost = features.bvh.then_some(records);
        let seen_from_outside = false;
        let samples = 1e9;
        let job = Job { features: &features, traits, sah_cost, seen, seen_from_outside, samples, reuse };
        job.schedule(scheduler)
    }

    #[test]
    fn threads_interleave_in_a_bvh_under_one_point() {
        let auto = |scene: &Scene, reuse| chosen(scene, &GPU, reuse, Scheduler::Auto);
        assert_eq!(auto(&divided_room(), false), Schedule::Interleaved);
        // Paths are shared by the lanes of a subgroup.
        assert_eq!(auto(&divided_room(), true), Schedule::Inline);
        assert_eq!(auto(&emitters(), false), Schedule::Inline);
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
    fn rays_wait_where_traversals_are_long() {
        let waits = |records, seen, reuse| {
            chosen_for_walks_of(records, seen, &divided_room(), &LANES, reuse, Scheduler::Auto) == Schedule::Queue
        };
        // Without sharing paths.
        assert_eq!([3.0, 5.0].map(|records| waits(records, 1.0, false)), [false, true]);
        assert_eq!([7.0, 9.0].map(|records| waits(records, 0.05, false)), [false, true]);
        // All of the picture shows the BVH.
        assert_eq!([1.0, 16.0].map(|records| waits(records, 1.0, true)), [false, true]);
    }

    #[test]
    fn rays_wait_if_that_gains_what_the_larger_kernel_takes_longer_to_start() {
        let scene = divided_room();
        let features = &features_of(&scene);
        // With so many records beyond those of traversals that are too short.
        let waits = |records: f64, samples| {
            let job = Job {
                features,
                traits: &LANES,
                sah_cost: Some((LONG_TRAVERSAL_OF_GROUPS + records) / OF_CAMERA_RAYS),
                seen: 1.0,
                seen_from_outside: false,
                samples,
                reuse: true,
            };
            job.schedule(Scheduler::Auto) == Schedule::Queue
        };
        let (few, many) = (131_072.0, 1_048_576.0);
        assert_eq!([(2.0, many), (16.0, few)].map(|(records, samples)| waits(records, samples)), [false, true]);
        assert!(!waits(-9.0, 1e12));
    }

    #[test]
    fn rays_do_not_wait_where_a_scene_is_seen_from_outside() {
        let mut scene = terrain(2000);
        let waits = |scene: &Scene, reuse| {
            let features = &features_of(scene);
            let job = Job {
                features,
                traits: &LANES,
                sah_cost: Some(20.0),
                seen: 1.0,
                seen_from_outside: true,
                samples: 1e9,
                reuse,
            };
            job.schedule(Scheduler::Auto) == Schedule::Queue
        };
        assert_eq!([false, true].map(|reuse| waits(&scene, reuse)), [true, false]);
        scene.sphere(v(0.0, 0.5, -4.0), 0.3, glass(1.5));
        assert!(waits(&scene, true));
    }

    #[test]
    fn what_is_asked_for_is_taken_where_it_can_be() {
        let asked = |scene: &Scene, reuse| {
            [Scheduler::Inline, Scheduler::Interleaved, Scheduler::Queue].map(|s| chosen(scene, &GPU, reuse, s))
        };
        assert_eq!(asked(&divided_room(), false), [Schedule::Inline, Schedule::Interleaved, Schedule::Queue]);
        assert_eq!(asked(&divided_room(), true), [Schedule::Inline, Schedule::Inline, Schedule::Queue]);
        assert_eq!(asked(&room(), false), [Schedule::Inline; 3]);
    }
}
