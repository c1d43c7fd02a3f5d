// Votes among the lanes of a subgroup. A CPU driver makes a loop over the lanes of a vote or a ballot, through memory, and straight
// code of a sum. Where lanes read each other's registers in one instruction, the sum is three of these and three additions.

#ifndef VOTES_GLSL
#define VOTES_GLSL

#include "layout.glsl"

// In how many lanes this holds, and whether in any. In lanes that have left a loop it must not hold (lane_table.glsl).
uint lanes(bool enabled) {
    if (THREADS) return subgroupBallotBitCount(subgroupBallot(enabled));
    uint count = enabled ? 1u : 0u;
    if (!SHUFFLES) return subgroupAdd(count);
    count += subgroupShuffleXor(count, 1u);
    count += subgroupShuffleXor(count, 2u);
    count += subgroupShuffleXor(count, 4u);
    return count;
}
bool any_lane(bool enabled) { return THREADS ? subgroupAny(enabled) : lanes(enabled) > 0u; }

#endif
