//! The hierarchy of nodes: where each of them is, at some time.

use glam::{DMat4, DQuat, DVec3};

use crate::scene::error::SceneError;
use crate::scene::gltf::animation::Pose;
use crate::scene::gltf::document::{Document, number};

/// A node of the scene, and its transform to world space.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    pub node: usize,
    pub to_world: DMat4,
}

impl Document<'_> {
    /// The nodes of a scene, parents before their children.
    ///
    /// # Errors
    /// A node that does not exist, or that is below another one twice.
    pub fn placed_nodes(&self, pose: &Pose) -> Result<Vec<Placed>, SceneError> {
        let nodes = &self.root.nodes;
        let roots: Vec<usize> = match self.root.scene.map(number).or((!self.root.scenes.is_empty()).then_some(0)) {
            Some(scene) => {
                self.get(&self.root.scenes, scene, "scene", "scene")?.nodes.iter().map(|&n| number(n)).collect()
            }
            // Without scenes all nodes that are below no other.
            None => {
                let children = nodes.iter().flat_map(|node| node.children.iter().flatten().map(|&child| number(child)));
                let children: std::collections::HashSet<usize> = children.collect();
                (0..nodes.len()).filter(|node| !children.contains(node)).collect()
            }
        };
        let mut placed = Vec::new();
        let mut seen = vec![false; nodes.len()];
        let mut open: Vec<_> = roots.into_iter().rev().map(|node| (node, DMat4::IDENTITY)).collect();
        while let Some((index, parent)) = open.pop() {
            let node = self.get(nodes, index, "node", "scene")?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(self.error(
                    format!("node {index}"),
                    "below more than one node, or below itself",
                    "one parent",
                ));
            }
            let to_world = parent * self.local(index, pose);
            if !to_world.is_finite() {
                return Err(self.error(format!("node {index}"), "a transform that is not finite", "finite numbers"));
            }
            placed.push(Placed { node: index, to_world });
            open.extend(node.children.iter().flatten().rev().map(|&child| (number(child), to_world)));
        }
        Ok(placed)
    }

    /// The transform of a node to its parent.
    fn local(&self, index: usize, pose: &Pose) -> DMat4 {
        let node = &self.root.nodes[index];
        let posed = pose.of_node(index);
        if let (Some(matrix), false) = (node.matrix, posed.is_moved()) {
            return DMat4::from_cols_array(&matrix.map(f64::from));
        }
        let vector = |v: Option<[f32; 3]>, missing: DVec3| v.map_or(missing, |v| DVec3::from(v.map(f64::from)));
        let translation = posed.translation.unwrap_or_else(|| vector(node.translation, DVec3::ZERO));
        let scale = posed.scale.unwrap_or_else(|| vector(node.scale, DVec3::ONE));
        let rotation = posed.rotation.unwrap_or_else(|| {
            let given = node.rotation.map_or([0.0, 0.0, 0.0, 1.0], |rotation| rotation.0.map(f64::from));
            DQuat::from_array(given)
        });
        let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
        DMat4::from_scale_rotation_translation(scale, rotation, translation)
    }
}
