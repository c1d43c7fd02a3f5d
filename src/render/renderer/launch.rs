//! How a rendering runs on a device: which kernel, specialised for what, and how its work is cut up.

use crate::gpu::{Device, DeviceKind, Specialization};

use crate::render::error::RenderError;
use crate::render::film::{slot_count, slots_of_row};
use crate::render::kernel::Schedule;
use crate::render::kernel::driver_traits::DriverTraits;
use crate::render::kernel::features::Features;
use crate::render::kernel::layout::{FilmSlot, queue};
use crate::render::kernel::specialization::{Compiled, LaunchConstants};
use crate::render::plan::dispatch::{Pace, Rounds};
use crate::render::renderer::buffers::Shape;
use crate::render::renderer::distribution::WorkDistribution;
use crate::render::renderer::scheduler::Job;
use crate::render::renderer::split;
use crate::render::renderer::split::Split;
use crate::render::renderer::{emitter_edges, light_tracing, reuse_policy, sample_map};
use crate::render::scene::Prepared;
use crate::render::settings::RenderSettings;
use crate::render::space::view::{Rectangle, View};

/// What an invocation of path_interleaved.comp keeps where its workgroup shares memory: a slot of the film.
const KEPT_BYTES: u32 = size_of::<FilmSlot>() as u32;

/// What is decided before anything is made on the device.
pub(super) struct Launch {
    pub traits: DriverTraits,
    /// What the scene needs, even if the kernel is to be a general one.
    pub needed: Features,
    pub schedule: Schedule,
    /// Whether paths may serve several pixels.
    pub reuse: bool,
    /// Light samples where a path first meets a diffuse surface.
    pub light_samples: u32,
    pub split: Split,
    /// Invocations of a workgroup, and those of them that are a subgroup.
    pub workgroup: u32,
    pub subgroup: u32,
    /// Loop iterations that an invocation may spend; 0: no bound.
    pub loop_budget: u32,
    /// Who gets the pieces of work, and how many slots of the film one is.
    pub distribution: WorkDistribution,
    pub slots_per_work_item: u32,
    /// Levels of the sampler's table.
    pub sobol_levels: u32,
    /// The pixels that may show the edges of emitters; none where nobody is to look for them.
    pub emitter_bounds: Vec<Rectangle>,
    /// Targets that light paths go to; 0 without light paths.
    pub casters: u32,
    /// Whether glass and mirrors that the camera sees get more samples.
    pub glass: bool,
    /// Whether numbers of samples may differ between pixels.
    pub sample_map: bool,
    /// Workgroups of a dispatch, at most.
    most_workgroups: u32,
    /// Threads of a CPU device.
    cpu_threads: Option<u32>,
}

impl Launch {
    /// For such a device.
    ///
    /// # Errors
    /// A workgroup of the size that is asked for is not possible.
    pub fn of(device: &Device, prepared: &Prepared<'_>) -> Result<Self, RenderError> {
        let Prepared { scene, settings, features, tables, .. } = prepared;
        let traits = DriverTraits::of(&device.info).with(settings);
        let needed = if settings.general || settings.unneeded.is_some() {
            Features::of(scene, &RenderSettings { general: false, unneeded: None, ..(*settings).clone() })
        } else {
            features.clone()
        };
        let casters = light_tracing::targets(&needed, tables, settings);
        let reuse = reuse_policy::may_reuse(scene, &needed, settings, &traits) && casters == 0;
        let job = Job {
            features,
            traits: &traits,
            sah_cost: tables.tree.as_ref().map(|tree| tree.sah_cost),
            seen: View::of(scene).part_of(tables.root_boxes()),
            seen_from_outside: tables.seen_from_outside,
            samples: f64::from(scene.film.width) * f64::from(scene.film.height) * f64::from(settings.samples),
            reuse,
        };
        let glass = emitter_edges::looks_for_glass(&needed, casters);
        let sample_map =
            sample_map::wants_sample_map(settings) && (reuse || glass || !tables.emitter_bounds.is_empty());
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
            uneven: needed.tree && !needed.dielectric,
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
        Ok(Self {
            traits,
            schedule,
            reuse,
            light_samples: if reuse { tables.light_samples(settings.light_samples) } else { 1 },
            split,
            workgroup,
            subgroup,
            loop_budget,
            distribution,
            slots_per_work_item: if schedule == Schedule::Queue { queue::TILE } else { workgroup / split.invocations },
            sobol_levels: sample_map::levels_of_table(features, settings, sample_map),
            emitter_bounds: tables.emitter_bounds.clone(),
            casters,
            glass,
            sample_map,
            most_workgroups,
            cpu_threads,
            needed,
        })
    }

    /// Whether rays wait for each other.
    pub fn is_queued(&self) -> bool {
        self.schedule == Schedule::Queue
    }

    /// Workgroups of the queue that may run at one time; 0 without the queue.
    fn regions(&self) -> u32 {
        if self.is_queued() { self.traits.queue_regions } else { 0 }
    }

    /// What decides about the sizes of buffers for an image of such a size.
    pub fn shape(&self, [width, height]: [u32; 2], settings: &RenderSettings) -> Shape {
        let slots = slot_count(width, height);
        let covered =
            u64::from(self.distribution.most_work_items(self.most_workgroups)) * u64::from(self.slots_per_work_item);
        Shape {
            slots,
            row_slots: slots_of_row(width),
            covered,
            regions: self.regions(),
            split_samples: self.split.recorded(slots.min(covered)),
            reuse: self.reuse,
            notes: self.is_queued() && self.reuse,
            passage: settings.passage,
        }
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
            light_samples: self.light_samples,
            casters: self.casters,
            sobol_levels: self.sobol_levels,
            persistent_threads: self.distribution.is_drawn(),
            reuse: self.reuse,
            sample_map: self.sample_map,
            threads: traits.threads,
            shuffles: traits.shuffles,
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

    /// Invocations of a workgroup that traces light paths: small ones, of which few light paths still make many.
    pub fn light_tracing_workgroup(&self) -> u32 {
        if self.traits.threads { self.subgroup.clamp(32, 128) } else { self.traits.workgroup_size }
    }
}

/// Threads that a driver on the CPU has.
fn threads() -> u32 {
    std::thread::available_parallelism().map_or(1, |n| u32::try_from(n.get()).unwrap_or(u32::MAX / 4))
}
