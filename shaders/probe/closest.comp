#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// Closest hits of rays, by the functions of the path tracer. Records: check/probe/rays.rs.

#include "io.glsl"
#include "../lib/path.glsl"
#include "../lib/trace.glsl"

void closest(uint i) {
    vec4 o = input_floats(2u * i);
    vec4 d = input_floats(2u * i + 1u);
    uint loops = 0u;
    float t;
    int id = closest_hit(o.xyz, d.xyz, floatBitsToInt(d.w), t, loops);
    vec4 position = vec4(0.0);
    if (id >= 0) {
        Surface s = surface_at(id, o.xyz, d.xyz, t);
        position = vec4(s.position, s.offset);
    }
    probe_out[2u * i] = uvec4(floatBitsToUint(t), uint(id), walked_steps, 0u);
    output_floats(2u * i + 1u, position);
}

void main() {
    load_scene();
    uint i = gl_GlobalInvocationID.x;
    if (i < end_slot) closest(i);
}
