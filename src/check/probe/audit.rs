//! Triangles that rays meet, as the device's ray queries say and as our own test does: shaders/probe/audit.comp.

use bytemuck::{Pod, Zeroable};

use crate::gpu::Context;
use crate::render::RenderSettings;
use crate::scene::Scene;

use crate::check::probe::rays::RayInput;
use crate::check::probe::{CheckError, Kernel, Probe, tables_of};

const AUDIT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/audit.spv"));

/// What is found along a ray.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct AuditRecord {
    /// Triangles that the device proposes.
    pub proposed: u32,
    /// Of them, those that the ray meets at an edge.
    pub at_edges: u32,
    /// Elsewhere: proposed, and not met.
    pub extra: u32,
    /// Elsewhere: met, and not proposed.
    pub missed: u32,
    /// Largest difference of distances, in units of the last place, where the ray does not graze.
    pub worst_t: u32,
    /// Likewise of barycentrics.
    pub worst_barycentric: f32,
    pub unused: [u32; 2],
}

/// Asks about rays through a scene of triangles, with the device's scale of it.
pub(crate) fn audit(
    context: &Context,
    scene: &Scene,
    settings: &RenderSettings,
    rays: &dyn Fn(f64) -> Vec<RayInput>,
) -> Result<Vec<AuditRecord>, CheckError> {
    let (space, mut tables) = tables_of(scene, settings);
    // Shaders are asked about each.
    tables.query_geometry.iter_mut().for_each(|geometry| geometry.opaque = false);
    let kernel = Kernel::function("audit", AUDIT, 0);
    let mut probe = Probe::<RayInput, AuditRecord>::new(context, kernel, scene, &tables, settings, 0)?;
    probe.run(&rays(space.length(1.0)))
}
