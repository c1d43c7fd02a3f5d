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
    steps = walked_steps;
    vec4 position = vec4(0.0);
    if (id >= 0) {
        Surface s = surface_at(id, o.xyz, d.xyz, t);
        position = vec4(s.position, s.offset);
    }
    probe_out[2u * i] = uvec4(floatBitsToUint(t), uint(id), steps, 0u);
    output_floats(2u * i + 1u, position);
}

bool arrives(ShadowRay ray, inout uint steps) {
    bool hidden;
    uint walked = 0u;
    if (shadow_needs_tree(ray, hidden)) hidden = hidden_by_tree(ray, steps, walked);
    steps += walked;
    return !hidden;
}

void occlusion(uint i) {
    vec4 o = input_floats(2u * i);
    vec4 d = input_floats(2u * i + 1u);
    uint steps = 0u;
    bool clear = arrives(ShadowRay(o.xyz, d.xyz, o.w, floatBitsToInt(d.w), vec3(0.0), true), steps);
    probe_out[i] = uvec4(clear ? 0u : 1u, steps, 0u, 0u);
}

void scatter(uint i) {
    vec4 o = input_floats(5u * i);
    vec4 d = input_floats(5u * i + 1u);
    vec4 w = input_floats(5u * i + 2u);
    vec4 n = input_floats(5u * i + 3u);
    uvec4 sample_of = probe_in[5u * i + 4u];
    uint key = pixel_key(sample_of.x);
    Path path = Path(o.xyz, d.xyz, floatBitsToInt(d.w), w.xyz, floatBitsToUint(w.w), sample_of.y, n.xyz, n.w);
    uint steps = 0u;
    float t;
    int id = closest_hit(path.origin, path.direction, path.leaving, t, steps);
    vec3 radiance = vec3(0.0);
    Arrival arrival;
    ShadowRay shadow;
    bool alive = path_arrive(path, id, t, key, radiance, arrival, shadow);
    bool lit = false;
    if (HAS_DIFFUSE && LIGHT_COUNT + EMITTER_COUNT > 0u) {
        lit = shadow.wanted && arrives(shadow, steps);
        if (lit) radiance += shadow.radiance;
    }
    path_depart(path, arrival, alive, sample_of.x, key, path.index + (alive ? 0u : 1u));
    probe_out[6u * i] = uvec4(floatBitsToUint(t), uint(id), alive ? 1u : 0u, lit ? 1u : 0u);
    output_floats(6u * i + 1u, vec4(radiance, 0.0));
    probe_out[6u * i + 2u] = uvec4(floatBitsToUint(path.throughput), path.hits);
    output_floats(6u * i + 3u, vec4(path.origin, 0.0));
    probe_out[6u * i + 4u] = uvec4(floatBitsToUint(path.direction), uint(path.leaving));
    output_floats(6u * i + 5u, vec4(path.normal, path.pdf));
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= end_slot) return;
    if (PROBE == PROBE_CLOSEST) closest(i);
    if (PROBE == PROBE_OCCLUDED) occlusion(i);
    if (PROBE == PROBE_SCATTER) scatter(i);
}
