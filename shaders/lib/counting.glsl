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

// Adds to one of the dispatch's counters: the first of its words has the lower bits. In a quarter of a second a fast GPU traces more
// rays than one word can count.
void count_up(uint counter, uint n) {
    uint before = atomicAdd(counters[2u * counter], n);
    if (before + n < n) atomicAdd(counters[2u * counter + 1u], 1u);
}

// Adds an invocation's counts, once for a subgroup: atomics on one address wait for each other.
void add_counts(Counts c) {
    // Once for all counters: lavapipe looks for the first lane through memory.
    bool elected = subgroupElect();
    [[dont_unroll]] for (uint counter = 0u; counter < COUNTERS; ++counter) {
        uint n = c.samples;
        if (counter == COUNT_REUSED) n = c.reused;
        if (counter == COUNT_BAD) n = c.bad;
        if (counter == COUNT_RAYS) n = c.rays;
        if (counter == COUNT_SHADOW) n = c.shadow_rays;
        if (counter == COUNT_STEPS) n = c.steps;
        if (counter == COUNT_TRUNCATED) n = c.truncated;
        n = subgroupAdd(n);
        if (elected && n > 0u) count_up(counter, n);
    }
}

#endif
