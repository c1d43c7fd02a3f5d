//! The renderer by its API: what it renders, that the bits do not depend on how, and that the validation layers have nothing to say.

#[path = "../common/assets.rs"]
mod assets;
#[path = "../common/mod.rs"]
mod common;
#[path = "../scene/glb.rs"]
mod glb;
mod harness;
mod variants;

mod acceleration;
mod adaptive;
mod determinism;
mod gltf_features;
mod gradients;
mod light;
mod light_tracing;
mod random_scenes;
mod resume;
mod seen_surfaces;
mod shader_folder;
mod shipped_scenes;
mod validation;
