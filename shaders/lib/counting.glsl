// What a dispatch counts, over all invocations.

#ifndef COUNTING_GLSL
#define COUNTING_GLSL

#include "layout.glsl"

// What an invocation has counted.
struct Counts {
    uint samples;       // committed by this dispatch
    uint reused;        // of these, made with paths that serve several pixels
    uint bad;           // NaN or infinite
    uint rays;
    uint shadow_rays;
    uint steps;
    uint truncated;     // 1 if something that nothing in the shader ended has ended
};

// Adds them to the dispatch's, once for a subgroup: atomics on one address wait for each other.
void add_counts(Counts c) {
    bool adds = subgroupElect();
    [[dont_unroll]] for (uint counter = 0u; counter < COUNTERS; ++counter) {
        uint count = c.samples;
        if (counter == COUNT_REUSED) count = c.reused;
        if (counter == COUNT_BAD) count = c.bad;
        if (counter == COUNT_RAYS) count = c.rays;
        if (counter == COUNT_SHADOW) count = c.shadow_rays;
        if (counter == COUNT_STEPS) count = c.steps;
        if (counter == COUNT_TRUNCATED) count = c.truncated;
        count = subgroupAdd(count);
        if (count > 0u && adds) atomicAdd(counters[counter], count);
    }
}

#endif
