//! The scene, compiled to what kernels read.

pub(crate) mod casters;
pub(crate) mod collect;
pub(crate) mod containment;
pub(crate) mod coplanar;
pub(crate) mod emission;
mod fresnel;
pub(crate) mod geometry;
pub(crate) mod light_paths;
pub(crate) mod materials;
pub(crate) mod polygons;
pub(crate) mod query_geometry;
pub(crate) mod spheres;
pub(crate) mod tables;
pub(crate) mod textures;
