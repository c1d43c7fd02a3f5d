#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_maximal_reconvergence : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
// What the lanes of a subgroup do together, for a number of each. The oracle is check/cases/lanes.rs.

#include "io.glsl"

layout(local_size_x_id = 1) in;

const uint IDS = 0u;
const uint ARITHMETIC = 1u;
const uint DIVERGENT = 2u;
const uint BALLOT = 3u;
const uint BROADCAST = 4u;
const uint SHUFFLE = 5u;
const uint NONE = 0xffffffffu;

bool is_active(uint lane) { return subgroupBallotBitExtract(subgroupBallot(true), lane); }

void main() [[maximally_reconverges]] {
    uint x = given[gl_GlobalInvocationID.x];
    uint row = WORDS * gl_GlobalInvocationID.x;
    found[row] = gl_SubgroupID;
    found[row + 1u] = gl_SubgroupInvocationID;
    found[row + 2u] = gl_SubgroupSize;
    found[row + 3u] = gl_NumSubgroups;
    row += 4u;
    if (FUNCTION == ARITHMETIC) {
        found[row] = subgroupAdd(x);
        found[row + 1u] = subgroupMin(x);
        found[row + 2u] = subgroupMax(x);
        found[row + 3u] = subgroupAnd(x | 0xff0u);
        found[row + 4u] = subgroupOr(x & 0xff0u);
        found[row + 5u] = subgroupXor(x);
        found[row + 6u] = subgroupInclusiveAdd(x);
        found[row + 7u] = subgroupExclusiveAdd(x);
        found[row + 8u] = subgroupInclusiveMax(x);
        found[row + 9u] = subgroupExclusiveXor(x);
    }
    if (FUNCTION == DIVERGENT) {
        if ((x & 1u) != 0u) {
            found[row] = subgroupAdd(x);
        } else {
            found[row] = subgroupMax(x);
        }
        uint sums = 0u;
        for (uint i = 0u; i < (x >> 4 & 7u); ++i) sums = sums * 31u + subgroupAdd(x >> 8);
        found[row + 1u] = sums;
        // All that were there are there again.
        found[row + 2u] = subgroupAdd(1u);
        uint left = 0u;
        for (uint i = 0u; ; ++i) {
            if (i == (x >> 7 & 3u)) break;
            if ((x & 2u) != 0u) continue;
            left = left * 31u + subgroupXor(x);
        }
        found[row + 3u] = left;
        found[row + 4u] = subgroupAdd(1u);
    }
    if (FUNCTION == BALLOT) {
        bool odd = (x & 1u) != 0u;
        uvec4 ballot = subgroupBallot(odd);
        found[row] = ballot.x;
        found[row + 1u] = ballot.y;
        found[row + 2u] = ballot.z;
        found[row + 3u] = ballot.w;
        found[row + 4u] = subgroupBallotBitCount(ballot);
        found[row + 5u] = subgroupBallotInclusiveBitCount(ballot);
        found[row + 6u] = subgroupBallotExclusiveBitCount(ballot);
        bool any_odd = subgroupAny(odd);
        found[row + 7u] = any_odd ? subgroupBallotFindLSB(ballot) : NONE;
        found[row + 8u] = any_odd ? subgroupBallotFindMSB(ballot) : NONE;
        found[row + 9u] = uint(any_odd) | uint(subgroupAll(odd)) << 1 | uint(subgroupAllEqual(x >> 30)) << 2
            | uint(subgroupElect()) << 3 | uint(subgroupInverseBallot(ballot)) << 4;
        found[row + 10u] = uint(subgroupBallotBitExtract(ballot, gl_SubgroupInvocationID / 2u));
    }
    if (FUNCTION == BROADCAST) {
        uint all = 0u;
        for (uint lane = 0u; lane < gl_SubgroupSize; ++lane) {
            if (is_active(lane)) all = all * 31u + subgroupBroadcast(x, lane);
        }
        found[row] = all;
        found[row + 1u] = subgroupBroadcastFirst(x);
        found[row + 2u] = 0u;
        if ((x & 1u) != 0u) found[row + 2u] = subgroupBroadcastFirst(x);
    }
    if (FUNCTION == SHUFFLE) {
        uint lane = gl_SubgroupInvocationID;
        uint next = (lane + 1u) % gl_SubgroupSize;
        uint any = x % gl_SubgroupSize;
        uint value = subgroupShuffle(x, next);
        found[row] = is_active(next) ? value : NONE;
        value = subgroupShuffle(x, any);
        found[row + 1u] = is_active(any) ? value : NONE;
        for (uint bit = 0u; bit < 3u; ++bit) {
            uint other = lane ^ 1u << bit;
            value = subgroupShuffleXor(x, 1u << bit);
            found[row + 2u + bit] = other < gl_SubgroupSize && is_active(other) ? value : NONE;
        }
    }
}
