// How the work of a dispatch is handed out: in pieces, each to a workgroup, or to workgroups that draw one after another.

#ifndef WORK_GLSL
#define WORK_GLSL

#include "layout.glsl"

// Where in the film a piece is. Drivers on CPUs give each thread an equal share of consecutive workgroups; a stride that has no
// divisor in common with their number spreads each share over the whole image, so that none gets all of the costly pixels.
uint place_of_piece(uint piece) { return piece * piece_stride % pieces; }

// The next piece for a workgroup of one subgroup: its own, or where workgroups draw one that nobody has drawn, or one beyond the
// last.
//
// If each thread has its share, a dispatch takes as long as the last of them: its share costs more, or something else has its core. Where
// there are a few workgroups for each thread, which draw until nothing is left, all end together.
uint next_piece() {
    if (!DRAWS_WORK) return gl_WorkGroupID.x;
    uint piece = 0u;
    if (subgroupElect()) piece = atomicAdd(counters[COUNT_DRAWN], 1u);
    return subgroupBroadcastFirst(piece);
}

#endif
