//! What a kernel is specialised for, of a scene.

use glam::DVec3;

use crate::accel;
use crate::gpu::Specialization;

use crate::render::kernel::driver_traits::DriverTraits;
use crate::render::kernel::features::Features;
use crate::render::kernel::layout::constant;
use crate::render::light::emitter::{Light, LightShape};
use crate::render::light::table::LightTable;
use crate::render::scene::spheres::ConstantSphere;
use crate::render::scene::tables::Tables;
use crate::render::settings::{RenderSettings, Sampler};

/// Values of all specialization constants but the workgroup's size and the loop budget.
pub(crate) fn specialization(
    tables: &Tables,
    features: &Features,
    settings: &RenderSettings,
    traits: DriverTraits,
) -> Specialization {
    let mut s = Specialization::default();
    s.uint(constant::FILTER, u32::from(features.gaussian))
        .uint(
            constant::SAMPLER,
            match features.sampler {
                Sampler::Sobol => 0,
                Sampler::Independent => 1,
                Sampler::Pcg => 2,
            },
        )
        .uint(constant::MAX_DEPTH, features.max_depth)
        .uint(constant::ROULETTE_DEPTH, features.roulette)
        .bool(constant::INDIRECT, features.indirect)
        .bool(constant::HAS_DIFFUSE, features.diffuse)
        .bool(constant::HAS_MIRROR, features.mirror)
        .bool(constant::HAS_DIELECTRIC, features.dielectric)
        .bool(constant::HAS_EMITTER, features.emitter)
        .bool(constant::HAS_BACKGROUND, features.background)
        .uint(constant::SPHERE_COUNT, features.constant_spheres)
        .bool(constant::HAS_BVH, features.tree)
        .bool(constant::BVH_SPHERES, features.bvh_spheres)
        .bool(constant::BVH_TRIANGLES, features.bvh_triangles)
        .bool(constant::BRUTE_FORCE, features.brute_force)
        .bool(constant::MOLLER_TRUMBORE, features.moller_trumbore)
        .bool(constant::SMOOTH_NORMALS, features.smooth_normals)
        .uint(constant::LIGHT_COUNT, tables.light_count)
        .uint(constant::EMITTER_COUNT, tables.light_count - tables.point_count)
        .uint(constant::LIGHT_KINDS, if features.light_kinds { LightTable::ALL_KINDS } else { tables.lights.kinds })
        .uint(constant::LIGHT_NODES, tables.lights.nodes)
        .uint(constant::LIGHT_ENTRIES, tables.lights.grid.entries)
        .uint(constant::LIGHT_CELLS, tables.lights.grid.cells)
        .uint(constant::LIGHT_DEPTH, tables.lights.grid.depth)
        .uint(constant::CASTER_TEXELS, tables.splat_texels)
        .uint(constant::LIGHT_LOOPS, tables.lights.grid.loops())
        .uint(constant::SOBOL_LEVELS, features.sobol_levels)
        .bool(constant::THREADS, traits.threads)
        .bool(constant::SHUFFLES, traits.shuffles)
        .uint(constant::ROOT_BOX_COUNT, tables.packed.root_boxes.len() as u32)
        .uint(constant::STACK_LEVELS, if features.deep_bvh { accel::MAX_DEPTH } else { tables.stack_levels() })
        .uint(constant::MUTATION, settings.mutation.map_or(0, |m| m as u32))
        .bool(constant::PATH_STATS, settings.count_steps);
    for (i, sphere) in tables.constant_spheres.iter().enumerate() {
        let base = constant::SPHERES + 2 * i as u32;
        s.uint(base, sphere.side as u32).uint(base + 1, sphere.form as u32);
    }
    if let Some(Light { shape: LightShape::Point(p), .. }) = tables.single_point {
        let is_inside = |s: &ConstantSphere| {
            let center = DVec3::from(s.center.map(f64::from));
            center.distance_squared(p) < f64::from(s.radius).powi(2)
        };
        let inside = tables.constant_spheres.iter().enumerate().map(|(i, s)| u32::from(is_inside(s)) << i).sum();
        s.uint(constant::POINT_INSIDE, inside);
    }
    s.uint(constant::POLYGON_COUNT, tables.polygons.len() as u32)
        .uint(constant::POLYGON_OCCLUDERS, tables.polygon_occluders);
    let across = |axis| tables.polygons.iter().enumerate().map(|(i, f)| u32::from(f.axis() == axis) << i).sum();
    s.uint(constant::POLYGONS_ACROSS_X, across(0)).uint(constant::POLYGONS_ACROSS_Y, across(1));
    for (i, f) in tables.polygons.iter().enumerate() {
        let base = constant::POLYGONS + 16 * i as u32;
        let edges = f.edges().into_iter().flat_map(|edge| [edge.x, edge.y]);
        for (j, v) in edges.chain(f.normal.to_array()).enumerate() {
            s.float(base + j as u32, v as f32);
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::specialization as specialize;
    use super::*;
    use crate::bench::generate;
    use crate::render::kernel::driver_traits::Sharers;
    use crate::render::space::RenderSpace;
    use crate::scene;
    use crate::scene::{PixelFilter, Scene, Surface};

    fn specialization(scene: &Scene) -> Specialization {
        let settings = RenderSettings::of(scene);
        let traits = DriverTraits {
            loop_budget: 0,
            workgroup_size: 64,
            queue: true,
            reuse: Sharers::Lanes,
            threads: false,
            shuffles: false,
            groups_fit: true,
            invocations: 0,
            queue_regions: 64,
        };
        let tables = Tables::new(scene, &RenderSpace::of(scene), &settings);
        specialize(&tables, &Features::new(scene, &tables, &settings), &settings, traits)
    }

    /// Drivers compile a kernel for each set of constants, which takes longer than many a rendering.
    #[test]
    fn what_moves_compiles_nothing_anew() {
        let room = r#"
            version = 1
            [camera]
            position = [0, 0, 5]
            target = [0, 0, 0]
            horizontal_fov = 40
            [film]
            width = 8
            height = 8
            [[material]]
            name = "grey"
            type = "diffuse"
            reflectance = [0.5, 0.5, 0.5]
            [[material]]
            name = "glass"
            type = "dielectric"
            ior = 1.5
            [[sphere]]
            center = [0, -1000, 0]
            radius = 999
            material = "grey"
            [[sphere]]
            center = [0, 0, 0]
            radius = 1
            material = "glass"
            [[light]]
            type = "point"
            position = [2, 3, 4]
            power = [1, 1, 1]
        "#;
        let room = Scene::from_toml_str(room, "room", None).unwrap().scene;
        let cornell = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/cornell.toml");
        let cornell = Scene::load(std::path::Path::new(cornell)).unwrap().scene;
        for scene in [room.clone(), generate::terrain(200), cornell] {
            let constants = specialization(&scene);
            let mut moved = scene.clone();
            moved.camera.position += DVec3::new(0.11, 0.07, -0.13);
            moved.camera.target.x += 0.3;
            assert_eq!(specialization(&moved), constants, "{}", scene.source);
        }
        let mut moved = room.clone();
        moved.spheres[1].center.y += 0.25;
        moved.spheres[1].radius = 0.9;
        moved.materials[1].surface = Surface::dielectric(1.6);
        moved.lights = vec![scene::Light::Point { position: DVec3::new(-2.0, 3.0, 1.0), power: [2.0, 3.0, 4.0] }];
        assert_eq!(specialization(&moved), specialization(&room));
        // What another kind of light or surface needs is compiled.
        moved.film.filter = PixelFilter::Gaussian;
        moved.materials[1].surface = Surface::mirror([1.0; 3]);
        assert_ne!(specialization(&moved), specialization(&room));
    }
}
