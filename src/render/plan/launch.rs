//! How a rendering runs on a device: which kernel, specialised for what, and how its work is cut up.

use crate::gpu::{Device, DeviceKind, Specialization};

use crate::render::error::RenderError;
use crate::render::film::tiling::slot_count;
use crate::render::kernel::Schedule;
use crate::render::kernel::driver_traits::DriverTraits;
use crate::render::kernel::layout::{FilmSlot, queue};
use crate::render::kernel::specialization::{Compiled, LaunchConstants};
use crate::render::plan::distribution::WorkDistribution;
use crate::render::plan::exclusions::Combination;
use crate::render::plan::pace::{Pace, Rounds};
use crate::render::plan::prepared::Prepared;
use crate::render::plan::scheduler::Job;
use crate::render::plan::split;
use crate::render::plan::split::Split;
use crate::render::settings::RenderSettings;
use crate::render::space::RenderSpace;
use crate::render::space::view::View;

/// What an invocation of path_interleaved.comp keeps where its workgroup shares memory: a slot of the film.
const KEPT_BYTES: u32 = size_of::<FilmSlot>() as u32;

/// What the kernel can do besides tracing the paths of a scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KernelOptions {
    /// Paths may serve several pixels.
    pub reuse: bool,
    /// Neighbours are compared.
    pub gradients: bool,
    /// Light samples where a path first meets a diffuse surface.
    pub light_samples: u32,
    /// What is seen through glass gets more samples.
    pub glass: bool,
    /// Numbers of samples may differ between pixels.
    pub sample_map: bool,
    /// Targets of light paths, which paths have to know of; 0 without light paths.
    pub casters: u32,
    /// Levels of the sampler's table.
    pub sobol_levels: u32,
}

/// What is decided before anything is made on the device.
pub(crate) struct Launch {
    pub traits: DriverTraits,
    pub kernel: KernelOptions,
    pub schedule: Schedule,
    pub split: Split,
    /// Invocations of a workgroup, and those of them that are a subgroup.
    pub workgroup: u32,
    pub subgroup: u32,
    /// Loop iterations that an invocation may spend; 0: no bound.
    pub loop_budget: u32,
    /// Who gets the pieces of work, and how many slots of the film one is.
    pub distribution: WorkDistribution,
    pub slots_per_work_item: u32,
    /// Workgroups of a dispatch, at most.
    most_workgroups: u32,
    /// Threads of a CPU device.
    cpu_threads: Option<u32>,
}

impl Launch {
    /// Of a kernel with these options, for a device of which this is known.
    ///
    /// # Errors
    /// A workgroup of the size that is asked for is not possible.
    pub fn new(
        device: &Device,
        traits: DriverTraits,
        prepared: &Prepared<'_>,
        kernel: KernelOptions,
    ) -> Result<Self, RenderError> {
        let Prepared { scene, settings, features, needed, tables, .. } = prepared;
        let reuse = kernel.reuse;
        let job = Job {
            features,
            traits: &traits,
            sah_cost: tables.bvh.as_ref().map(|bvh| bvh.sah_cost),
            seen: View::of(scene, RenderSpace::of(scene).length(1.0)).part_of(tables.root_boxes()),
            seen_from_outside: tables.seen_from_outside,
            samples: f64::from(scene.film.width) * f64::from(scene.film.height) * f64::from(settings.samples),
            reuse,
        };
        let schedule = job.schedule(settings.scheduler);
        let (limits, subgroup) = (&device.limits, device.info.subgroup_size);
        // Of invocations in a workgroup: what they keep there has to fit too.
        let room = match schedule {
            Schedule::Interleaved => limits.max_compute_shared_memory_size / KEPT_BYTES,
            Schedule::Inline | Schedule::Queue => u32::MAX,
        };
        let most_invocations =
            limits.max_compute_work_group_invocations.min(limits.max_compute_work_group_size[0]).min(room);
        let size = [scene.film.width, scene.film.height];
        let slots = slot_count(size[0], size[1]);
        let bounds = split::Bounds {
            uneven: needed.bvh && !needed.dielectric,
            invocations: most_invocations / subgroup,
            recorded: device.info.max_texel_elements.min(device.info.max_storage_range / 16),
        };
        // Who wants workgroups of some size gets them.
        let invocations = settings.split.or(settings.workgroup_size.map(|_| 1));
        let split = match schedule {
            Schedule::Inline | Schedule::Interleaved if !reuse => {
                Split::of(invocations, traits.invocations, slots, settings.samples, &bounds)
            }
            _ => Split::NONE,
        };
        let workgroup = match settings.workgroup_size {
            // The queue's workgroup is one subgroup.
            _ if schedule == Schedule::Queue => subgroup,
            // Lanes of a subgroup are neighbours in the image.
            _ if split != Split::NONE => subgroup * split.invocations,
            size => {
                let size = size.unwrap_or(traits.workgroup_of(slots));
                if reuse { size.checked_next_multiple_of(subgroup).unwrap_or(size) } else { size }
            }
        };
        if workgroup == 0 || workgroup > most_invocations {
            return Err(RenderError::Settings(format!(
                "a workgroup of {workgroup} invocations is not possible, expected 1 to {most_invocations}"
            )));
        }
        // Tables in registers need the lanes that hold their rows. (Those of threads are for groups, which subgroups have room for.)
        let shuffles = traits.shuffles && (traits.threads || workgroup.is_multiple_of(subgroup));
        let traits = DriverTraits { shuffles, ..traits };
        let cpu_threads = (device.info.kind == DeviceKind::Cpu).then(threads);
        let most_workgroups = limits.max_compute_work_group_count[0];
        let loop_budget = settings.loop_budget.unwrap_or(traits.loop_budget);
        // For paths of one hit, to draw takes longer than what threads wait for each other.
        let may_draw = schedule == Schedule::Inline
            && split == Split::NONE
            && workgroup.is_multiple_of(subgroup)
            && needed.has_long_paths();
        let distribution = match cpu_threads {
            Some(threads) if schedule == Schedule::Queue => WorkDistribution::of_queue(loop_budget, threads, &traits),
            Some(2..) if may_draw => WorkDistribution::DrawnOnce { most: most_workgroups },
            _ => WorkDistribution::ToWorkgroups,
        };
        let combination = Combination {
            pinhole: scene.camera.is_pinhole(),
            schedule,
            brute_force: features.brute_force,
            split: split != Split::NONE,
            reuse,
            gradients: kernel.gradients,
            light_samples: kernel.light_samples,
            light_tracing: kernel.casters > 0,
            glass: kernel.glass,
        };
        combination.check()?;
        Ok(Self {
            traits,
            kernel,
            schedule,
            split,
            workgroup,
            subgroup,
            loop_budget,
            distribution,
            slots_per_work_item: if schedule == Schedule::Queue { queue::TILE } else { workgroup / split.invocations },
            most_workgroups,
            cpu_threads,
        })
    }

