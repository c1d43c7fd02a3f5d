#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// Sampling of lights and its density, over arrays of arguments. Three words in, two words out; check/probe/lights.rs
// names them.

#include "io.glsl"
#include "../lib/light/choice.glsl"
#include "../lib/bsdf/diffuse.glsl"

const uint PROBE_LIGHT_SAMPLE = 0u;
const uint PROBE_LIGHT_PDF = 1u;
const uint PROBE_LIGHT_RESAMPLED = 2u;

// The end of the shadow ray, and what a white diffuse surface reflects.
void output_light(uint i, vec3 from, vec3 n, LightSample s, int light) {
    probe_out[2u * i] = uvec4(floatBitsToUint(from + s.distance * s.direction), uint(light));
    output_floats(2u * i + 1u, vec4(s.radiance * cosine_pdf(dot(n, s.direction)), s.pdf));
}

void main() {
    load_lights();
    uint i = gl_GlobalInvocationID.x;
    if (i >= end_slot) return;
    vec4 from = input_floats(3u * i);
    vec4 n = input_floats(3u * i + 1u);
    vec4 w = input_floats(3u * i + 2u);
    if (PROBE == PROBE_LIGHT_SAMPLE) {
        // from | u of the choice;  n | a number with its further digits, which also tells how to choose;  u of the point
        bool even = n.w < even_part();
        float probability, divisor;
        int cell = light_cell(from.xyz);
        float more = fract(4096.0 * n.w);
        int light = light_choose(cell, from.w, more, even, probability, divisor);
        output_light(i, from.xyz, n.xyz, light_candidate(cell, from.xyz, from.w, more, even, w.xy), light);
    }
    if (PROBE == PROBE_LIGHT_RESAMPLED) {
        // from | u of the choice;  n | u of the choice among candidates;  u of the point
        output_light(i, from.xyz, n.xyz, light_sample(from.xyz, n.xyz, vec2(from.w, n.w), w.xy), 0);
    }
    if (PROBE == PROBE_LIGHT_PDF) {
        // from | light;  distance, cosine at the light
        int light = floatBitsToInt(from.w);
        float pdf = light_pdf(from.xyz, light, n.x, n.y);
        int cell = light_cell(from.xyz);
        float share;
        float by_table = entry_of(cell, light, share);
        output_floats(2u * i, vec4(pdf, light_probability(cell, light), by_table * share, 0.0));
        output_floats(2u * i + 1u, vec4(0.0));
    }
}
