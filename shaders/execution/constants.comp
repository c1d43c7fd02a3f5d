#version 460
#extension GL_GOOGLE_include_directive : require
// Specialization constants of all types, with the first id and one of the last, and what is derived of them. The oracle is
// check/cases/constants.rs.

#include "io.glsl"

layout(local_size_x_id = 11, local_size_y_id = 12, local_size_z_id = 13) in;
layout(constant_id = 0) const uint FIRST = 7u;
layout(constant_id = 2046) const uint LAST = 8u;
layout(constant_id = 20) const bool YES = false;
layout(constant_id = 21) const bool NO = true;
layout(constant_id = 22) const int NEGATIVE = 5;
layout(constant_id = 23) const float FRACTION = 2.0;
layout(constant_id = 24) const uint UNSET = 1234u;
layout(constant_id = 25) const uint LENGTH = 3u;

const uint TWICE = LENGTH * 2u + 1u;
const bool BOTH = YES && !NO;
const uint CHOSEN = BOTH ? TWICE : LENGTH;

shared uint sized[TWICE];

void main() {
    uint words = WORDS;
    uvec3 size = gl_WorkGroupSize;
    uint invocations = size.x * size.y * size.z;
    uint row = words * (gl_WorkGroupID.x * invocations + gl_LocalInvocationIndex);
    found[row] = FIRST;
    found[row + 1u] = LAST;
    found[row + 2u] = uint(YES) | uint(NO) << 1 | uint(BOTH) << 2;
    found[row + 3u] = uint(NEGATIVE);
    found[row + 4u] = floatBitsToUint(FRACTION);
    found[row + 5u] = UNSET;
    found[row + 6u] = CHOSEN;
    uint local[TWICE];
    for (uint i = 0u; i < TWICE; ++i) local[i] = i * given[0];
    if (gl_LocalInvocationIndex == 0u) {
        for (uint i = 0u; i < TWICE; ++i) sized[i] = local[TWICE - 1u - i];
    }
    barrier();
    uint sum = 0u;
    for (uint i = 0u; i < TWICE; ++i) sum = sum * 31u + sized[i];
    found[row + 7u] = sum;
    found[row + 8u] = size.x | size.y << 10 | size.z << 20;
    found[row + 9u] = gl_LocalInvocationID.x | gl_LocalInvocationID.y << 10 | gl_LocalInvocationID.z << 20;
}
