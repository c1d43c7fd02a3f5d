#version 460
#extension GL_GOOGLE_include_directive : require
#ifdef RAY_QUERY
#extension GL_EXT_ray_query : require
#endif
// What a driver's arithmetic does where Vulkan leaves it free. Four words out for (x, y, z) in.

#include "io.glsl"

const uint PROBE_OPERATIONS = 0u;
const uint PROBE_LOOP = 1u;

// Iterations that really happen out of those asked for; the body keeps the compiler from knowing the answer.
uint count_iterations(uint enabled) {
    uint done = 0u;
    uint x = enabled;
    for (uint i = 0u; i < enabled; ++i) {
        x = x * 1664525u + 1013904223u;
        done += x == 0x80000001u ? 0u : 1u;
    }
    return done;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= end_slot) return;
    if (PROBE == PROBE_LOOP) {
        probe_out[i] = uvec4(count_iterations(probe_in[i].x), 0u, 0u, 0u);
        return;
    }
    vec4 v = input_floats(i);
    precise float kept = v.x * v.y + v.z;
    output_floats(4u * i, vec4(v.x / v.y, sqrt(v.x), inversesqrt(v.x), fma(v.x, v.y, v.z)));
    output_floats(4u * i + 1u, vec4(v.x * v.y + v.z, kept, sin(v.x), cos(v.x)));
    output_floats(4u * i + 2u, vec4(exp(v.x), log(v.x), min(v.x, v.y), max(v.x, v.y)));
    probe_out[4u * i + 3u] = uvec4(uint(v.x), floatBitsToUint(v.x * v.y), floatBitsToUint(normalize(v.xyz).xy));
}
