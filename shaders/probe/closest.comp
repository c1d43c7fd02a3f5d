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

const uint PROBE_CLOSEST = 0u;
const uint PROBE_EXACT_FACETS = 1u;

// The closest facet by the exact test alone.
int closest_facet_exactly(vec3 o, vec3 d, int leaving, out float t) {
    t = INFINITY;
    int id = -1;
    Across ray = across(o, d);
    for (int n = 0; n < int(FACET_COUNT); ++n) {
        float h;
        bool closer = meets_facet(facet_of_table(n), ray, d, h) && h < t && leaving != int(SPHERE_COUNT) + n;
        t = closer ? h : t;
        id = closer ? int(SPHERE_COUNT) + n : id;
    }
    return id;
}

void closest(uint i) {
    vec4 o = input_floats(2u * i);
    vec4 d = input_floats(2u * i + 1u);
    int leaving = floatBitsToInt(d.w);
    uint loops = 0u;
    float t;
    int id;
    if (PROBE == PROBE_EXACT_FACETS) id = closest_facet_exactly(o.xyz, d.xyz, leaving, t);
    else id = closest_hit(o.xyz, d.xyz, leaving, t, loops);
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
