//! What host and shader share: bindings, records and push constants of shaders/lib/layout.glsl, and numbers of geometry.glsl, sphere.glsl
//! and polygon.glsl. Specialization constants are in specialization.rs and features.rs.

use bytemuck::{Pod, Zeroable};

/// How many there is room for.
pub(crate) mod constant {
    /// Boxes around children of the BVH's root.
    pub const MAX_ROOT_BOXES: usize = crate::accel::WIDTH;
    /// Spheres that there are constants for.
    pub const MAX_CONSTANT_SPHERES: usize = 16;
    /// Polygons that there are constants for.
    pub const MAX_POLYGONS: usize = 32;
}

/// First specialization constant of the spheres that are written out, two ids each: side, form.
pub(crate) const SPHERE_CONSTANTS: u32 = 64;
/// First specialization constant of the polygons that are written out, sixteen ids each, of which eleven are in use: four edges (see
/// polygon.glsl), unit normal.
pub(crate) const POLYGON_CONSTANTS: u32 = 256;

/// Binding numbers.
pub(crate) mod binding {
    pub const BVH: u32 = 0;
    pub const GEOMETRY: u32 = 1;
    pub const SOBOL: u32 = 2;
    pub const LIGHTS: u32 = 3;
    pub const FILM: u32 = 4;
    /// The same, to write.
    pub const FILM_ROWS: u32 = 12;
    pub const COUNTERS: u32 = 5;
    /// What the queue's paths note.
    pub const PATHS: u32 = 6;
    /// Which regions of that are taken, a bit each.
    pub const QUEUE_POOL: u32 = 7;
    /// The same as `PATHS`, to read.
    pub const PATH_TEXELS: u32 = 8;
    pub const GRADIENTS: u32 = 9;
    /// The same, to write.
    pub const GRADIENT_ROWS: u32 = 13;
    /// What light paths light.
    pub const LIGHT_PATHS: u32 = 10;
    pub const SCENE: u32 = 11;
    pub const TEXTURES: u32 = 14;
    pub const ACCELERATION_STRUCTURE: u32 = 15;
    pub const FIRST_HITS: u32 = 16;
}

const _: () = assert!(cfg!(target_endian = "little"), "the words of a counter would change places");

/// What a dispatch counts, in the order of the shader's indices; each is two words there, the lower one first.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, Default, PartialEq, Eq)]
pub(crate) struct Counters {
    pub samples: u64,
    pub bad: u64,
    pub rays: u64,
    pub shadow_rays: u64,
    pub steps: u64,
    pub truncated: u64,
    pub reused: u64,
    pub subgroup_mismatches: u64,
    /// Pieces of work, or parts of them, that have been drawn, and as many more as workgroups or subgroups that drew in vain; the
    /// lower word of it.
    pub drawn: u64,
}

/// The numbers of a scene.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, PartialEq)]
pub(crate) struct SceneValues {
    /// Centre, radius; power; unused.
    pub spheres: [[[f32; 4]; 2]; constant::MAX_CONSTANT_SPHERES],
    /// Of each child of the BVH's root: lowest and highest corner.
    pub root_boxes: [[[f32; 4]; 2]; constant::MAX_ROOT_BOXES],
    /// Of the edges, and of the plane, what depends on where a polygon is.
    pub polygons: [[[f32; 4]; 2]; constant::MAX_POLYGONS],
    pub point_position: [f32; 4],
    pub point_intensity: [f32; 4],
    pub light_grid: [f32; 4],
    /// Half the image plane's width at distance 1, half its height, and the unit vector to its centre.
    pub camera_right: [f32; 4],
    pub camera_up: [f32; 4],
    pub camera_forward: [f32; 4],
    pub background: [f32; 4],
    pub record_count: u32,
    /// The last word of the root's record, which says in which order to visit its children.
    pub root_order: u32,
    /// Texels of the table of primitives (geometry.rs).
    pub first_material: u32,
    pub first_position: u32,
    pub first_normal: u32,
    pub first_detail: u32,
    pub first_uv: u32,
    pub first_color: u32,
    pub first_tangent: u32,
    /// Of light samples (light/table.rs).
    pub even_share: f32,
    /// Of the environment (light/environment.rs).
    pub environment_half: f32,
    pub environment_share: f32,
    pub environment_turn: [f32; 4],
    pub environment_map: [u32; 4],
    /// First texel of the albedos of glass; unused.
    pub glass_table: [u32; 4],
}

/// Push constants: what changes from dispatch to dispatch.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, Default, PartialEq)]
pub(crate) struct Push {
    pub work_items: u32,
    pub width: u32,
    pub height: u32,
    pub seed: u32,
    pub first_slot: u32,
    pub end_slot: u32,
    pub target_samples: u32,
    pub max_new_samples: u32,
    pub band_first: u32,
    pub tile_step: u32,
    pub work_item_stride: u32,
    pub modes: u32,
    pub band_rows: u32,
    pub other_samples: u32,
    pub light_path_scale: f32,
    pub tile_bits: u32,
    pub camera_sample: u32,
    pub follows_mirrors: u32,
}

/// Bits of [`Push::modes`].
pub(crate) mod mode {
    pub const SHIFTED: u32 = 1;
    pub const CORRELATED: u32 = 2;
    pub const SCATTERED: u32 = 4;
    pub const REUSED: u32 = 8;
    pub const TURN_SHIFT: u32 = 4;
}

/// Types of BSDFs (shaders/lib/bsdf/closure.glsl).
pub(crate) mod bsdf {
    pub const NONE: u32 = 0;
    pub const DIFFUSE: u32 = 1;
    pub const MIRROR: u32 = 2;
    pub const DIELECTRIC: u32 = 3;
    pub const METALLIC_ROUGHNESS: u32 = 4;
}

