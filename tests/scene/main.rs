//! Scenes: the files they come from, what is refused, and the meshes that are shipped.

#[path = "../common/mod.rs"]
mod common;

mod cat_mesh;
mod glb;
mod gltf_files;
mod gltf_hostile;
mod mtl_files;
mod obj_files;
mod robustness;
mod scene_files;
mod scene_models;
mod scene_textures;
mod validate;
