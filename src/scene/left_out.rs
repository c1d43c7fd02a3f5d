//! What materials ask for that is not rendered.

use crate::scene::description::{Bsdf, Material};

/// What of materials is not rendered: names, and what it is.
pub(super) fn left_out_of(materials: &[Material]) -> impl Iterator<Item = (String, String)> {
    materials.iter().filter_map(|material| {
        let Bsdf::MetallicRoughness(m) = material.surface.bsdf else { return None };
        let parts = [("anisotropy", m.anisotropy > 0.0)];
        let parts: Vec<_> = parts.iter().filter(|(_, is_there)| *is_there).map(|(what, _)| *what).collect();
        let are = if parts.len() == 1 { "is" } else { "are" };
        (!parts.is_empty()).then(|| (format!("material {:?}", material.name), format!("{} {are}", parts.join(", "))))
    })
}
