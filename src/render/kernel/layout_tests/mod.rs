//! The numbers in layout.rs against the compiled shaders, by SPIR-V reflection.

mod aliased;
mod reflect;

use std::collections::BTreeMap;
use std::mem::offset_of;

use crate::anisotropic_albedo;
use crate::render::film::tiling;
use crate::render::kernel::layout::{
    Counters, FilmSlot, FirstHit, GradientSlot, POLYGON_CONSTANTS, Push, SPHERE_CONSTANTS, SceneValues, SplatRecord,
    binding, bsdf, constant, first_hit, flag, mode, multiplier, queue,
};
use crate::render::kernel::layout_tests::reflect::{Interface, interface};
use crate::render::kernel::sobol;
use crate::render::kernel::specialization::{self, id};
use crate::render::kernel::{FIRST_HIT, LIGHT_TRACE, PATH_KERNELS};
use crate::render::light::table;
use crate::render::scene::tables;
use crate::render::settings::mutation::Mutation;
use crate::sheen_albedo;

/// Every specialization constant that the shaders may have, by name.
fn expected_constants() -> BTreeMap<String, u32> {
    let mut all: BTreeMap<_, _> = specialization::names().map(|(id, name)| (name.to_owned(), id)).collect();
    // The size of the workgroup has no name in SPIR-V.
    all.remove("WORKGROUP");
    all.insert(String::new(), id::WORKGROUP);
    let mut add = |prefix: &str, base: u32, names: &[&str]| {
        all.extend(names.iter().zip(base..).map(|(name, id)| (format!("{prefix}_{name}"), id)));
    };
    for i in 0..constant::MAX_CONSTANT_SPHERES {
        add(&format!("SPHERE_{i}"), SPHERE_CONSTANTS + 2 * i as u32, &["SIDE", "FORM"]);
    }
    for i in 0..constant::MAX_POLYGONS {
        let names = ["AX", "AY", "BX", "BY", "CX", "CY", "DX", "DY", "NX", "NY", "NZ"];
        add(&format!("POLYGON_{i}"), POLYGON_CONSTANTS + 16 * i as u32, &names);
    }
    all
}

/// The path tracing kernels, and that of light paths.
fn kernels() -> Vec<(&'static str, Interface)> {
    PATH_KERNELS
        .into_iter()
        .chain([LIGHT_TRACE, FIRST_HIT])
        .map(|kernel| (kernel.name, interface(kernel.spirv)))
        .collect()
}

/// A kernel may leave out what it does not use: none may have a constant that the host does not know of or knows by
/// another number, and all together have all of them.
#[test]
fn specialization_constants() {
    let expected = expected_constants();
    let mut all = BTreeMap::new();
    for (kernel, interface) in kernels() {
        let found: BTreeMap<_, _> = interface.constants.iter().cloned().collect();
        assert_eq!(found.len(), interface.constants.len(), "{kernel}: a name is there twice");
        for (name, id) in &found {
            assert_eq!(expected.get(name), Some(id), "{kernel} has {name} = {id}");
        }
        all.extend(found);
    }
    assert_eq!(all, expected);
    let mut ids: Vec<_> = expected.values().collect();
    ids.sort_unstable();
    assert!(ids.windows(2).all(|w| w[0] != w[1]), "an id is used twice");
}

#[test]
fn bindings() {
    let all = [
        (binding::BVH, "BvhArray", true),
        (binding::BVH, "bvh_texels", false),
        (binding::GEOMETRY, "GeometryArray", true),
        (binding::GEOMETRY, "geometry_texels", false),
        (binding::SOBOL, "SobolArray", true),
        (binding::SOBOL, "sobol_texels", false),
        (binding::LIGHTS, "LightArray", true),
        (binding::LIGHTS, "light_texels", false),
        (binding::FILM, "film_texels", false),
        (binding::COUNTERS, "Counters", true),
        (binding::PATHS, "Paths", true),
        (binding::QUEUE_POOL, "QueuePool", true),
        (binding::PATH_TEXELS, "path_texels", false),
        (binding::GRADIENTS, "gradient_texels", false),
        (binding::LIGHT_PATHS, "splat_texels", false),
        (binding::SCENE, "SceneValues", false),
        (binding::FILM_ROWS, "Film", true),
        (binding::FILM_ROWS, "FilmWords", true),
        (binding::GRADIENT_ROWS, "GradientRows", true),
        (binding::TEXTURES, "TextureArray", true),
        (binding::TEXTURES, "texture_texels", false),
        (binding::ACCELERATION_STRUCTURE, "acceleration_structure", false),
        (binding::FIRST_HITS, "FirstHitRows", true),
    ]
    .map(|(number, name, storage)| (0, number, name.to_owned(), storage));
    for (kernel, interface) in kernels() {
        let mut known = all.to_vec();
        known.retain(|(_, number, ..)| kernel == LIGHT_TRACE.name || *number != binding::LIGHT_PATHS);
        assert_eq!(interface.bindings, known, "{kernel}");
    }
}

