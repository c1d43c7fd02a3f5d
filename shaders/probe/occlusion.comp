#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// Whether anything lies on rays, by the functions of the path tracer. Records: check/probe/rays.rs.

#include "io.glsl"
#include "../lib/path.glsl"
#include "../lib/scene.glsl"

void occlusion(uint i) {
    vec4 o = input_floats(2u * i);
    vec4 d = input_floats(2u * i + 1u);
    uint loops = 0u;
    bool occluded = light_occluded(Ray(o.xyz, d.xyz, floatBitsToInt(d.w)), o.w, true, loops);
    probe_out[i] = uvec4(occluded ? 1u : 0u, traversal_steps, 0u, 0u);
}

void main() {
    load_scene();
    uint i = gl_GlobalInvocationID.x;
    if (i < end_slot) occlusion(i);
}
