//! The cases, by topic. The numbers of their rows in the literature of renderer tests are not kept: names are.

mod barriers;
mod bvh;
mod cameras;
mod conductors;
mod constants;
mod determinism;
mod emitters;
mod energy;
mod environment;
mod film;
mod glass;
mod hit_points;
mod lanes;
mod layered;
mod light;
mod lights;
mod loops;
mod materials;
mod oracle;
mod query;
mod query_flags;
mod query_triangles;
mod reuse;
mod rough_glass;
mod sampling;
mod scale;
mod slivers;
mod smooth_caustics;
mod spawn;
mod spheres;
mod timelines;
mod triangles;

use crate::check::Case;

/// All cases, in the order in which they run: what others build on comes first.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    [
        constants::CASES,
        loops::CASES,
        lanes::CASES,
        barriers::CASES,
        timelines::CASES,
        sampling::CASES,
        spheres::CASES,
        triangles::CASES,
        slivers::CASES,
        hit_points::CASES,
        spawn::CASES,
        bvh::CASES,
        query::CASES,
        query_triangles::CASES,
        query_flags::CASES,
        glass::CASES,
        light::CASES,
        lights::CASES,
        emitters::CASES,
        energy::CASES,
        materials::CASES,
        environment::CASES,
        layered::CASES,
        rough_glass::CASES,
        conductors::CASES,
        scale::CASES,
        cameras::CASES,
        film::CASES,
        determinism::CASES,
        oracle::CASES,
        smooth_caustics::CASES,
        reuse::CASES,
    ]
    .into_iter()
    .flatten()
}
