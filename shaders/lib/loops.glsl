// Loop iterations that a subgroup spends where any of its lanes needs them, besides those that callers count.

#ifndef LOOPS_GLSL
#define LOOPS_GLSL

#include "layout.glsl"

uint doubtful_loops = 0u;

// Those that this lane needs. For all lanes to call.
void count_doubtful(uint iterations) {
    if (LOOP_BUDGET > 0u) doubtful_loops += subgroupMax(iterations);
}

#endif