    /// Whether rays wait for each other.
    pub fn is_queued(&self) -> bool {
        self.schedule == Schedule::Queue
    }

    /// Workgroups of the queue that may run at one time; 0 without the queue.
    pub fn regions(&self) -> u32 {
        if self.is_queued() { self.traits.queue_regions } else { 0 }
    }

    /// Slots that a dispatch may cover.
    pub fn most_slots(&self) -> u64 {
        u64::from(self.distribution.most_work_items(self.most_workgroups)) * u64::from(self.slots_per_work_item)
    }

    /// What the kernel is specialised for.
    pub fn specialization(&self, prepared: &Prepared<'_>) -> Specialization {
        let Prepared { settings, features, tables, .. } = prepared;
        let traits = &self.traits;
        // Lanes that must be at work for a subgroup to go on as it does.
        let enough = match self.schedule {
            // That wait to be shaded. (A quarter and three quarters of them: 1.05 and 1.03 of the time, H100.)
            Schedule::Interleaved => (self.subgroup / 2).max(1),
            Schedule::Inline | Schedule::Queue => (self.workgroup * 7 / 8).max(1),
        };
        let launch = LaunchConstants {
            workgroup: self.workgroup,
            subgroup: self.subgroup,
            loop_budget: self.loop_budget,
            regions: self.regions(),
            enough_lanes: enough,
            split: self.split.invocations,
            light_samples: self.kernel.light_samples,
            casters: self.kernel.casters,
            sobol_levels: self.kernel.sobol_levels,
            persistent_threads: self.distribution.is_drawn(),
            reuse: self.kernel.reuse,
            sample_map: self.kernel.sample_map,
            threads: traits.threads,
            shuffles: traits.shuffles,
            tables_in_arrays: traits.tables_in_arrays,
        };
        Compiled { features, tables, settings, launch }.specialization()
    }

    /// How many samples a dispatch takes.
    pub fn pace(&self, settings: &RenderSettings) -> Pace {
        let most_samples = if self.is_queued() { queue::PATHS / queue::TILE } else { self.split.most_samples };
        let rounds = match self.cpu_threads {
            Some(threads) => Rounds::on_cpu(threads, settings.time_limit),
            None => Rounds::on_gpu(),
        };
        Pace::new(settings.samples_per_dispatch, most_samples, rounds)
    }
}

/// Threads that a driver on the CPU has.
fn threads() -> u32 {
    std::thread::available_parallelism().map_or(1, |n| u32::try_from(n.get()).unwrap_or(u32::MAX / 4))
}
