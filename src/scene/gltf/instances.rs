//! EXT_mesh_gpu_instancing: copies of a node's mesh.

use std::collections::BTreeMap;

use glam::{DMat4, DQuat, DVec3};
use gltf::json::accessor::Type;
use serde::Deserialize;

use crate::scene::error::SceneError;
use crate::scene::gltf::document::Document;

/// Most copies of a node's mesh: each is a mesh of its own here.
const MOST_COPIES: usize = 1 << 20;

#[derive(Deserialize)]
struct Instancing {
    attributes: BTreeMap<String, usize>,
}

impl Document<'_> {
    /// Transforms of the copies to their node; one that changes nothing where there are none.
    pub fn instances(&self, node: usize) -> Result<Vec<DMat4>, SceneError> {
        let at = format!("node {node}, EXT_mesh_gpu_instancing");
        let extensions = self.root.nodes[node].extensions.as_ref().map(|extensions| &extensions.others);
        let Some(instancing) = self.extension::<Instancing>(extensions, "EXT_mesh_gpu_instancing", &at)? else {
            return Ok(vec![DMat4::IDENTITY]);
        };
        let read = |name: &str, kind: Type, missing: f64| match instancing.attributes.get(name) {
            Some(&index) => self.vectors::<4>(index, &format!("{at}, {name}"), &[kind], missing),
            None => Ok(Vec::new()),
        };
        let translations = read("TRANSLATION", Type::Vec3, 0.0)?;
        let rotations = read("ROTATION", Type::Vec4, 0.0)?;
        let scales = read("SCALE", Type::Vec3, 1.0)?;
        let count = translations.len().max(rotations.len()).max(scales.len());
        if count > MOST_COPIES {
            return Err(self.error(at, format!("{count} copies"), format!("at most {MOST_COPIES}")));
        }
        let vector = |all: &[[f64; 4]], i: usize, missing| all.get(i).map_or(missing, |v| DVec3::new(v[0], v[1], v[2]));
        let instance = |i| {
            let rotation = rotations.get(i).map_or(DQuat::IDENTITY, |&q| DQuat::from_array(q).normalize());
            let scale = vector(&scales, i, DVec3::ONE);
            DMat4::from_scale_rotation_translation(scale, rotation, vector(&translations, i, DVec3::ZERO))
        };
        Ok((0..count).map(instance).collect())
    }
}
