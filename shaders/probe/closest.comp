#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// Closest hits of rays, by the functions of the path tracer. Records: check/probe/rays.rs.

#include "io.glsl"
#include "../lib/path.glsl"
#include "../lib/scene.glsl"

const uint PROBE_CLOSEST = 0u;
const uint PROBE_EXACT_POLYGONS = 1u;

// The closest polygon by the exact test alone.
Hit closest_polygon_exactly(Ray ray) {
    float t = INFINITY;
    int id = -1;
    Across across_ray = across(ray.origin, ray.direction);
    for (int n = 0; n < int(POLYGON_COUNT); ++n) {
        float h;
        bool closer = meets_polygon(polygon_of_table(n), across_ray, ray.direction, h) && h < t && ray.self_id != int(SPHERE_COUNT) + n;
        t = closer ? h : t;
        id = closer ? int(SPHERE_COUNT) + n : id;
    }
    return hit_of(id, t);
}

void closest(uint i) {
    vec4 o = input_floats(2u * i);
    vec4 d = input_floats(2u * i + 1u);
    uint loops = 0u;
    Ray ray = Ray(o.xyz, d.xyz, floatBitsToInt(d.w));
    Hit hit;
    if (PROBE == PROBE_EXACT_POLYGONS) hit = closest_polygon_exactly(ray);
    else hit = intersect(ray, loops);
    vec4 position = vec4(0.0);
    if (hit.primitive >= 0) {
        Surface s = surface_at(hit, ray);
        position = vec4(s.position, s.offset);
    }
    probe_out[2u * i] = uvec4(floatBitsToUint(hit.t), uint(hit.primitive), traversal_steps, uint(hit.self_id));
    output_floats(2u * i + 1u, position);
}

void main() {
    load_scene();
    uint i = gl_GlobalInvocationID.x;
    if (i < end_slot) closest(i);
}
