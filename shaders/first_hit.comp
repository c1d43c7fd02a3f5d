#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_maximal_reconvergence : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// What the camera sees: one ray a pixel, and the surface that it meets. Nothing else happens here to a ray, so this is the kernel to read
// first: the camera makes a ray (lib/camera.glsl), the scene is searched for what it meets (lib/intersect/intersect.glsl), and the hit
// becomes a surface with a BSDF (lib/vertex.glsl). lib/path.glsl goes on from there.
//
// Techniques learn from it what the picture shows before they take samples (src/render/first_hit.rs). They ask for rays that go on from
// mirrors, to the first surface that is none.

#include "lib/camera.glsl"
#include "lib/counting.glsl"
#include "lib/pixel_order.glsl"
#include "lib/vertex.glsl"
#include "lib/votes.glsl"

layout(local_size_x_id = 61, local_size_y = 1, local_size_z = 1) in;

// Flags of what a ray has met.
const uint MET = 1u;                // anything: else only `emitted` is known, and flags
const uint RECONNECTABLE = 2u;      // a part of it at least, see bsdf.glsl
const uint GLASS = 4u;
const uint BY_MIRRORS = 8u;         // a mirror, last or on the way

struct FirstHit {
    vec3 position;
    float t;            // length of the ray, or of its part after the last mirror
    vec3 normal;        // geometric, on the side of the ray
    vec3 shading;       // shading normal, likewise
    vec3 albedo;        // an estimate, see bsdf.glsl
    int primitive;
    int instance;
    uint material;
    float emitted;      // brightness of light from the surface, and from mirrors on the way, that comes back along the ray
    uint flags;
};

// The ray of the pixel at column and row `at`.
Ray first_ray(uvec2 at) {
    Camera camera = frame_camera();
    CameraRay ray = camera_ray(camera, vec2(at) + 0.5, vec2(0.0));
    if (camera_sample != CENTER) {
        uint key = pixel_key(pixel_number(at));
        ray = sampled_camera_ray(camera, at, sample_pair(key, camera_sample, PAIR_PIXEL, 0u), key, camera_sample);
    }
    return Ray(ray.origin, ray.direction, -1);
}

uint flags_of(Bsdf b) {
    uint flags = MET;
    if (is_reconnectable(b) || (HAS_PARTS && has_parts(b))) flags |= RECONNECTABLE;
    if (HAS_DIELECTRIC && b.type == BSDF_DIELECTRIC) flags |= GLASS;
    if (HAS_MIRROR && b.type == BSDF_MIRROR) flags |= BY_MIRRORS;
    return flags;
}

// The ray that a mirror sends on.
Ray mirrored_ray(Vertex v, Ray ray) {
    vec3 direction = mirrored(-ray.direction, v.normal);
    if (SMOOTH_NORMALS) direction = on_side(direction, v.up);
    return Ray(v.outside, direction, self_id_of(v.self_id, v.surface, v.front));
}

// Traces a ray to what it meets, or from mirror to mirror if these are followed: as far as a path goes, and one hit further, where a path
// may still meet light. Lanes wait for each other, since they read what others hold (lib/lane_table.glsl).
FirstHit trace(Ray ray, inout uint loops) {
    FirstHit first;
    first.emitted = 0.0;
    first.flags = 0u;
    vec3 throughput = vec3(1.0);
    uint hits = 0u;
    bool going = true;
    do {
        Hit hit = intersect(ray, loops);
        Vertex v = vertex_at(hit, ray);
        bool met = hit.primitive >= 0;
        hits += 1u;
        loops += 1u;
        if (going) {
            first.position = v.surface.position;
            first.t = hit.t;
            first.normal = v.up;
            first.shading = v.normal;
            first.albedo = bsdf_albedo(v.bsdf);
            first.primitive = hit.primitive;
            first.instance = hit.instance;
            first.material = material_index(primitive_shape(max(hit.primitive, 0)).w);
            first.flags = (first.flags & BY_MIRRORS) | (met && hits <= MAX_DEPTH ? flags_of(v.bsdf) : 0u);
            if (HAS_EMITTER && met && shines_from(v.surface.material, v.front)) {
                first.emitted += brightness(throughput * v.surface.material.emission);
            }
        }
        going = going && met && follows_mirrors != 0u && hits <= MAX_DEPTH && (LOOP_BUDGET == 0u || loops < LOOP_BUDGET);
        if (HAS_MIRROR) {
            going = going && v.bsdf.type == BSDF_MIRROR;
            throughput *= v.bsdf.reflectance;
            ray = mirrored_ray(v, ray);
        }
        going = HAS_MIRROR && going && throughput != vec3(0.0);
    } while (any_lane(going));
    return first;
}

// Rows in a loop are less code to compile (lib/layout.glsl).
void store(uint place, FirstHit first) {
    uint row = FIRST_HIT_ROWS * place;
    [[dont_unroll]] for (uint i = 0u; i < FIRST_HIT_ROWS; ++i) {
        uvec4 value = uvec4(floatBitsToUint(first.position), floatBitsToUint(first.t));
        if (i == 1u) value = uvec4(floatBitsToUint(first.normal), uint(first.primitive));
        if (i == 2u) value = uvec4(floatBitsToUint(first.shading), uint(first.instance));
        if (i == 3u) value = uvec4(floatBitsToUint(first.albedo), first.material);
        if (i == 4u) value = uvec4(floatBitsToUint(first.emitted), first.flags, 0u, 0u);
        first_hit_rows[row + i] = value;
    }
}

void main() [[maximally_reconverges]] {
    load_intersection();
    load_constants();
    uint place = gl_GlobalInvocationID.x;
    uvec2 at;
    bool real = first_slot + place < end_slot && pixel_of_slot(first_slot + place, at);
    uint loops = 0u;
    FirstHit first = trace(first_ray(at), loops);
    if (real) store(place, first);
    // A traversal that has run out of its budget may have ended too early: the pixel does not count as done.
    uint done = real && (LOOP_BUDGET == 0u || loops < LOOP_BUDGET) ? 1u : 0u;
    add_counts(Counts(done, 0u, 0u, real ? 1u : 0u, 0u, 0u, 0u));
}
