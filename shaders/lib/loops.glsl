// Loop iterations that a subgroup spends where any of its lanes needs them, besides those that callers count.

#ifndef LOOPS_GLSL
#define LOOPS_GLSL

#include "layout.glsl"

uint doubtful_loops = 0u;

// For all lanes to call.
void count_doubtful(bool needed, uint iterations) {
    if (LOOP_BUDGET > 0u && subgroupAny(needed)) doubtful_loops += iterations;
}

#endif
