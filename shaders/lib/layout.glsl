// What host and shader share: specialization constants, bindings, push constants, record layouts.
// src/render/kernel/ holds the same numbers; a test compares the two by SPIR-V reflection.
//
// Render space: the camera is the origin, and one unit is the power of two near the scene's size, so that
// scenes far from their origin, huge or tiny, are traced with the same bits as ordinary ones.

#ifndef LAYOUT_GLSL
#define LAYOUT_GLSL

// ---- specialization constants: code depends on them, data layout never does. Id 0 is the size of a workgroup; the spheres and polygons
// that are written out have blocks of ids of their own (intersect/sphere.glsl from 64, intersect/polygon.glsl from 256).
// src/render/kernel/specialization.rs and features.rs say what they follow from.
layout(constant_id = 1) const uint FILTER = 0u;             // 0 box, 1 Gaussian
layout(constant_id = 56) const bool HAS_LENS = false;       // see camera.glsl
layout(constant_id = 57) const bool ORTHOGRAPHIC = false;
layout(constant_id = 2) const uint SAMPLER = 0u;            // 0 Owen-scrambled Sobol, 1 independent, 2 PCG
layout(constant_id = 3) const uint SOBOL_LEVELS = 1u;       // table levels: samples <= 2^10, 2^20, 2^29
layout(constant_id = 4) const uint MAX_DEPTH = 8u;          // surface hits of a path
layout(constant_id = 5) const uint ROULETTE_DEPTH = 0u;     // first hit that may end a path; 0: off
layout(constant_id = 6) const bool INDIRECT = true;         // follow paths beyond a diffuse surface
layout(constant_id = 7) const bool HAS_DIFFUSE = true;
layout(constant_id = 8) const bool HAS_MIRROR = true;
layout(constant_id = 9) const bool HAS_DIELECTRIC = true;
layout(constant_id = 10) const bool HAS_EMITTER = true;
layout(constant_id = 11) const bool HAS_BACKGROUND = true;
layout(constant_id = 12) const bool HAS_BVH = false;        // triangles, or more spheres than fit into constants
layout(constant_id = 13) const bool BVH_SPHERES = false;    // the BVH has sphere leaves
layout(constant_id = 14) const bool BVH_TRIANGLES = true;   // the BVH has triangle leaves
layout(constant_id = 15) const bool SMOOTH_NORMALS = false;
layout(constant_id = 16) const bool BRUTE_FORCE = false;    // test every leaf record instead of traversing the BVH
layout(constant_id = 17) const bool MOLLER_TRUMBORE = false;
#ifdef RAY_QUERY
layout(constant_id = 60) const bool USES_RAY_QUERY = false; // the device finds the BVH's leaves, see intersect/query.glsl
layout(constant_id = 107) const bool QUERIES_TRIANGLES = false; // and tests triangles, see intersect/query_triangles.glsl
#endif
layout(constant_id = 18) const uint SPHERE_COUNT = 0u;      // constant spheres, see intersect/sphere.glsl
layout(constant_id = 19) const uint POINT_INSIDE = 0u;      // bit n: the only light, a point, is inside of sphere n
layout(constant_id = 20) const uint POLYGON_COUNT = 0u;     // constant flat polygons, see intersect/polygon.glsl
layout(constant_id = 21) const uint POLYGON_OCCLUDERS = 0xffffffffu;    // bit n: polygon n may lie between two points of the scene
layout(constant_id = 22) const uint POLYGONS_ACROSS_X = 0u; // bit n: the normal of polygon n is closest to the x axis
layout(constant_id = 23) const uint POLYGONS_ACROSS_Y = 0u; // to the y axis
layout(constant_id = 24) const uint ROOT_BOX_COUNT = 0u;    // boxes around the children of the BVH's root
layout(constant_id = 25) const uint STACK_LEVELS = 64u;     // entries that its traversal needs on the stack
layout(constant_id = 26) const uint LIGHT_COUNT = 0u;       // lights: points and emitters
layout(constant_id = 59) const bool SINGLE_POINT = false;   // the only light is a point
layout(constant_id = 27) const uint EMITTER_COUNT = 0u;     // emitters among them
layout(constant_id = 28) const uint LIGHT_KINDS = 0u;       // kinds of lights that there are, a bit each, see light/light.glsl
layout(constant_id = 29) const uint LIGHT_NODES = 0u;       // texels before those of the lights, see light/choice.glsl
layout(constant_id = 30) const uint LIGHT_ENTRIES = 1u;     // of a cell of the lights' grid: a power of two
layout(constant_id = 31) const uint LIGHT_CELLS = 1u;       // along an axis
layout(constant_id = 32) const uint LIGHT_DEPTH = 0u;       // levels of the light tree below what an entry stands for
layout(constant_id = 33) const uint LIGHT_LOOPS = 0u;       // loop iterations that choosing lights takes at a hit
layout(constant_id = 34) const bool REUSE = false;          // paths serve several pixels, see reuse.glsl
layout(constant_id = 35) const uint LIGHT_SAMPLES = 1u;     // where such paths first meet a diffuse surface: up to 4
layout(constant_id = 36) const bool SAMPLE_MAP = false;     // numbers of samples differ between pixels, see sample_map.glsl
layout(constant_id = 37) const uint CASTER_COUNT = 0u;      // bodies of glass and mirrors that light paths go to; 0: no light paths
layout(constant_id = 38) const uint CASTER_TEXELS = 0u;     // texels of lights before theirs
layout(constant_id = 39) const bool THREADS = false;        // lanes are threads of a GPU, see intersect/bvh/traversal.glsl
layout(constant_id = 40) const bool SHUFFLES = false;       // lanes read each other's registers in one instruction; without THREADS there are eight
layout(constant_id = 41) const uint SUBGROUP_LANES = 8u;    // of each subgroup; where paths are reused, whole groups
layout(constant_id = 42) const bool PERSISTENT_THREADS = false;     // pieces of work are drawn, see work.glsl
layout(constant_id = 43) const uint SPLIT = 1u;             // invocations for a pixel, see split.glsl
layout(constant_id = 44) const uint REGIONS = 64u;          // for records of paths, which workgroups share; a multiple of 32
layout(constant_id = 45) const uint ENOUGH_LANES = 5u;      // with fewer at work, a subgroup turns to what else there is
layout(constant_id = 46) const uint LOOP_BUDGET = 0u;       // loop iterations of an invocation; 0: no bound
layout(constant_id = 47) const bool PATH_STATS = false;     // count rays and traversal steps
layout(constant_id = 49) const bool HAS_METALLIC_ROUGHNESS = false;
layout(constant_id = 50) const bool HAS_DETAILS = false;    // materials with textures, vertex colours or the metallic-roughness model
layout(constant_id = 51) const bool HAS_TEXTURES = false;
layout(constant_id = 52) const bool HAS_VERTEX_COLORS = false;
layout(constant_id = 53) const bool HAS_NORMAL_MAPS = false;
layout(constant_id = 54) const bool HAS_COVERAGE = false;   // surfaces with alpha
layout(constant_id = 55) const bool HAS_VARIED_EMISSION = false;     // emitters with textures or alpha
layout(constant_id = 58) const bool HAS_ENVIRONMENT = false;     // the background is a map, see light/environment.glsl
layout(constant_id = 62) const bool HAS_TRANSMISSION = false;    // of the metallic-roughness model
layout(constant_id = 63) const bool HAS_ABSORPTION = false;      // bodies with an inside that absorbs light
layout(constant_id = 100) const bool HAS_SPECULAR_TEXTURES = false;  // reflection of dielectrics
layout(constant_id = 101) const bool HAS_COAT = false;       // clear coats
layout(constant_id = 102) const bool HAS_SHEEN = false;
layout(constant_id = 103) const bool HAS_ANISOTROPY = false;
layout(constant_id = 106) const bool HAS_CULLED_BACKS = false;     // surfaces that let rays pass from behind
layout(constant_id = 104) const bool HAS_CONDUCTOR = false; // metals by their complex index, rough mirrors
layout(constant_id = 105) const bool TABLES_IN_ARRAYS = false;    // see the bindings
layout(constant_id = 48) const uint MUTATION = 0u;          // tests only: breaks one thing, see src/render/settings/mutation.rs
// Simple operands: glslang makes control flow of others, for which there is no place here.
const bool HAS_DENSITIES = HAS_DIFFUSE || HAS_METALLIC_ROUGHNESS;   // some BSDF is no distribution of single directions
const bool HAS_LAYERS = HAS_SPECULAR_TEXTURES || HAS_COAT || HAS_SHEEN || HAS_ANISOTROPY || HAS_CONDUCTOR;    // of some material, see material.glsl
const bool HAS_COVER = HAS_COAT || HAS_SHEEN;    // something may lie over surfaces
const bool HAS_PASSABLE = HAS_COVERAGE || HAS_CULLED_BACKS;     // rays may pass surfaces
const bool HAS_PARTS = REUSE && HAS_METALLIC_ROUGHNESS;     // of surfaces, one of which pixels share, see bsdf/parts.glsl
const bool LETS_THROUGH = HAS_DIELECTRIC || HAS_TRANSMISSION;
const bool HAS_LIGHTS = LIGHT_COUNT > 0u || HAS_ENVIRONMENT;
const bool SAMPLES_LIGHTS = HAS_DENSITIES && HAS_LIGHTS;
const bool MEETS_LIGHTS = EMITTER_COUNT > 0u || HAS_ENVIRONMENT;   // rays may meet by chance what is sampled

