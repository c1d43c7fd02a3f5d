#version 460
#extension GL_GOOGLE_include_directive : require
// A step of a sequence, in a dispatch of its own. The oracle is check/cases/timelines.rs.

#include "io.glsl"

layout(local_size_x_id = 1) in;

void main() {
    uint g = gl_GlobalInvocationID.x;
    // With a word of another invocation.
    uint from = (g + first) % (gl_NumWorkGroups.x * gl_WorkGroupSize.x);
    if (second == 0u) {
        found[g] = found[g] * 1664525u + given[from] + first;
    } else {
        found[g] = found[g] * 22695477u + first;
    }
}
