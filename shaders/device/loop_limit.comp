#version 460
// How many iterations of a loop a driver runs: some end loops silently.

layout(local_size_x = 64) in;
layout(push_constant) uniform Push { uint wanted; };
layout(std430, binding = 0) writeonly buffer Counted { uvec4 counted[]; };

void main() {
    uint done = 0u;
    uint x = wanted;
    // The sequence passes each value once in 2³²: the compiler does not know that, and counts.
    for (uint i = 0u; i < wanted; ++i) {
        x = x * 1664525u + 1013904223u;
        done += x == 0x80000001u ? 0u : 1u;
    }
    counted[gl_GlobalInvocationID.x] = uvec4(done, 0u, 0u, 0u);
}
