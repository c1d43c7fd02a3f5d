// Glances: short paths from the camera that gather only the light of lamps seen directly or in mirrors.
//
// Where the edge of a lamp crosses a pixel, the light of a path is the lamp's or that of what is beside it, often a hundred
// times less. In a room with a lamp a thousandth of the pixels may hold half of the image's squared error. There a sample is
// a path that leaves out what glances gather, and the mean of GLANCES of those. Which pixels these are, the host finds from
// glances with other random numbers (src/render/renderer/glances.rs): what the image is in the mean does not depend on it.
//
// Light through glass is left to the paths: there every path chooses its way at random, and further ones cost more than they
// gain. So is that of the background, which is hardly ever much brighter than what is before it.
//
// The glances of a sample come first, then the path. With REUSE what they gather is kept apart: it stays with its pixel.
//
// Where the camera sees glass or a mirror first, and light of lamps may be met by way of it, pixels are many times as noisy as
// others. There a sample is the mean of several whole paths, if beams (light/beam.glsl) take the noise of caustics elsewhere.
// Which pixels these are, and how many paths, the host finds from rays with other random numbers too.
//
// The state of a path: how many glances, or paths, of its sample are still to come after it, whether the path follows on
// glances, and what it is itself. The film keeps that in which a pixel's samples begin, together with its shares (share.glsl).

#ifndef GLANCE_GLSL
#define GLANCE_GLSL

#include "aim.glsl"
#include "layout.glsl"
#include "sampler.glsl"

const uint GLANCING = 0x80000000u;      // a glance
const uint SCATTERED = 0x40000000u;     // it has left what no glance leaves: all light counts
const uint PATH_FOLLOWS = 0x20000000u;  // a glance of a sample that is not of glances only
const uint GLANCED = 0x10000000u;       // the path that follows on glances
const uint REPEATED = 0x08000000u;      // one of several paths of a sample,
const uint REPEATS_SHIFT = 16u;         // of so many
const uint REPEATS_MASK = 0xffu;
const uint GLANCES_LEFT = 0xfffu;
const uint AIM_FOLLOWS = 0x04000000u;   // an aimed path follows, see aim.glsl
const uint AIMED = 0x02000000u;         // an aimed path,
const uint AIMING = 0x01000000u;        // and its first ray
// Mirrors that a glance follows light through; lamps behind more of them are seen by the paths.
const uint GLANCE_MIRRORS = 4u;

bool is_glance(uint state) { return GLANCES > 0u && (state & GLANCING) != 0u; }
bool is_repeated(uint state) { return REPEATS && (state & REPEATED) != 0u; }
uint repeats(uint state) { return (state >> REPEATS_SHIFT) & REPEATS_MASK; }

// Whether a path that has ended is followed by another of the same sample.
bool sample_goes_on(uint state) { return MULTIPLE && (state & (GLANCES_LEFT | PATH_FOLLOWS | AIM_FOLLOWS)) != 0u; }

// What all light of a path counts.
float path_weight(uint state) {
    return is_repeated(state) && MUTATION != MUTATE_REPEATS ? 1.0 / float(repeats(state)) : 1.0;
}

// The state of that one.
uint next_state(uint state) {
    if (AIMS) return AIMED | AIMING;
    return (state & GLANCES_LEFT) != 0u ? state - 1u : GLANCED;
}

// Whether what comes next is kept apart from what has been gathered: the path from its glances, the aimed path from the path.
bool parts_light(uint state) { return AIMS || (GLANCES > 0u && next_state(state) == GLANCED); }

bool is_aimed(uint state) { return AIMS && (state & AIMED) != 0u; }
bool is_aiming(uint state) { return AIMS && (state & AIMING) != 0u; }

// What light of a lamp counts.
float glance_weight(uint state) {
    if (GLANCES == 0u || state == 0u || (state & (SCATTERED | REPEATED)) != 0u) return 1.0;
    return is_glance(state) ? 1.0 / float(GLANCES) : (MUTATION == MUTATE_GLANCES ? 1.0 : 0.0);
}

// Key and index of a path's random numbers: glances are a sequence of their own, and so are several paths of a sample. Its
// blocks of 1024 points are scrambled apart, which the lowest level of the sampler's table suffices for.
uvec2 glance_sequence(uint state, uint key, uint index) {
    if (is_aimed(state)) return uvec2(key ^ 0x3c6ef372u, index_of_sample(index));
    if (!is_glance(state) && !is_repeated(state)) return uvec2(key, index);
    uint of_sample = is_repeated(state) ? repeats(state) : max(GLANCES, 1u);
    uint samples = 1024u / of_sample;
    uint block_key = (key ^ 0x6a09e667u) + index / samples * 0x9e3779b1u;
    return uvec2(block_key, index % samples * of_sample + (state & GLANCES_LEFT));
}

#endif
