// How the work of a dispatch is handed out: in pieces, each to a workgroup, or to workgroups that draw one after another, or in parts
// of pieces to subgroups that draw one each.

#ifndef WORK_GLSL
#define WORK_GLSL

#include "layout.glsl"

// Where in the film a piece is. Drivers on CPUs give each thread an equal share of consecutive workgroups; a stride that has no
// divisor in common with their number spreads each share over the whole image, so that none gets all of the costly pixels.
uint place_of_work_item(uint work_item) { return work_item * work_item_stride % work_items; }

// The number of what a subgroup is to do: its workgroup's, or where work is drawn, one that nobody has drawn, or one beyond the last.
//
// If each thread has its share, a dispatch takes as long as the last of them: its share costs more, or something else has its core. Where
// work is drawn, all end together.
uint next_number() {
    if (!PERSISTENT_THREADS) return gl_WorkGroupID.x;
    uint number = 0u;
    if (subgroupElect()) number = atomicAdd(counters[2u * COUNT_WORK_ITEMS], 1u);
    return subgroupBroadcastFirst(number);
}

// The invocation's number among those that a dispatch is for, each of which is at work once; false for those that are too many. Where
// work is drawn, each subgroup draws a part of a piece, as much as it has lanes, and there are more workgroups than pieces: a thread
// that is done sooner gets to more of them.
bool number_of_invocation(out uint number) {
    if (!PERSISTENT_THREADS) {
        number = place_of_work_item(gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_SubgroupID * SUBGROUP_LANES + gl_SubgroupInvocationID;
        return true;
    }
    uint parts = gl_WorkGroupSize.x / SUBGROUP_LANES;
    uint part = next_number();
    number = (place_of_work_item(part / parts) * parts + part % parts) * SUBGROUP_LANES + gl_SubgroupInvocationID;
    return part < work_items * parts;
}

#endif
