//! What is not seen against what is.

use crate::scene::description::{Integrator, Material, Scene, Surface};

impl Scene {
    /// A scene whose image shows the share of each pixel's camera rays that meet nothing: black surfaces before a background of 1. With
    /// the same seed and number of samples the rays are those of the scene itself.
    pub fn silhouette(&self, samples: u32) -> Self {
        let black =
            |material: &Material| Material { surface: Surface::emitter([0.0; 3]), unlit: false, ..material.clone() };
        Self {
            integrator: Integrator { max_depth: 1, samples, russian_roulette: None, indirect: false },
            background: [1.0; 3],
            environment: None,
            materials: self.materials.iter().map(black).collect(),
            lights: Vec::new(),
            ..self.clone()
        }
    }
}