#[test]
fn push_constants() {
    let expected = [
        ("work_items", offset_of!(Push, work_items)),
        ("width", offset_of!(Push, width)),
        ("height", offset_of!(Push, height)),
        ("seed", offset_of!(Push, seed)),
        ("first_slot", offset_of!(Push, first_slot)),
        ("end_slot", offset_of!(Push, end_slot)),
        ("target_samples", offset_of!(Push, target_samples)),
        ("max_new_samples", offset_of!(Push, max_new_samples)),
        ("band_first", offset_of!(Push, band_first)),
        ("tile_step", offset_of!(Push, tile_step)),
        ("work_item_stride", offset_of!(Push, work_item_stride)),
        ("modes", offset_of!(Push, modes)),
        ("band_rows", offset_of!(Push, band_rows)),
        ("other_samples", offset_of!(Push, other_samples)),
        ("light_path_scale", offset_of!(Push, light_path_scale)),
        ("tile_bits", offset_of!(Push, tile_bits)),
        ("camera_sample", offset_of!(Push, camera_sample)),
        ("follows_mirrors", offset_of!(Push, follows_mirrors)),
    ]
    .map(|(name, offset)| (name.to_owned(), offset));
    for (kernel, interface) in kernels() {
        assert_eq!(interface.push, expected, "{kernel}");
        assert_eq!(interface.push_bytes, size_of::<Push>(), "{kernel}");
        // The least that every Vulkan device allows.
        assert!(interface.push_bytes <= 128, "{kernel}");
    }
}

/// The numbers of a scene.
#[test]
fn scene_values() {
    let expected = [
        ("sphere_values", offset_of!(SceneValues, spheres)),
        ("root_box_values", offset_of!(SceneValues, root_boxes)),
        ("polygon_values", offset_of!(SceneValues, polygons)),
        ("point_position", offset_of!(SceneValues, point_position)),
        ("point_intensity", offset_of!(SceneValues, point_intensity)),
        ("light_grid", offset_of!(SceneValues, light_grid)),
        ("camera_right", offset_of!(SceneValues, camera_right)),
        ("camera_up", offset_of!(SceneValues, camera_up)),
        ("camera_forward", offset_of!(SceneValues, camera_forward)),
        ("background", offset_of!(SceneValues, background)),
        ("record_count", offset_of!(SceneValues, record_count)),
        ("root_order", offset_of!(SceneValues, root_order)),
        ("first_material", offset_of!(SceneValues, first_material)),
        ("first_position", offset_of!(SceneValues, first_position)),
        ("first_normal", offset_of!(SceneValues, first_normal)),
        ("first_detail", offset_of!(SceneValues, first_detail)),
        ("first_uv", offset_of!(SceneValues, first_uv)),
        ("first_color", offset_of!(SceneValues, first_color)),
        ("first_tangent", offset_of!(SceneValues, first_tangent)),
        ("even_share", offset_of!(SceneValues, even_share)),
        ("environment_half", offset_of!(SceneValues, environment_half)),
        ("environment_share", offset_of!(SceneValues, environment_share)),
        ("environment_turn", offset_of!(SceneValues, environment_turn)),
        ("environment_map", offset_of!(SceneValues, environment_map)),
        ("glass_table", offset_of!(SceneValues, glass_table)),
    ]
    .map(|(name, offset)| (name.to_owned(), offset));
    for (kernel, interface) in kernels() {
        assert_eq!(interface.values, expected, "{kernel}");
    }
    // The least that every Vulkan device allows.
    assert!(size_of::<SceneValues>() <= 16384);
}

