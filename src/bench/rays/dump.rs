//! Rays in a file.

use std::io::Write;
use std::path::Path;

use crate::files;
use crate::render::space::RenderSpace;
use crate::scene::Scene;

use crate::bench::error::BenchError;
use crate::bench::rays::RaySet;

const MAGIC: &[u8; 16] = b"photolith-rays-1";

/// Writes the triangles of a scene, its rays, and what they met. All numbers are 32 bits wide and little-endian;
/// lengths are in units of render space (the camera is the origin; a power of two near the scene's size is 1).
///
/// ```text
/// "photolith-rays-1"
/// number of triangles, of primary, of shadow and of bounce rays
/// each triangle: nine coordinates
/// for each kind, its rays: origin, far end, unit direction, primitive that the ray starts on (or −1);
///     and then for each of them the distance of its hit, or −1
/// ```
/// The hit of a shadow ray need not be the nearest one.
///
/// # Errors
/// The file cannot be written.
pub fn dump(path: &Path, scene: &Scene, sets: &[RaySet]) -> Result<(), BenchError> {
    Ok(files::write_whole(path, |out| write(out, scene, sets))?)
}

fn write(out: &mut impl Write, scene: &Scene, sets: &[RaySet]) -> std::io::Result<()> {
    out.write_all(MAGIC)?;
    out.write_all(&(scene.triangle_count() as u32).to_le_bytes())?;
    for set in sets {
        out.write_all(&(set.rays.len() as u32).to_le_bytes())?;
    }
    let space = RenderSpace::of(scene);
    for mesh in &scene.meshes {
        for corner in mesh.triangles.iter().flatten() {
            for x in space.point32(mesh.positions[*corner as usize]).to_array() {
                out.write_all(&x.to_le_bytes())?;
            }
        }
    }
    for set in sets {
        for ray in &set.rays {
            for x in ray.origin.into_iter().chain([ray.t_max]).chain(ray.direction) {
                out.write_all(&x.to_le_bytes())?;
            }
            out.write_all(&ray.self_id.to_le_bytes())?;
        }
        for found in &set.found {
            let t = if found.id >= 0 { found.t } else { -1.0 };
            out.write_all(&t.to_le_bytes())?;
        }
    }
    Ok(())
}
