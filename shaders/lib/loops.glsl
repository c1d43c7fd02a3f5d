// Loop iterations that a subgroup spends where any of its lanes needs them, besides those that callers count.

#ifndef LOOPS_GLSL
#define LOOPS_GLSL

#include "layout.glsl"

uint fallback_loops = 0u;

// Those that this lane needs. For all lanes to call.
void count_fallback(uint iterations) {
    if (LOOP_BUDGET > 0u) fallback_loops += subgroupMax(iterations);
}

#endif
