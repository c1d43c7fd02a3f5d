#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
// Rays through the scene, by the functions of the path tracer: closest hit, occlusion, one scattering event.
// Records: check/probe/rays.rs.

#include "io.glsl"
#include "../lib/path.glsl"
#include "../lib/trace.glsl"

const uint PROBE_CLOSEST = 0u;
const uint PROBE_OCCLUDED = 1u;
const uint PROBE_SCATTER = 2u;

void closest(uint i) {
    vec4 o = input_floats(2u * i);
    vec4 d = input_floats(2u * i + 1u);
    uint steps = 0u;
    float t;
    int id = closest_hit(o.xyz, d.xyz, floatBitsToInt(d.w), t, steps);
    vec4 position = vec4(0.0);
    if (id >= 0) {
        Surface s = surface_at(id, o.xyz, d.xyz, t);
        position = vec4(s.position, s.offset);
    }
    probe_out[2u * i] = uvec4(floatBitsToUint(t), uint(id), steps, 0u);
    output_floats(2u * i + 1u, position);
}

void occlusion(uint i) {
    vec4 o = input_floats(2u * i);
    vec4 d = input_floats(2u * i + 1u);
    uint steps = 0u;
    bool hidden = occluded(ShadowRay(o.xyz, d.xyz, o.w, floatBitsToInt(d.w), vec3(0.0), true), steps);
    probe_out[i] = uvec4(hidden ? 1u : 0u, steps, 0u, 0u);
}

void scatter(uint i) {
    vec4 o = input_floats(4u * i);
    vec4 d = input_floats(4u * i + 1u);
    vec4 w = input_floats(4u * i + 2u);
    uvec4 sample_of = probe_in[4u * i + 3u];
    uint key = pixel_key(sample_of.x);
    Path path = Path(o.xyz, d.xyz, floatBitsToInt(d.w), w.xyz, floatBitsToUint(w.w), sample_of.y);
    uint steps = 0u;
    float t;
    int id = closest_hit(path.origin, path.direction, path.leaving, t, steps);
    vec3 radiance = vec3(0.0);
    ShadowRay shadow;
    bool alive = path_scatter(path, id, t, sample_of.x, key, radiance, shadow);
    bool lit = false;
    if (HAS_DIFFUSE && LIGHT_COUNT + EMITTER_COUNT > 0u) {
        lit = shadow.wanted && !occluded(shadow, steps);
        if (lit) radiance += shadow.radiance;
    }
    probe_out[5u * i] = uvec4(floatBitsToUint(t), uint(id), alive ? 1u : 0u, lit ? 1u : 0u);
    output_floats(5u * i + 1u, vec4(radiance, 0.0));
    probe_out[5u * i + 2u] = uvec4(floatBitsToUint(path.throughput), path.hits);
    output_floats(5u * i + 3u, vec4(path.origin, 0.0));
    probe_out[5u * i + 4u] = uvec4(floatBitsToUint(path.direction), uint(path.leaving));
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= end_slot) return;
    if (PROBE == PROBE_CLOSEST) closest(i);
    if (PROBE == PROBE_OCCLUDED) occlusion(i);
    if (PROBE == PROBE_SCATTER) scatter(i);
}
