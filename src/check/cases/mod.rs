//! The cases, by topic. The numbers of their rows in the literature of renderer tests are not kept: names are.

mod bvh;
mod cameras;
mod determinism;
mod emitters;
mod energy;
mod film;
mod glass;
mod hit_points;
mod light;
mod lights;
mod materials;
mod oracle;
mod reuse;
mod rough_glass;
mod sampling;
mod scale;
mod slivers;
mod spawn;
mod spheres;
mod triangles;

use crate::check::Case;

/// All cases, in the order in which they run: what others build on comes first.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    [
        sampling::CASES,
        spheres::CASES,
        triangles::CASES,
        slivers::CASES,
        hit_points::CASES,
        spawn::CASES,
        bvh::CASES,
        glass::CASES,
        light::CASES,
        lights::CASES,
        emitters::CASES,
        energy::CASES,
        materials::CASES,
        rough_glass::CASES,
        scale::CASES,
        cameras::CASES,
        film::CASES,
        determinism::CASES,
        oracle::CASES,
        reuse::CASES,
    ]
    .into_iter()
    .flatten()
}