// Values of MUTATION (src/render/settings/mutation.rs): errors in transport, then numerical protections taken away.
const uint MUTATE_ALBEDO = 1u;
const uint MUTATE_COSINE = 2u;
const uint MUTATE_IOR = 3u;
const uint MUTATE_TMIN = 4u;
const uint MUTATE_SAMPLER = 5u;
const uint MUTATE_EDGES = 6u;
const uint MUTATE_OFFSET = 7u;
const uint MUTATE_SKIP = 8u;
const uint MUTATE_BOX_MARGIN = 9u;
const uint MUTATE_SPHERE = 10u;
const uint MUTATE_FILM = 11u;
const uint MUTATE_GUARD = 12u;
const uint MUTATE_FINITE = 13u;
const uint MUTATE_RESIDUE = 15u;
const uint MUTATE_SINCOS = 16u;
const uint MUTATE_LOG = 17u;
const uint MUTATE_FRESNEL = 18u;
const uint MUTATE_BARYCENTRIC = 19u;
const uint MUTATE_PROJECTION = 20u;
const uint MUTATE_INVERSE = 21u;
const uint MUTATE_REUSE = 22u;
const uint MUTATE_DOUBT = 23u;
const uint MUTATE_ALL_MARGINS = 24u;
const uint MUTATE_GRADIENTS = 26u;
const uint MUTATE_LIGHT_TRACING = 27u;
const uint MUTATE_LIMB = 28u;
const uint MUTATE_BEND = 29u;
const uint MUTATE_CHOICE = 30u;
const uint MUTATE_MULTIPLE = 32u;
const uint MUTATE_COUPLING = 33u;
const uint MUTATE_VISIBLE_NORMALS = 34u;
const uint MUTATE_SRGB = 35u;
const uint MUTATE_TANGENT = 36u;
const uint MUTATE_ALPHA = 37u;
const uint MUTATE_SPOT = 40u;
const uint MUTATE_RANGE = 41u;
const uint MUTATE_TURN = 42u;
const uint MUTATE_SINE = 43u;
const uint MUTATE_LENS = 38u;
const uint MUTATE_VIEW = 39u;
const uint MUTATE_QUERY_DISTANCE = 47u;
const uint MUTATE_QUERY_TIES = 48u;
const uint MUTATE_QUERY_MASK = 49u;
const uint MUTATE_QUERY_SELF = 66u;
const uint MUTATE_SPECULAR = 60u;
const uint MUTATE_WAY_OUT = 61u;
const uint MUTATE_COAT_NORMAL = 62u;
const uint MUTATE_SHEEN = 63u;
const uint MUTATE_REFRACTION = 50u;
const uint MUTATE_WALL = 51u;
const uint MUTATE_SHADOW = 52u;
const uint MUTATE_ANISOTROPY = 64u;
const uint MUTATE_CONDUCTOR = 65u;
const uint MUTATE_ADJOINT = 70u;
const uint MUTATE_PARTS = 71u;