/// The records of storage buffers are arrays to the shaders, which index them by the sizes that are held here.
#[test]
fn records() {
    assert_eq!((offset_of!(FilmSlot, count), offset_of!(FilmSlot, compensation)), (12, 16));
    assert_eq!((offset_of!(FilmSlot, residue), size_of::<FilmSlot>()), (32, 48));
    let order = include_str!("../../../../shaders/lib/pixel_order.glsl");
    assert!(order.contains(&format!("const uint TILE_BITS = {}u;", queue::TILE.ilog2())));
    assert!(order.contains(&format!("const uint MEMBERS = {}u;", tiling::MEMBERS)));
    let sampler = include_str!("../../../../shaders/lib/sampler.glsl");
    assert!(sampler.contains(&format!("const uint LEVEL_BITS = {}u;", sobol::LEVEL_BITS)));
    assert!(sampler.contains(&format!("const uint COLUMN_GAP = {}u;", sobol::COLUMN_GAP)));
    assert!(sampler.contains(&format!("const uint MEMBER_SHIFT = {}u;", sobol::MAX_SAMPLES.ilog2())));
    let records = include_str!("../../../../shaders/lib/reuse_queue.glsl");
    assert!(records.contains(&format!("const uint SLOT_BITS = {}u;", queue::PATHS.ilog2())));
    let layout = include_str!("../../../../shaders/lib/layout.glsl");
    let gradient = include_str!("../../../../shaders/lib/gradient.glsl");
    assert!(gradient.contains(&format!("const uint PILOT_SAMPLES = {}u;", queue::PILOT_SAMPLES)));
    assert!(gradient.contains(&format!("const uint MOST_GRADIENTS = {}u;", queue::MOST_GRADIENTS)));
    assert_eq!((offset_of!(GradientSlot, right), offset_of!(GradientSlot, down)), (16, 32));
    assert!(layout.contains(&format!("const uint GRADIENT_ROWS = {}u;", size_of::<GradientSlot>() / 16)));
    assert!(order.contains(&format!("const uint SCATTERED_TILES = {}u;", queue::SCATTERED_TILES)));
    let map = include_str!("../../../../shaders/lib/sample_map.glsl");
    assert!(map.contains(&format!("const int MULTIPLIER_BITS = {};", multiplier::BITS)));
    assert!(map.contains(&format!("const int PLAIN_MULTIPLIER = {};", multiplier::PLAIN)));
    assert!(map.contains("const int SHIFTED_MULTIPLIER = MULTIPLIER_BITS;") && multiplier::SHIFTED == multiplier::BITS);
    for (name, bit) in [
        ("MODE_SHIFTED", mode::SHIFTED),
        ("MODE_CORRELATED", mode::CORRELATED),
        ("MODE_SCATTERED", mode::SCATTERED),
        ("MODE_REUSED", mode::REUSED),
        ("MODES_TURN", mode::TURN_SHIFT),
    ] {
        assert!(layout.contains(&format!("const uint {name} = {bit}u;")), "{name}");
    }
    assert!(layout.contains(&format!("const uint PATH_ROWS = {}u;", queue::PATH_ROWS)));
    let light_trace = include_str!("../../../../shaders/light_trace.comp");
    assert!(light_trace.contains(&format!("const uint NO_PIXEL = {:#x}u;", SplatRecord::NO_PIXEL)));
    assert!(light_trace.contains(&format!("const uint UNFINISHED = {:#x}u;", SplatRecord::UNFINISHED)));
    assert!(layout.contains(&format!("const uint FIRST_HIT_ROWS = {}u;", size_of::<FirstHit>() / 16)));
    assert!(layout.contains(&format!("const uint CENTER = {:#x}u;", first_hit::CENTER)));
    let first_hit_shader = include_str!("../../../../shaders/first_hit.comp");
    for (name, bit) in [
        ("MET", first_hit::MET),
        ("RECONNECTABLE", first_hit::RECONNECTABLE),
        ("GLASS", first_hit::GLASS),
        ("BY_MIRRORS", first_hit::BY_MIRRORS),
    ] {
        assert!(first_hit_shader.contains(&format!("const uint {name} = {bit}u;")), "{name}");
    }
    let light_path = include_str!("../../../../shaders/lib/light_tracing.glsl");
    assert!(light_path.contains(&format!("const uint LIGHT_PATH_HITS = {}u;", SplatRecord::MOST + 1)));
    assert_eq!((offset_of!(SplatRecord, pixel), size_of::<SplatRecord>()), (12, 16));
    for (name, offset) in [
        ("COUNT_SAMPLES", offset_of!(Counters, samples)),
        ("COUNT_BAD", offset_of!(Counters, bad)),
        ("COUNT_RAYS", offset_of!(Counters, rays)),
        ("COUNT_SHADOW", offset_of!(Counters, shadow_rays)),
        ("COUNT_STEPS", offset_of!(Counters, steps)),
        ("COUNT_TRUNCATED", offset_of!(Counters, truncated)),
        ("COUNT_REUSED", offset_of!(Counters, reused)),
        ("COUNT_SUBGROUP_MISMATCHES", offset_of!(Counters, subgroup_mismatches)),
        ("COUNT_WORK_ITEMS", offset_of!(Counters, drawn)),
    ] {
        let line = format!("const uint {name} = {}u;", offset / size_of::<u64>());
        assert!(layout.contains(&line), "layout.glsl should have `{line}`");
    }
}

