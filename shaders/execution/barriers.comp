#version 460
#extension GL_GOOGLE_include_directive : require
// Memory that the invocations of a workgroup share, and atomics. The oracle is check/cases/barriers.rs.

#include "io.glsl"

layout(local_size_x_id = 1) in;
layout(constant_id = 3) const uint SIZE = 64u;    // of the workgroup

const uint PING_PONG = 0u;
const uint CLEARED = 1u;
const uint TICKETS = 2u;
const uint PREFIX = 3u;
const uint ROUNDS = 100u;

shared uint ping[SIZE];
shared uint pong[SIZE];
shared uint counter;

void main() {
    uint i = gl_LocalInvocationIndex;
    uint g = gl_GlobalInvocationID.x;
    uint x = given[g];
    if (FUNCTION == PING_PONG) {
        // Each takes what another has left, and leaves something for a third.
        ping[i] = x;
        barrier();
        for (uint round = 0u; round < ROUNDS; ++round) {
            pong[i] = ping[(i + 1u) % SIZE] * 1664525u + round;
            barrier();
            ping[i] = pong[(i + SIZE - 1u) % SIZE] ^ pong[(7u * i) % SIZE];
            barrier();
        }
        found[g] = ping[i];
    }
    if (FUNCTION == CLEARED) {
        // Cleared by one, counted up by all, read by all, again and again.
        uint sums = 0u;
        for (uint round = 0u; round < ROUNDS; ++round) {
            if (i == round % SIZE) counter = 0u;
            barrier();
            atomicAdd(counter, (x + round) & 0xffffu);
            barrier();
            sums = sums * 31u + counter;
            barrier();
        }
        found[g] = sums;
    }
    if (FUNCTION == TICKETS) {
        // The first word is a counter; each takes a number, and signs it.
        uint ticket = atomicAdd(found[0], 1u);
        atomicXor(found[1u + ticket], given[g]);
        atomicMax(found[1u + gl_NumWorkGroups.x * SIZE], x);
    }
    if (FUNCTION == PREFIX) {
        // Hillis and Steele's sums, in place.
        ping[i] = x;
        barrier();
        for (uint step = 1u; step < SIZE; step *= 2u) {
            uint before = i >= step ? ping[i - step] : 0u;
            barrier();
            ping[i] += before;
            barrier();
        }
        found[g] = ping[i];
    }
}