// ---- bindings
// All texels are bits, of numbers too: lavapipe compiles five functions for each format that it meets, and small integers
// among numbers cannot be taken for denormal ones.
// Tables are texels or, where a device has texel buffers that are too small for them, arrays at the same bindings.
layout(binding = 0) uniform usamplerBuffer bvh_texels;    // 3 texels a record, then 2 numbers a record, see intersect/bvh/; for ray queries handles
layout(binding = 1) uniform usamplerBuffer geometry_texels;    // primitives, materials and vertices, see geometry.glsl
layout(binding = 2) uniform usamplerBuffer sobol_texels;   // see sampler.glsl
layout(binding = 3) uniform usamplerBuffer light_texels;   // see light/
layout(binding = 14) uniform usamplerBuffer texture_texels;    // see texture.glsl
#ifdef RAY_QUERY
layout(binding = 15) uniform accelerationStructureEXT acceleration_structure;   // boxes around leaves of the BVH, or triangles, see intersect/query.glsl
#endif
layout(std430, binding = 0) readonly buffer BvhArray { uvec4 bvh_array[]; };
layout(std430, binding = 1) readonly buffer GeometryArray { uvec4 geometry_array[]; };
layout(std430, binding = 2) readonly buffer SobolArray { uvec4 sobol_array[]; };
layout(std430, binding = 3) readonly buffer LightArray { uvec4 light_array[]; };
layout(std430, binding = 14) readonly buffer TextureArray { uvec4 texture_array[]; };
#define TABLE(NAME, GET) \
    uvec4 GET(int i) { if (TABLES_IN_ARRAYS) return NAME##_array[i]; return texelFetch(NAME##_texels, i); }
TABLE(bvh, bvh_texel)
TABLE(geometry, geometry_texel)
TABLE(sobol, sobol_texel)
TABLE(light, light_bits)
TABLE(texture, texture_texel)
vec4 light_texel(int row) { return uintBitsToFloat(light_bits(row)); }
// What kernels both read and write is texels to read and an array to write. On lavapipe a vec4 of an array is 4 scalar accesses for
// each lane, all of them unrolled: much to compile, so that such a write should be in one place. A texel is one call, which
// takes six times as long where it writes.
layout(rgba32ui, binding = 4) readonly uniform uimageBuffer film_texels;    // FILM_ROWS texels a slot, see film.glsl
layout(std430, binding = 12) writeonly buffer Film { uvec4 film_rows[]; };
layout(std430, binding = 12) writeonly buffer FilmWords { uint film_words[]; };
const uint FILM_ROWS = 3u;
layout(std430, binding = 5) buffer Counters { uint counters[]; };         // two words each, see counting.glsl
// What path_queue.comp records of its paths; and light of samples, see split.glsl.
layout(std430, binding = 6) coherent buffer Paths { vec4 path_rows[]; };    // PATH_ROWS a path, see reuse_queue.glsl
layout(rgba32ui, binding = 8) coherent readonly uniform uimageBuffer path_texels;
layout(std430, binding = 7) coherent buffer QueuePool { uint pool[]; };
const uint PATH_ROWS = 11u;
// With REUSE: GRADIENT_ROWS texels a slot, see gradient.glsl.
layout(rgba32ui, binding = 9) readonly uniform uimageBuffer gradient_texels;
layout(std430, binding = 13) writeonly buffer GradientRows { vec4 gradient_rows[]; };
const uint GRADIENT_ROWS = 3u;
layout(std430, binding = 16) writeonly buffer FirstHitRows { uvec4 first_hit_rows[]; };    // FIRST_HIT_ROWS a ray, see first_hit.comp
const uint FIRST_HIT_ROWS = 5u;

// The numbers of a scene, of which only how many there are is compiled in: a kernel serves all scenes of a kind, and is not
// compiled anew because something moves.
layout(std140, binding = 11) uniform SceneValues {
    vec4 sphere_values[32];     // two for each constant sphere: centre, radius; |centre|² − radius²
    vec4 root_box_values[8];    // two for each child of the BVH's root: lowest corner; highest corner
    vec4 polygon_values[64];      // two for each polygon: of its four edges the parts that depend on where it is; n·a
    vec4 point_position;        // of the only light, if that is a point
    vec4 point_intensity;
    vec4 light_grid;            // centre of the lights' grid, and its size
    vec4 camera_right;          // xyz: half the image plane's width at distance 1, or where parallel rays start; w: radius of the lens, or 0
    vec4 camera_up;             // xyz: half its height; w: distance of what is in focus
    vec4 camera_forward;        // xyz: unit; w: 1 where rays are parallel, else 0
    vec4 background;            // rgb radiance
    uint record_count;          // of the BVH
    uint root_order;            // last word of the root's record: in which order to visit its children, see node.glsl
    uint first_material;        // texels of the table of primitives, see geometry.glsl
    uint first_position;
    uint first_normal;
    uint first_detail;
    uint first_uv;
    uint first_color;
    uint first_tangent;
    float even_share;           // of light samples, see light/choice.glsl
    float environment_half;     // probability of the left half of the map, see light/environment.glsl
    float environment_share;    // of light samples; the others are of lights
    vec4 environment_turn;      // cosine and sine of its rotation, scale; 1 if the camera sees it
    uvec4 environment_map;      // first texel, width, height, first texel of the density
    uvec4 glass_table;          // first texel of the albedos of glass, see bsdf/glass_albedo.glsl; -
};

// What is counted (src/render/kernel/layout.rs).
const uint COUNT_SAMPLES = 0u;     // samples committed by this dispatch
const uint COUNT_BAD = 1u;         // samples that were NaN or infinite
const uint COUNT_RAYS = 2u;        // closest-hit rays
const uint COUNT_SHADOW = 3u;      // shadow rays
const uint COUNT_STEPS = 4u;       // steps through the BVH (with PATH_STATS)
const uint COUNT_TRUNCATED = 5u;   // loops that nothing in the shader ended
const uint COUNT_REUSED = 6u;      // samples made with paths that serve several pixels
const uint COUNTERS = 7u;          // so many of every invocation
const uint COUNT_SUBGROUP_MISMATCHES = 7u;     // subgroups that are not as large as was asked for
const uint COUNT_WORK_ITEMS = 8u;       // pieces of work, or parts of them, that have been drawn, see work.glsl

// What changes from dispatch to dispatch.
layout(push_constant, std430) uniform Push {
    uint work_items;        // of the dispatch's work, see work.glsl
    uint width;
    uint height;
    uint seed;
    uint first_slot;        // slots (see pixel_order.glsl) of this dispatch
    uint end_slot;
    uint target_samples;    // per pixel, in all, see sample_map.glsl
    uint max_new_samples;   // per pixel, in this dispatch
    uint band_first;        // first slot of the film buffer
    uint tile_step;         // every n-th tile of 64 slots is worked on
    uint work_item_stride;  // piece i of n of the work is that of number i·stride mod n, see work.glsl
    uint modes;             // MODE_…
    uint band_rows;         // of pixels, in the film buffer, if groups may be shifted
    uint other_samples;     // of the samples per pixel, those in groups that lie elsewhere, see sample_map.glsl
    float light_path_scale; // 0: paths leave no light to light paths, see light_tracing.glsl
    uint tile_bits;         // log2 of the tiles of a workgroup of path_queue.comp
    uint camera_sample;     // whose rays first_hit.comp traces; CENTER: through the centres of pixels and of the lens
    uint follows_mirrors;   // 1: first_hit.comp looks for what is seen in mirrors
};

const uint MODE_SHIFTED = 1u;       // groups lie elsewhere, see pixel_order.glsl
const uint MODE_CORRELATED = 2u;         // pixels of a group sample lights alike, see reuse.glsl
const uint MODE_SCATTERED = 4u;     // one group of every tile is worked on, see pixel_order.glsl
const uint MODE_REUSED = 8u;        // paths serve several pixels, see reuse.glsl
const uint MODES_TURN = 4u;         // bits from there on: of these, which

const uint CENTER = 0xffffffffu;

bool in_mode(uint mode) { return (modes & mode) != 0u; }

#endif
