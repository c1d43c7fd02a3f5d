#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// What the camera sees: one ray a pixel, and the surface that it meets. This is all that happens to a ray, without light: the camera makes
// it (camera.glsl), the scene is searched for what it meets (intersect/), and the hit becomes a surface with a BSDF (vertex.glsl).
//
// Techniques learn from it what the picture shows before they take samples (src/render/first_hit.rs). For them a ray may go on from
// mirrors to the first surface that is none.

#include "lib/camera.glsl"
#include "lib/counting.glsl"
#include "lib/pixel_order.glsl"
#include "lib/vertex.glsl"

layout(local_size_x_id = 61, local_size_y = 1, local_size_z = 1) in;

// Of what a ray has met. The others mean nothing where it has met nothing.
const uint MET = 1u;
const uint RECONNECTABLE = 2u;      // see bsdf.glsl
const uint GLASS = 4u;
const uint BY_MIRRORS = 8u;         // it has met a mirror

struct FirstHit {
    vec3 position;
    float t;            // length of the ray, or of the part after the last mirror
    vec3 normal;        // geometric, and the shading normal, on the side of the ray
    int primitive;
    vec3 shading;
    int instance;
    vec3 albedo;        // an estimate, see bsdf.glsl
    uint material;
    float emitted;      // brightness that the surface, and mirrors on the way, send back along the ray
    uint flags;
};

// Which ray to trace for the pixel at column and row `at`.
CameraRay first_ray(uvec2 at) {
    Camera camera = frame_camera();
    if (camera_sample == CENTER) return camera_ray(camera, vec2(at) + 0.5, vec2(0.0));
    uint key = pixel_key(pixel_number(at));
    return sampled_camera_ray(camera, at, sample_pair(key, camera_sample, PAIR_PIXEL, 0u), key, camera_sample);
}

uint flags_of(Bsdf b) {
    uint flags = MET;
    if (HAS_MIRROR && b.type == BSDF_MIRROR) flags |= BY_MIRRORS;
    if (HAS_DIELECTRIC && b.type == BSDF_DIELECTRIC) flags |= GLASS;
    if (is_reconnectable(b)) flags |= RECONNECTABLE;
    return flags;
}

// Traces a ray, from mirror to mirror if these are to be followed, up to the hits of a path and to the light that one may meet after them.
FirstHit trace(Ray ray, inout uint loops) {
    FirstHit first;
    first.emitted = 0.0;
    first.flags = 0u;
    vec3 throughput = vec3(1.0);
    uint hits = 0u;
    bool reflected;
    do {
        Hit hit = intersect(ray, loops);
        Vertex v = vertex_at(hit, ray);
        bool met = hit.primitive >= 0;
        bool mirror = HAS_MIRROR && met && v.bsdf.type == BSDF_MIRROR;
        first.position = v.surface.position;
        first.t = hit.t;
        first.normal = v.up;
        first.shading = v.normal;
        first.albedo = bsdf_albedo(v.bsdf);
        first.primitive = hit.primitive;
        first.instance = hit.instance;
        first.material = material_index(primitive_shape(max(hit.primitive, 0)).w);
        if (HAS_EMITTER && met && shines_from(v.surface.material, v.front)) {
            first.emitted += brightness(throughput * v.surface.material.emission);
        }
        hits += 1u;
        loops += 1u;
        reflected = mirror && hits <= MAX_DEPTH && follows_mirrors != 0u;
        first.flags = (first.flags & BY_MIRRORS) | (met && hits <= MAX_DEPTH ? flags_of(v.bsdf) : 0u);
        if (HAS_MIRROR) {
            BsdfSample next = mirror_sample(v.bsdf, v.normal, -ray.direction, vec2(0.0));
            if (SMOOTH_NORMALS) next.direction = on_side(next.direction, v.up);
            throughput *= next.weight;
            ray = Ray(v.outside, next.direction, self_id_of(v.self_id, v.surface, v.front));
        }
    } while (HAS_MIRROR && reflected && throughput != vec3(0.0) && (LOOP_BUDGET == 0u || loops < LOOP_BUDGET));
    return first;
}

// A loop: less code to compile (layout.glsl).
void record(uint place, FirstHit first) {
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

void main() {
    load_intersection();
    load_constants();
    uint place = gl_GlobalInvocationID.x;
    uvec2 at;
    bool real = first_slot + place < end_slot && pixel_of_slot(first_slot + place, at);
    if (!real) return;
    CameraRay begin = first_ray(at);
    uint loops = 0u;
    record(place, trace(Ray(begin.origin, begin.direction, -1), loops));
    // A traversal that ran out of budget may have ended too early: then the pixel does not count.
    bool complete = LOOP_BUDGET == 0u || loops < LOOP_BUDGET;
    uint samples = complete ? 1u : 0u;
    add_counts(Counts(samples, 0u, 0u, 1u, 0u, 0u, 0u));
}
