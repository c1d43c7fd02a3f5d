//! Specialization constants: their ids, their names, and what their values follow from.

use glam::DVec3;

use crate::accel;
use crate::gpu::Specialization;

use crate::render::kernel::features::Features;
use crate::render::kernel::layout::constant::{MAX_CONSTANT_SPHERES, MAX_POLYGONS};
use crate::render::kernel::layout::{POLYGON_CONSTANTS, SPHERE_CONSTANTS};
use crate::render::light::emitter::{Light, LightShape};
use crate::render::light::table::LightTable;
use crate::render::scene::spheres::ConstantSphere;
use crate::render::scene::tables::Tables;
use crate::render::settings::feature::{FeatureFlags, FeatureRow};
use crate::render::settings::{RenderSettings, Sampler};

/// What constants follow from.
pub(crate) struct Compiled<'a> {
    pub features: &'a Features,
    pub tables: &'a Tables,
    pub settings: &'a RenderSettings,
    pub launch: LaunchConstants,
}

/// What is decided about a kernel when it is known on which device it runs. The default is for a kernel that traces no image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LaunchConstants {
    pub workgroup: u32,
    pub subgroup: u32,
    pub loop_budget: u32,
    pub regions: u32,
    pub enough_lanes: u32,
    pub split: u32,
    pub light_samples: u32,
    pub casters: u32,
    /// Levels of the sampler's table, if there are to be more than the scene's samples need.
    pub sobol_levels: u32,
    pub persistent_threads: bool,
    pub reuse: bool,
    pub sample_map: bool,
    pub threads: bool,
    pub shuffles: bool,
    pub tables_in_arrays: bool,
}

impl Default for LaunchConstants {
    fn default() -> Self {
        Self {
            workgroup: 64,
            subgroup: 8,
            loop_budget: 0,
            regions: 64,
            enough_lanes: 5,
            split: 1,
            light_samples: 1,
            casters: 0,
            sobol_levels: 0,
            persistent_threads: false,
            reuse: false,
            sample_map: false,
            threads: false,
            shuffles: false,
            tables_in_arrays: false,
        }
    }
}

/// A constant as Vulkan takes it: 32 bits.
trait Word {
    fn word(self) -> u32;
}

impl Word for u32 {
    fn word(self) -> u32 {
        self
    }
}

impl Word for bool {
    fn word(self) -> u32 {
        u32::from(self)
    }
}

/// Whether something is on, and why.
type Explanation = fn(&Features) -> (bool, String);

