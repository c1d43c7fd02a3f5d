#version 460
#extension GL_GOOGLE_include_directive : require
// Loops of all shapes. The oracle is check/cases/loops.rs.

#include "io.glsl"

layout(local_size_x_id = 1) in;

const uint NESTED = 0u;
const uint SHAPES = 1u;
const uint LONG = 2u;
const uint SEARCH = 3u;

uint next(uint x) { return x * 1664525u + 1013904223u; }

// Three loops in each other, left and gone on with from within.
uint nested(uint x) {
    uint count = 0u;
    for (uint a = 0u; a < (x & 3u); ++a) {
        for (uint b = 0u; b < (x >> 2 & 3u); ++b) {
            if (b == (x >> 8 & 3u)) continue;
            for (uint c = 0u; c < (x >> 4 & 3u); ++c) {
                if (c == (x >> 10 & 3u)) break;
                count = count * 3u + a * 7u + b * 5u + c;
            }
            count += 1u;
        }
    }
    return count;
}

// Up, down, with the test at the end, and without one.
uint shapes(uint x) {
    uint n = x & 31u;
    uint sum = 0u;
    for (uint i = 0u; i < n; ++i) sum = sum * 31u + i;
    for (uint i = n; i > 0u; --i) sum = sum * 31u + i;
    for (int i = int(n); i >= -3; i -= 2) sum = sum * 31u + uint(i);
    uint i = n;
    do {
        sum ^= i * 2654435761u;
        i /= 2u;
    } while (i != 0u);
    while (true) {
        i += 3u;
        if (i > n) break;
        if ((i & 4u) != 0u) continue;
        sum = sum * 31u + i;
    }
    return sum;
}

void main() {
    uint g = gl_GlobalInvocationID.x;
    uint x = given[g];
    if (FUNCTION == NESTED) found[g] = nested(x);
    if (FUNCTION == SHAPES) found[g] = shapes(x);
    if (FUNCTION == LONG) {
        // Iterations that really happen. Two loops: some drivers count those of all together.
        uint done = 0u;
        for (uint i = 0u; i < first; ++i) {
            x = next(x);
            done += x == 0x80000001u ? 0u : 1u;
        }
        for (uint i = 0u; i < second; ++i) {
            x = next(x);
            done += x == 0x80000001u ? 0u : 1u;
        }
        found[2u * g] = done;
        found[2u * g + 1u] = x;
    }
    if (FUNCTION == SEARCH) {
        // Lanes leave one after the other, each with what it has found.
        uint tries = 0u;
        uint y = x;
        while ((y & 63u) != 0u && tries < 1000u) {
            y = next(y);
            tries += 1u;
            if ((y >> 20 & 255u) == 7u) break;
        }
        found[g] = y ^ tries;
    }
}
