// Shares of the samples: a pixel may get half, twice or four times as many as are asked for, in the time of these. Which, the
// host decides for each tile of 64 slots (pixel_order.glsl) before a rendering, from a trial with other random numbers
// (src/render/shares.rs), which tells the noise and what samples cost: what the image is in the mean does not depend on it.
//
// A pixel has a share for the samples that it takes in groups as they are, and another for those in shifted groups, whose tiles
// are others. All pixels of a group have the same one, and so as many samples to take; but before the groups were shifted, some
// may have had more than others. Their random numbers are counted as if all had had the share that they have now, so that those
// of a group go together.

#ifndef SHARE_GLSL
#define SHARE_GLSL

#include "layout.glsl"

// Two bits each in the state of a film's slot, beside what glance.glsl has there: in groups as they are, and in shifted ones.
const uint PLAIN_SHARE = 12u;
const uint SHIFTED_SHARE = 14u;
const uint STATE_SHARES = 0xf000u;

// So many samples for a share: 0 all of them, 1 twice, 2 four times as many, 3 (-1) half.
uint share_of(uint share, uint samples) { return share == 3u ? (samples + 1u) >> 1 : samples << share; }

// What so many shadow rays and segments, and their steps through the tree, cost, in units of 3 ns of a thread on lavapipe 25.0.7
// (AMD EPYC, Zen 4). They stand for all rays, of which a program that can do more may trace some in vain. Whole numbers: the sum
// is the same in whatever order they are traced.
uint cost_of(uint shadow_rays, uint steps) { return 5u * shadow_rays + 9u * steps; }

// A pixel's share in groups as they are in this dispatch, and in the others.
uint share_now(uint state) { return state >> (in_mode(MODE_SHIFTED) ? SHIFTED_SHARE : PLAIN_SHARE) & 3u; }
uint share_else(uint state) { return state >> (in_mode(MODE_SHIFTED) ? PLAIN_SHARE : SHIFTED_SHARE) & 3u; }

// Samples that a pixel is to have in all.
uint target_of(uint state) {
    if (!REUSE) return target_samples;
    return share_of(share_now(state), target_samples - other_samples) + share_of(share_else(state), other_samples);
}

// So many samples, `most` at most, that a pixel still lacks of these.
uint samples_lacking(uint state, uint count, uint most) {
    uint target = target_of(state);
    return min(target - min(target, count), most);
}

// The index in the random numbers of a pixel's sample after `count` others.
uint index_after(uint state, uint count) {
    if (!REUSE) return count;
    return count - share_of(share_else(state), other_samples) + share_of(share_now(state), other_samples);
}

#endif
