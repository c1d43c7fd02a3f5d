//! Rays and nothing else, to be timed: shaders/probe/traverse.comp.

use bytemuck::{Pod, Zeroable};

use crate::gpu::{Context, loop_limit};
use crate::render::kernel;
use crate::render::kernel::TRAVERSE;
use crate::render::kernel::driver_traits::DriverTraits;
use crate::render::{RenderError, RenderSettings};
use crate::scene::Scene;

use crate::check::probe::rays::RayInput;
use crate::check::probe::{CheckError, Kernel, Probe, tables_of};

/// Rays of a workgroup on a CPU, of which a lane fetches the next when it is done with one.
const LONG_RUN: u32 = 512;

/// In [`Traced::truncated`]: the driver has cut the workgroup into several subgroups.
const CUT_UP: u32 = 2;

/// What is asked of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Query {
    /// What each ray meets first.
    Closest,
    /// Whether each ray meets anything.
    Any,
}

/// The answer for one ray.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct Traced {
    /// Distance, in units of render space; of a hit that need not be the first for [`Query::Any`].
    pub t: f32,
    /// Primitive, or −1.
    pub id: i32,
    /// 1 if the driver or its loop budget ended the traversal early, [`CUT_UP`] if no ray of the workgroup was traced.
    pub truncated: u32,
    /// Steps through the BVH, where they are counted.
    pub steps: u32,
}

/// The BVH of a scene, ready to be asked.
pub(crate) struct Traversal {
    probe: Probe<RayInput, Traced>,
    count: usize,
}

impl Traversal {
    /// Uploads and compiles; with `settings.count_steps`, to count steps and not to be timed.
    pub fn new(context: &Context, scene: &Scene, settings: &RenderSettings) -> Result<Self, CheckError> {
        let (_, tables) = tables_of(scene, settings);
        let info = context.info();
        let traits = DriverTraits::of(info, loop_limit(&context.0)?);
        let kernel = Kernel {
            spirv: kernel::spirv(&TRAVERSE, settings)?,
            workgroup: info.subgroup_size,
            // On a GPU what matters is that there are many workgroups: one that goes on with further rays takes 1.2 to 2.2 times as long
            // for them (H100, 2¹⁸ rays).
            inputs: if traits.threads { info.subgroup_size } else { LONG_RUN },
            loop_budget: traits.loop_budget,
            counts_steps: settings.count_steps,
            ..Kernel::function(TRAVERSE.name, TRAVERSE.spirv, 0)
        };
        Ok(Self { probe: Probe::new(context, kernel, scene, &tables, settings, 0)?, count: 0 })
    }

    /// Uploads rays, at most [`crate::check::probe::BATCH`], and traces them once: some drivers compile only then.
    pub fn load(&mut self, rays: &[RayInput]) -> Result<(), CheckError> {
        self.probe.load(rays)?;
        self.count = rays.len();
        self.trace(Query::Any).map(drop)
    }

    /// Traces the rays that were loaded; returns the seconds this took.
    pub fn trace(&mut self, query: Query) -> Result<f64, CheckError> {
        self.probe.dispatch(self.count, query == Query::Any)
    }

    /// What the last trace found.
    pub fn found(&mut self) -> Result<Vec<Traced>, CheckError> {
        let found = self.probe.read(self.count)?;
        if found.iter().any(|f| f.truncated == CUT_UP) {
            return Err(
                RenderError::Driver("it cut workgroups into smaller subgroups than were asked for".to_owned()).into()
            );
        }
        match found.iter().filter(|f| f.truncated != 0).count() {
            0 => Ok(found),
            count => Err(RenderError::Truncated { count: count as u64 }.into()),
        }
    }
}