/// Textures (shaders/lib/texture.glsl, bsdf/albedo.glsl).
pub(crate) mod texture {
    /// Steps of the table of albedos along either axis.
    pub const ALBEDO_STEPS: usize = 64;
    /// Means of albedos.
    pub const ALBEDO_MEANS: usize = 256;
    pub const WRAP_V_SHIFT: u32 = 2;
    pub const SRGB: u32 = 0x10;
    pub const NEAREST: u32 = 0x20;
    pub const SECOND_UV: u32 = 0x40;
    pub const CODES_16: u32 = 0x80;
    pub const FLOATS: u32 = 0x100;
    /// Steps of roughness of the means of a slice of the table of glass (shaders/lib/bsdf/glass_albedo.glsl).
    pub const GLASS_MEANS: usize = 94;
}

/// Beside a primitive's material (geometry.rs).
pub(crate) mod flag {
    pub const SPHERE: u32 = 1 << 31;
    /// Its vertices have shading normals.
    pub const SMOOTH: u32 = 1 << 30;
    /// Of a material, beside the type of its BSDF: its back emits too.
    pub const TWO_SIDED: u32 = 1 << 8;
    /// Likewise: it has details (scene/materials.rs).
    pub const DETAILED: u32 = 1 << 9;
    /// Likewise: its emission has the colour of the vertices.
    pub const UNLIT: u32 = 1 << 10;
    /// Likewise: its microfacets are those of a conductor.
    pub const CONDUCTOR: u32 = 1 << 11;
}

/// A pixel of the film buffer.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, Default, PartialEq)]
pub(crate) struct FilmSlot {
    pub sum: [f32; 3],
    pub count: u32,
    pub compensation: [f32; 3],
    /// How far the first two samples are apart in the light that does not come by what groups share.
    pub pilot: f32,
    pub residue: [f32; 3],
    /// The pixel's multipliers (src/render/sampling/sample_map.rs).
    pub multipliers: u32,
}

/// A pixel that a light path lights (shaders/light_trace.comp).
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, Default, PartialEq)]
pub(crate) struct SplatRecord {
    pub light: [f32; 3],
    /// Its number, or one of those below.
    pub pixel: u32,
}

impl SplatRecord {
    /// Most records of a light path.
    pub const MOST: u32 = 16;
    /// The light path has no further ones.
    pub const NO_PIXEL: u32 = u32::MAX;
    /// The loop budget was spent before the light path ended.
    pub const UNFINISHED: u32 = u32::MAX - 1;
}

/// What a camera ray meets first (shaders/first_hit.comp).
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, Default, PartialEq)]
pub(crate) struct FirstHit {
    pub position: [f32; 3],
    /// Length of the ray, or of the part after the last mirror.
    pub t: f32,
    /// Geometric.
    pub normal: [f32; 3],
    /// -1: the ray meets nothing.
    pub primitive: i32,
    pub shading: [f32; 3],
    pub instance: i32,
    pub albedo: [f32; 3],
    pub material: u32,
    /// Brightness of what is emitted towards the camera.
    pub emitted: f32,
    /// Bits of [`first_hit`].
    pub flags: u32,
    pub unused: [u32; 2],
}

impl FirstHit {
    /// Whether all of these flags are set.
    pub fn is(&self, flags: u32) -> bool {
        self.flags & flags == flags
    }
}

/// Bits of [`FirstHit::flags`], and which ray is traced.
pub(crate) mod first_hit {
    pub const MET: u32 = 1;
    pub const RECONNECTABLE: u32 = 2;
    pub const GLASS: u32 = 4;
    pub const BY_MIRRORS: u32 = 8;
    /// In place of the number of a sample: the ray through the centre of the pixel.
    pub const CENTER: u32 = u32::MAX;
}

/// Where a film's slot has its pixel's multipliers (shaders/lib/sample_map.glsl).
pub(crate) mod multiplier {
    /// Of either.
    pub const BITS: u32 = 4;
    /// In groups as they are.
    pub const PLAIN: u32 = 0;
    /// In shifted ones.
    pub const SHIFTED: u32 = 4;
}

/// What shaders/path_queue.comp is written for.
pub(crate) mod queue {
    /// Pixels of a workgroup.
    pub const TILE: u32 = 64;
    /// Paths of a workgroup in one dispatch.
    pub const PATHS: u32 = 2048;
    /// Texels of a path's records.
    pub const PATH_ROWS: u32 = 11;
    /// Tiles of which a scattered one is made.
    pub const SCATTERED_TILES: u32 = 8;
    /// Samples of the pilot pass whether it pays to reuse paths.
    pub const PILOT_SAMPLES: u32 = 2;
    /// Samples of a pixel of which gradients are recorded.
    pub const MOST_GRADIENTS: u32 = 4096;
}

/// What a slot's pixel has gathered of light by what it shares with its neighbours
/// (shaders/lib/gradient.glsl): its sum, and those of the differences from the neighbours on the right and below, each with
/// the difference between the two samples of the pilot pass.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable, Default, PartialEq)]
pub(crate) struct GradientSlot {
    pub light: [f32; 3],
    pub pilot_light: f32,
    pub right: [f32; 3],
    pub pilot_right: f32,
    pub down: [f32; 3],
    pub pilot_down: f32,
}

impl FilmSlot {
    /// Sum of the samples of a channel: its three parts, the smallest first.
    pub fn total(&self, channel: usize) -> f64 {
        [self.residue, self.compensation, self.sum].iter().map(|part| f64::from(part[channel])).sum()
    }
}