/// A constant that is no [`Feature`](crate::render::Feature).
struct Constant {
    id: u32,
    #[cfg_attr(not(test), allow(dead_code))]
    name: &'static str,
    value: fn(&Compiled<'_>) -> u32,
    /// For `info`: what it is called there, whether it is on, and why.
    explained: Option<(&'static str, Explanation)>,
}

/// The table of the constants that are no features: adding one is a row here and its line in layout.glsl.
///
/// `ID NAME: type = value`, and what `info` says of it, if anything: `, "name": whether it is on, and why`.
macro_rules! constants {
    ($($id:literal $name:ident: $type:ty = |$c:ident| $value:expr
        $(, $what:literal: |$f:ident| $explained:expr)?;)*) => {
        /// Ids of specialization constants.
        #[allow(dead_code)]
        pub(crate) mod id {
            $(pub const $name: u32 = $id;)*
        }

        const CONSTANTS: &[Constant] = &[$(Constant {
            id: $id,
            name: stringify!($name),
            value: |$c| {
                let value: $type = $value;
                value.word()
            },
            explained: constants!(@explained $($what: |$f| $explained)?),
        }),*];
    };
    (@explained $what:literal: |$f:ident| $explained:expr) => { Some(($what, |$f| $explained)) };
    (@explained) => { None };
}

constants! {
    61 WORKGROUP: u32 = |c| c.launch.workgroup;
    105 TABLES_IN_ARRAYS: bool = |c| c.launch.tables_in_arrays;
    1 FILTER: u32 = |c| u32::from(c.features.gaussian),
        "gaussian filter": |f| why(f.gaussian, "film.filter is gaussian", "film.filter is box");
    2 SAMPLER: u32 = |c| match c.features.sampler {
        Sampler::Sobol => 0,
        Sampler::Independent => 1,
        Sampler::Pcg => 2,
    }, "sobol sampler": |f| (f.sampler == Sampler::Sobol, match f.sampler {
        Sampler::Sobol => format!("{} table level(s) for the number of samples", f.sobol_levels),
        Sampler::Independent => "independent numbers were asked for".to_owned(),
        Sampler::Pcg => "numbers of PCG were asked for".to_owned(),
    });
    3 SOBOL_LEVELS: u32 = |c| c.features.sobol_levels.max(c.launch.sobol_levels);
    4 MAX_DEPTH: u32 = |c| c.features.max_depth,
        "bounces": |f| (f.max_depth > 1, format!("max_depth is {}", f.max_depth));
    5 ROULETTE_DEPTH: u32 = |c| c.features.roulette,
        "russian roulette": |f| (f.roulette > 0, match f.roulette {
            0 => "off in the scene".to_owned(),
            first => format!("from hit {first} on"),
        });
    6 INDIRECT: bool = |c| c.features.indirect,
        "indirect light": |f|
            why(f.indirect && f.max_depth > 1, "paths go on after diffuse surfaces", "direct light only");
    16 BRUTE_FORCE: bool = |c| c.features.brute_force,
        "brute force": |f| why(f.brute_force, "no BVH was asked for", "the BVH is used");
    17 MOLLER_TRUMBORE: bool = |c| c.features.moller_trumbore,
        "moller-trumbore": |f| why(f.moller_trumbore, "was asked for", "the watertight test is used");
    60 USES_RAY_QUERY: bool = |c| c.features.ray_query,
        "ray query": |f| why(f.ray_query, "was asked for", "the BVH is used");
    107 QUERIES_TRIANGLES: bool = |c| c.features.queried_triangles;
    18 SPHERE_COUNT: u32 = |c| c.features.constant_spheres,
        "constant spheres": |f| (
            f.constant_spheres > 0,
            format!("{} of {MAX_CONSTANT_SPHERES} places, unrolled", f.constant_spheres),
        );
    19 POINT_INSIDE: u32 = |c| spheres_around_point(c.tables);
    20 POLYGON_COUNT: u32 = |c| c.features.polygons,
        "polygons": |f| (
            f.polygons > 0,
            format!("{} of {MAX_POLYGONS} places, unrolled: triangles and quadrilaterals of small meshes", f.polygons),
        );
    21 POLYGON_OCCLUDERS: u32 = |c| c.tables.polygon_occluders;
    22 POLYGONS_ACROSS_X: u32 = |c| polygons_across(c.tables, 0);
    23 POLYGONS_ACROSS_Y: u32 = |c| polygons_across(c.tables, 1);
    24 ROOT_BOX_COUNT: u32 = |c| c.tables.packed.root_boxes.len() as u32;
    25 STACK_LEVELS: u32 = |c| if c.features.deep_bvh { accel::MAX_DEPTH } else { c.tables.stack_levels() };
    26 LIGHT_COUNT: u32 = |c| c.tables.light_count,
        "point lights": |f| (f.lights > 0, match (f.lights, f.emitter) {
            (0, _) => "none can be seen".to_owned(),
            (1, false) => "1, a constant point".to_owned(),
            (n, false) => format!("{n}, one is chosen at each hit"),
            (n, true) => format!("{n}, one of these and the emitters is chosen at each hit"),
        });
    27 EMITTER_COUNT: u32 = |c| c.tables.light_count - c.tables.point_count;
    28 LIGHT_KINDS: u32 = |c| if c.features.light_kinds { LightTable::ALL_KINDS } else { c.tables.lights.kinds };
    29 LIGHT_NODES: u32 = |c| c.tables.lights.nodes;
    30 LIGHT_ENTRIES: u32 = |c| c.tables.lights.grid.entries;
    31 LIGHT_CELLS: u32 = |c| c.tables.lights.grid.cells;
    32 LIGHT_DEPTH: u32 = |c| c.tables.lights.grid.depth;
    33 LIGHT_LOOPS: u32 = |c| c.tables.lights.grid.loops() + if c.features.environment { 9 } else { 0 };
    59 SINGLE_POINT: bool = |c| c.tables.single_point.is_some();
    34 REUSE: bool = |c| c.launch.reuse,
        "path reuse": |f| why(
            f.reuse_may_pay(),
            "diffuse surfaces light each other: used if a pilot pass shows that it pays; on GPUs only in long \
             renderings, and not where glass fills the view",
            if f.can_reuse() {
                "unless asked for: most noise is that of emitters seen by way of glass and mirrors"
            } else {
                "no diffuse surface lights another"
            },
        );
    35 LIGHT_SAMPLES: u32 = |c| c.launch.light_samples;
    36 SAMPLE_MAP: bool = |c| c.launch.sample_map,
        "sample map": |f| why(
            f.emitter || f.reuse_may_pay(),
            "more samples at edges of bright emitters, through glass where light is traced, and in noisy parts where \
             paths are reused",
            "no surface emits, and no paths are reused",
        );
    37 CASTER_COUNT: u32 = |c| c.launch.casters,
        "light tracing": |f| why(
            f.may_trace_light(),
            "traced from emitters: glass or mirrors may make caustics",
            if f.emitter && (f.dielectric || f.mirror) {
                "not with a lens or parallel rays, without indirect light or a BVH"
            } else {
                "no emitters together with glass or mirrors"
            },
        );
    38 CASTER_TEXELS: u32 = |c| c.tables.splat_texels;
    39 THREADS: bool = |c| c.launch.threads;
    40 SHUFFLES: bool = |c| c.launch.shuffles;
    41 SUBGROUP_LANES: u32 = |c| c.launch.subgroup;
    42 PERSISTENT_THREADS: bool = |c| c.launch.persistent_threads;
    43 SPLIT: u32 = |c| c.launch.split;
    44 REGIONS: u32 = |c| c.launch.regions;
    45 ENOUGH_LANES: u32 = |c| c.launch.enough_lanes;
    46 LOOP_BUDGET: u32 = |c| c.launch.loop_budget;
    47 PATH_STATS: bool = |c| c.settings.count_steps;
    48 MUTATION: u32 = |c| c.settings.mutation.map_or(0, |m| m as u32);
}

fn why(is_on: bool, yes: &str, no: &str) -> (bool, String) {
    (is_on, if is_on { yes } else { no }.to_owned())
}

/// Bit n: the only light is a point inside of sphere n.
fn spheres_around_point(tables: &Tables) -> u32 {
    let Some(Light { shape: LightShape::Point(p), .. }) = tables.single_point else { return 0 };
    let is_inside = |s: &ConstantSphere| {
        let center = DVec3::from(s.center.map(f64::from));
        center.distance_squared(p) < f64::from(s.radius).powi(2)
    };
    tables.constant_spheres.iter().enumerate().map(|(i, s)| u32::from(is_inside(s)) << i).sum()
}

/// Bit n: the normal of polygon n is closest to that axis.
fn polygons_across(tables: &Tables, axis: usize) -> u32 {
    tables.polygons.iter().enumerate().map(|(i, f)| u32::from(f.axis() == axis) << i).sum()
}

impl Compiled<'_> {
    /// Values of all constants.
    pub fn specialization(&self) -> Specialization {
        let mut s = Specialization::default();
        for constant in CONSTANTS {
            s.uint(constant.id, (constant.value)(self));
        }
        for row in FeatureFlags::TABLE {
            if let Some((id, _)) = row.constant {
                s.bool(id, (row.is_on)(self.features));
            }
        }
        for (i, sphere) in self.tables.constant_spheres.iter().enumerate() {
            let base = SPHERE_CONSTANTS + 2 * i as u32;
            s.uint(base, sphere.side as u32).uint(base + 1, sphere.form as u32);
        }
        for (i, f) in self.tables.polygons.iter().enumerate() {
            let base = POLYGON_CONSTANTS + 16 * i as u32;
            let edges = f.edges().into_iter().flat_map(|edge| [edge.x, edge.y]);
            for (j, v) in edges.chain(f.normal.to_array()).enumerate() {
                s.float(base + j as u32, v as f32);
            }
        }
        s
    }
}

/// What is compiled in, or may be used: each feature's name, whether it is, and why.
pub fn explain(features: &Features) -> Vec<(&'static str, bool, String)> {
    let of_constant = |constant: &Constant| {
        let (name, explained) = constant.explained?;
        let (is_on, why) = explained(features);
        Some((name, is_on, why))
    };
    let of_feature = |row: &FeatureRow| {
        let is_on = (row.is_on)(features);
        (row.name, is_on, row.why[usize::from(!is_on)].to_owned())
    };
    CONSTANTS.iter().filter_map(of_constant).chain(FeatureFlags::TABLE.iter().map(of_feature)).collect()
}

/// Ids and names of all constants but those of the spheres and polygons that are written out.
#[cfg(test)]
pub(crate) fn names() -> impl Iterator<Item = (u32, &'static str)> {
    let of_features = FeatureFlags::TABLE.iter().filter_map(|row| row.constant);
    CONSTANTS.iter().map(|constant| (constant.id, constant.name)).chain(of_features)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::generate;
    use crate::render::space::RenderSpace;
    use crate::scene::{self, PixelFilter, Scene, Surface};

    fn specialization(scene: &Scene) -> Specialization {
        let settings = &RenderSettings::of(scene);
        let tables = &Tables::new(scene, &RenderSpace::of(scene), settings);
        let features = &Features::new(scene, tables, settings);
        Compiled { features, tables, settings, launch: LaunchConstants::default() }.specialization()
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