/// Numbers that say what something is.
#[test]
fn kinds_and_mutations() {
    let geometry = include_str!("../../../../shaders/lib/geometry.glsl");
    let closure = include_str!("../../../../shaders/lib/bsdf/closure.glsl");
    for (name, of_bsdf) in [
        ("NONE", bsdf::NONE),
        ("DIFFUSE", bsdf::DIFFUSE),
        ("MIRROR", bsdf::MIRROR),
        ("DIELECTRIC", bsdf::DIELECTRIC),
        ("METALLIC_ROUGHNESS", bsdf::METALLIC_ROUGHNESS),
    ] {
        assert!(closure.contains(&format!("const uint BSDF_{name} = {of_bsdf}u;")), "{name}");
    }
    for (name, bits) in
        [("IS_SPHERE", flag::SPHERE), ("IS_SMOOTH", flag::SMOOTH), ("MATERIAL_BITS", !(flag::SPHERE | flag::SMOOTH))]
    {
        assert!(geometry.contains(&format!("const uint {name} = {bits:#010x}u;")), "{name}");
    }
    let albedo = include_str!("../../../../shaders/lib/bsdf/albedo.glsl");
    let [a, b, c, d] = anisotropic_albedo::STEPS;
    for expected in [
        format!("ANISOTROPIC_STEPS = uvec4({a}u, {b}u, {c}u, {d}u);"),
        format!("ANISOTROPIC_CELLS = {a}u * {b}u * {c}u * {d}u;"),
        format!("ANISOTROPIC_CELLS + {c}u * {d}u;"),
        format!("ALBEDO_STEPS = {}u;", sheen_albedo::STEPS),
    ] {
        assert!(albedo.contains(&expected), "{expected}");
    }
    let material = include_str!("../../../../shaders/lib/material.glsl");
    assert!(material.contains(&format!("const uint CONDUCTOR = {:#x}u;", flag::CONDUCTOR)));
    let light = include_str!("../../../../shaders/lib/light/light.glsl");
    for (name, kind) in [
        ("POINT", table::kind::POINT),
        ("TRIANGLE", table::kind::TRIANGLE),
        ("SPHERE", table::kind::SPHERE),
        ("INWARD", table::kind::INWARD),
        ("PARALLELOGRAM", table::kind::PARALLELOGRAM),
        ("RECTANGLE", table::kind::RECTANGLE),
    ] {
        assert!(light.contains(&format!("const uint LIGHT_{name} = {kind}u;")), "{name}");
    }
    let traversal = include_str!("../../../../shaders/lib/intersect/bvh/traversal.glsl");
    assert!(traversal.contains(&format!("const int BVH_ID = {:#010x};", tables::BVH_ID)));
    // These are the host's.
    let layout = include_str!("../../../../shaders/lib/layout.glsl");
    let of_shaders =
        |line: &str| line.strip_prefix("const uint MUTATE_")?.split_once(" = ")?.1.strip_suffix("u;")?.parse().ok();
    let found: Vec<u32> = layout.lines().filter_map(of_shaders).collect();
    let of_host = [
        Mutation::ThinBoxes,
        Mutation::OwnSampleMap,
        Mutation::FlushEmitters,
        Mutation::QueriedThinBoxes,
        Mutation::QueriedEpsilonBoxes,
        Mutation::QueriedLostLeaf,
    ];
    let expected = Mutation::ALL.into_iter().filter(|m| !of_host.contains(m)).map(|m| m as u32);
    assert_eq!(found, expected.collect::<Vec<_>>());
}
