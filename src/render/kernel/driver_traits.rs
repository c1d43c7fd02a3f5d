//! What is known of drivers that changes how work is cut up, and whether to reuse paths.

use crate::gpu::{DeviceInfo, DeviceKind};
use crate::host::permutes_lanes;

use crate::render::film::tiling::MEMBERS;
use crate::render::settings::RenderSettings;

/// What shares paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sharers {
    /// Lanes of a CPU's vectors: a sample takes 1.4 to 2.3 times the time.
    Lanes,
    /// Threads of a GPU: a sample takes 2.4 to 4 times the time, and what the host does before and after as long as hundreds.
    Threads,
    /// Nothing: subgroups that have no room for a group, or threads that cannot read each other's registers, without which it takes up
    /// to 3.5 times as long again, or whose subgroups may be cut up.
    None,
}

/// Facts of a driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DriverTraits {
    /// Loop iterations that an invocation may spend; 0: no bound.
    pub loop_budget: u32,
    /// Invocations of a workgroup.
    pub workgroup_size: u32,
    /// Paths that need the BVH wait for each other ([`Scheduler::Queue`](crate::render::Scheduler::Queue)): pays where a
    /// subgroup is a SIMD register of a CPU, whose idle lanes cost as much as busy ones.
    pub queue: bool,
    /// Where paths may serve several pixels, if that pays ([`Reuse`](crate::render::Reuse)).
    pub reuse: Sharers,
    /// Lanes are threads of a GPU: each takes its own way at a branch, and has memory of its own for a stack, which a CPU driver
    /// accesses lane by lane.
    pub threads: bool,
    /// Lanes can read each other's registers in one instruction.
    pub shuffles: bool,
    /// The lanes of whole groups of pixels are a subgroup, as paths that serve several pixels need.
    pub groups_fit: bool,
    /// Invocations that keep the device busy; 0: any number. (An H100 holds 2¹⁸ of them, with few registers.)
    pub invocations: u64,
    /// Tables are arrays for shaders, not texels.
    pub tables_in_arrays: bool,
    /// Regions for the records of paths, which the workgroups that run share: a workgroup that finds none free waits.
    pub queue_regions: u32,
}

impl DriverTraits {
    /// Of a device, which ends loops after so many iterations if that was found.
    pub fn of(device: &DeviceInfo, loop_limit: Option<u32>) -> Self {
        let groups_fit = device.subgroup_size.is_multiple_of(MEMBERS as u32);
        Self {
            // Of what a driver allows, some is for what is not counted. Elsewhere the budget bounds a dispatch, so that no watchdog ends it:
            // CPUs have none.
            loop_budget: match (loop_limit, device.kind) {
                (Some(limit), _) => limit - limit / 4,
                (None, DeviceKind::Cpu) => 0,
                (None, _) => 1 << 20,
            },
            workgroup_size: if device.kind == DeviceKind::Cpu { 64 } else { 128 },
            queue: device.kind == DeviceKind::Cpu,
            reuse: match device.kind {
                _ if !groups_fit => Sharers::None,
                DeviceKind::Cpu => Sharers::Lanes,
                _ if device.shuffles && device.same_subgroups => Sharers::Threads,
                _ => Sharers::None,
            },
            threads: device.kind != DeviceKind::Cpu,
            shuffles: device.shuffles && (device.kind != DeviceKind::Cpu || lanes_permute(device)),
            groups_fit,
            tables_in_arrays: device.tables_in_arrays,
            invocations: if device.kind == DeviceKind::Cpu { 0 } else { 1 << 18 },
            queue_regions: if device.kind == DeviceKind::Cpu { 64 } else { 1024 },
        }
    }

    /// Invocations of a workgroup for an image of so many slots. A GPU has few workgroups of a small one, which must be small too for
    /// its processors to have alike shares (an armadillo, 256×256: .75 of the time with 64 invocations; 1024×1024: .93 with 128).
    pub fn workgroup_of(&self, slots: u64) -> u32 {
        if self.threads && slots < 1 << 18 { self.workgroup_size / 2 } else { self.workgroup_size }
    }

    /// The same, but for what the caller decides.
    pub fn with(self, settings: &RenderSettings) -> Self {
        Self { threads: settings.threads.unwrap_or(self.threads), ..self }
    }
}

/// Whether a driver's lanes are those of vectors that the CPU permutes. llvmpipe makes an instruction of a shuffle of eight lanes, a
/// loop of any other.
fn lanes_permute(device: &DeviceInfo) -> bool {
    device.driver.starts_with("llvmpipe") && device.subgroup_size == 8 && permutes_lanes()
}
