// Random numbers as a pure function of (pixel, sample, dimension, seed). Two dimensions make a pair:
// pair 0 is the position in the pixel, the last of the table that on the lens; a path's surface hit d (1, 2, …) uses the pairs below.
//
// Owen-scrambled Sobol (Burley, JCGT 2020), with the Laine–Karras hash as improved by Vegdahl (2021) for the
// scramble. The table holds Sobol points bit-reversed, as the hash wants them: row k of level l is the point of
// index k·2^(10l), 32 pairs in 16 columns; a point of any index is the XOR of one row of each level, because the
// sequence is linear over GF(2). Hits beyond SOBOL_HITS draw independent numbers.
//
// Pixels that share their paths (reuse.glsl) share a scramble too. Each of them then uses points of its own (but for lights at
// first hits, if gradients are made), and as those of one pixel are well spread, so are those of all together
// (src/render/kernel/sobol.rs). The three highest bits of a sample's index tell which of them it is.

#ifndef SAMPLER_GLSL
#define SAMPLER_GLSL

#include "layout.glsl"

const uint SOBOL_HITS = 10u;
const uint MEMBER_SHIFT = 29u;
const uint MEMBER_BITS = 32u - MEMBER_SHIFT;
const uint PAIR_PIXEL = 0u;
const uint PAIR_LENS = 31u;
uint pair_direction(uint hit) { return hit; }                      // also the choice between reflection and refraction
uint pair_light(uint hit) { return SOBOL_HITS - 1u + 2u * hit; }   // a point on an emitter
uint pair_choice(uint hit) { return SOBOL_HITS + 2u * hit; }       // which light

// Integer hash with low bias (Wellons' "lowbias32").
uint hash(uint x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

// The 24 high bits as a float in [0, 1): every value is exact, 1 is never reached.
float unit_float(uint x) { return float(x >> 8) * 5.9604645e-8; }

// Seed of all numbers of a pixel.
uint pixel_key(uint pixel) { return hash(pixel + hash(seed + 0x68bc21ebu)); }

// Owen scramble of a bit-reversed number.
uint owen_reversed(uint x, uint key) {
    x ^= x * 0x3d20adeau;
    x += key;
    x *= (key >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// Marks the index of a sample as one of a member of a group; that of member 0 stays as it is.
uint index_of_member(uint index, uint member) { return index | member << MEMBER_SHIFT; }

// The index of the sample alone, the same for all members.
uint index_of_sample(uint index) { return bitfieldExtract(index, 0, int(MEMBER_SHIFT)); }

const uint LEVEL_BITS = 10u;
const uint LEVEL_ROWS = 1u << LEVEL_BITS;
const uint COLUMN_GAP = 128u;     // see src/render/kernel/sobol.rs

// Rows of the lowest level: one for each member of a group.
uint lowest_rows() { return REUSE ? LEVEL_ROWS << MEMBER_BITS : LEVEL_ROWS; }

// The table: columns of texels, of two pairs each; in a column the lowest level, in which the rows of members follow each other, and
// then the higher ones. What a few samples want lies together, and stays in the cache, in which every other column lies elsewhere.
uvec2 sobol_reversed(uint index, uint pair) {
    uint column = (pair >> 1) * (lowest_rows() + (SOBOL_LEVELS - 1u) * LEVEL_ROWS + COLUMN_GAP);
    uint lowest = REUSE ? index << MEMBER_BITS | index >> MEMBER_SHIFT : index;
    uvec4 row = sobol_texel(int(column + (lowest & (lowest_rows() - 1u))));
    uint higher = column + lowest_rows();
    if (SOBOL_LEVELS > 1u) {
        row ^= sobol_texel(int(higher + ((index >> LEVEL_BITS) & (LEVEL_ROWS - 1u))));
    }
    if (SOBOL_LEVELS > 2u) {
        uint third = index_of_sample(index) >> 2u * LEVEL_BITS;
        row ^= sobol_texel(int(higher + LEVEL_ROWS + third));
    }
    return (pair & 1u) == 0u ? row.xy : row.zw;
}

// One step of PCG-RXS-M-XS 32: a linear congruential generator and its output permutation (O'Neill, "PCG", 2014).
uint pcg(uint state) {
    uint s = state * 747796405u + 2891336453u;
    uint word = ((s >> ((s >> 28) + 4u)) ^ s) * 277803737u;
    return (word >> 22) ^ word;
}

// Two numbers in [0, 1).
vec2 sample_pair(uint key, uint index, uint pair, uint hit) {
    uint h = hash(key + pair * 0x9e3779b9u);
    uint g = hash(h ^ 0x5bd1e995u);
    if (SAMPLER == 1u) return vec2(unit_float(hash(h + index * 0x85ebca6bu)), unit_float(hash(g + index * 0xc2b2ae35u)));
    if (SAMPLER == 2u) {
        // PCG (O'Neill 2014), a common generator, for comparison. A sequence for each pixel would have to be drawn in order; seeded
        // by its own output (Jarzynski and Olano, JCGT 2020), it is a pure function of the dimension too.
        uint x = pcg(pcg(key + index) + pair);
        return vec2(unit_float(x), unit_float(pcg(x)));
    }
    bool table = hit <= SOBOL_HITS;
    uvec2 p = sobol_reversed(index, table ? pair : 0u);
    if (MUTATION == MUTATE_SAMPLER) p &= uvec2(0x0000000fu);
    uvec2 u = uvec2(bitfieldReverse(owen_reversed(p.x, h)), bitfieldReverse(owen_reversed(p.y, g)));
    if (MAX_DEPTH > SOBOL_HITS) {
        u.x = table ? u.x : hash(h + index * 0x85ebca6bu);
        u.y = table ? u.y : hash(g + index * 0xc2b2ae35u);
    }
    return vec2(unit_float(u.x), unit_float(u.y));
}

// A number in [0, 1) beside the pairs: van der Corput's sequence in an order of its own (Burley 2020).
float sample_alone(uint key, uint index, uint hit) {
    uint h = hash(hash(key ^ 0x3c6ef372u) + hit * 0x63d83595u);
    if (SAMPLER != 0u) return unit_float(hash(h + index * 0x85ebca6bu));
    uint place = REUSE ? index << MEMBER_BITS | index >> MEMBER_SHIFT : index;
    place = bitfieldReverse(owen_reversed(bitfieldReverse(place), hash(h)));
    return unit_float(bitfieldReverse(owen_reversed(place, h)));
}

// An independent number in [0, 1), for decisions that gain nothing from stratification.
float sample_independent(uint key, uint index, uint hit) {
    return unit_float(hash(hash(key ^ 0xa511e9b3u) + index * 0x9e3779b9u + hit * 0x63d83595u));
}

#endif
