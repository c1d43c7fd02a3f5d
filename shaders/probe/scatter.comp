#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// One hit of a path with its direct light, and its next ray, by the functions of the path tracer.
// Records: check/probe/rays.rs.

#include "io.glsl"
#include "../lib/path.glsl"
#include "../lib/scene.glsl"

void scatter(uint i) {
    vec4 o = input_floats(5u * i);
    vec4 d = input_floats(5u * i + 1u);
    vec4 w = input_floats(5u * i + 2u);
    vec4 n = input_floats(5u * i + 3u);
    uvec4 sample_of = probe_in[5u * i + 4u];
    uint key = pixel_key(sample_of.x);
    Path path = Path(o.xyz, d.xyz, floatBitsToInt(d.w), w.xyz, floatBitsToUint(w.w), sample_of.y, n.xyz, n.w, 0.0, 0u, -1);
    uint steps = 0u;
    Hit hit = intersect(ray_of(path), steps);
    vec3 radiance = vec3(0.0);
    Vertex vertex;
    ShadowRay shadow;
    bool alive = path_arrive(path, hit, key, 1u, radiance, vertex, shadow);
    bool lit = false;
    if (SAMPLES_LIGHTS) {
        bool occluded = light_occluded(ray_of(shadow), shadow.distance, shadow.enabled, steps);
        lit = shadow.enabled && !occluded;
        if (lit) radiance += shadow.radiance;
    }
    uvec2 at = uvec2(sample_of.x % width, sample_of.x / width);
    path_depart(path, vertex, alive, frame_camera(), at, key, path.index + (alive ? 0u : 1u));
    probe_out[8u * i] = uvec4(floatBitsToUint(hit.t), uint(hit.primitive), alive ? 1u : 0u, lit ? 1u : 0u);
    output_floats(8u * i + 1u, vec4(radiance, 0.0));
    probe_out[8u * i + 2u] = uvec4(floatBitsToUint(path.throughput), path.hits);
    output_floats(8u * i + 3u, vec4(path.origin, 0.0));
    probe_out[8u * i + 4u] = uvec4(floatBitsToUint(path.direction), uint(path.self_id));
    output_floats(8u * i + 5u, vec4(path.normal, path.pdf));
    output_floats(8u * i + 6u, vec4(shadow.origin, shadow.enabled ? shadow.distance : 0.0));
    probe_out[8u * i + 7u] = uvec4(floatBitsToUint(shadow.direction), uint(shadow.self_id));
}

void main() {
    load_scene();
    uint i = gl_GlobalInvocationID.x;
    if (i < end_slot) scatter(i);
}
