// The sample map: how many times as many samples as are asked for a pixel gets, a power of two from 1/2 to 32. The host makes it
// before a rendering, from samples with other random numbers (src/render/sampling/sample_map.rs): from their noise and cost (Neyman
// allocation), and from what the camera sees, edges of emitters and glass. So it does not depend on the image's random numbers, and
// the image is the same in the mean.
//
// A pixel has a multiplier for the samples that it takes in groups as they are, and another for those in shifted groups
// (pixel_order.glsl). All pixels of a group have the same one, and so as many samples to take; but before the groups were shifted, some
// may have had more than others. Their random numbers are counted as if all had had the multiplier that they have now, so that those
// of a group go together.

#ifndef SAMPLE_MAP_GLSL
#define SAMPLE_MAP_GLSL

#include "layout.glsl"

// The logarithms of a pixel's two multipliers to the base of 2, four bits each, in its slot of the film.
const int MULTIPLIER_BITS = 4;
const int PLAIN_MULTIPLIER = 0;
const int SHIFTED_MULTIPLIER = MULTIPLIER_BITS;

// So many samples times a multiplier.
uint times_multiplier(uint samples, int logarithm) { return logarithm < 0 ? (samples + 1u) >> 1 : samples << logarithm; }

// The logarithm of a pixel's multiplier in groups as they are in this dispatch, and in the others.
int multiplier_at(uint multipliers, bool shifted) {
    return bitfieldExtract(int(multipliers), shifted ? SHIFTED_MULTIPLIER : PLAIN_MULTIPLIER, MULTIPLIER_BITS);
}
int multiplier_now(uint multipliers) { return multiplier_at(multipliers, in_mode(MODE_SHIFTED)); }
int multiplier_else(uint multipliers) { return multiplier_at(multipliers, !in_mode(MODE_SHIFTED)); }

// Samples that a pixel is to have in all.
uint target_of(uint multipliers) {
    if (!SAMPLE_MAP) return target_samples;
    return times_multiplier(target_samples - other_samples, multiplier_now(multipliers)) +
           times_multiplier(other_samples, multiplier_else(multipliers));
}

// So many samples, `most` at most, that a pixel still lacks of these.
uint samples_lacking(uint multipliers, uint count, uint most) {
    uint target = target_of(multipliers);
    return min(target - min(target, count), most);
}

// The index in the random numbers of a pixel's sample after `count` others.
uint index_after(uint multipliers, uint count) {
    if (!SAMPLE_MAP) return count;
    return count - times_multiplier(other_samples, multiplier_else(multipliers)) +
           times_multiplier(other_samples, multiplier_now(multipliers));
}

// What so many shadow rays and segments, and their steps through the BVH, cost, in units of 3 ns of a thread on lavapipe 25.0.7
// (AMD EPYC, Zen 4). They stand for all rays, of which a program that can do more may trace some in vain. Whole numbers: the sum
// is the same in whatever order they are traced.
uint cost_of(uint shadow_rays, uint steps) { return 5u * shadow_rays + 9u * steps; }

#endif
