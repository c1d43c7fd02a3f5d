//! Rays and nothing else, to be timed: shaders/probe/traverse.comp.

use bytemuck::{Pod, Zeroable};

use crate::gpu::Context;
use crate::render::driver::DriverFacts;
use crate::render::{Features, RenderError, RenderSettings};
use crate::scene::Scene;

use super::rays::{RayInput, Variants, variant, variants};
use super::{CheckError, Kernel, Probe, tables_of};

static TRAVERSE: Variants = variants!("traverse");

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
    /// The driver or its loop budget ended the walk early.
    pub truncated: u32,
    pub unused: u32,
}

/// The tree of a scene, ready to be asked.
pub(crate) struct Traversal {
    probe: Probe<RayInput, Traced>,
}

impl Traversal {
    /// Uploads and compiles.
    pub fn new(context: &Context, scene: &Scene, settings: &RenderSettings) -> Result<Self, CheckError> {
        let (_, tables) = tables_of(scene, settings);
        let info = context.info();
        let kernel = Kernel {
            workgroup: info.subgroup_size,
            inputs: 512,
            loop_budget: DriverFacts::of(info).loop_budget,
            counts_steps: false,
            ..Kernel::function("traverse", variant(&TRAVERSE, &Features::of(scene, settings)), 0)
        };
        Ok(Self { probe: Probe::new(context, kernel, scene, &tables, settings, 0)? })
    }

    /// Traces all rays `repeats` times; gives the answers, and the seconds of each repetition.
    pub fn time(
        &mut self,
        rays: &[RayInput],
        query: Query,
        repeats: usize,
    ) -> Result<(Vec<Traced>, Vec<f64>), CheckError> {
        let (found, seconds) = self.probe.time(rays, query == Query::Any, repeats)?;
        match found.iter().filter(|f| f.truncated != 0).count() {
            0 => Ok((found, seconds)),
            count => Err(RenderError::Truncated { count: count as u32 }.into()),
        }
    }
}
