// The film: per slot, 3 texels: sum.rgb and the sample count (as bits), then compensation.rgb and residue.rgb, each with
// a number of the pixel's pilot pass (gradient.glsl), and with its multipliers (sample_map.glsl).
//
// A sum is three floats that overlap by no more than a bit: 72 bits. Two would be 48, which is too few for samples that
// are alike: at a sum of 1e8 a sample of 0.1 is rounded at 3.5e-7, always to the same side, a drift of 1e-7 after 1e9
// samples.

#ifndef FILM_GLSL
#define FILM_GLSL

#include "layout.glsl"
#include "math.glsl"
#include "sample_map.glsl"

struct FilmPixel {
    vec3 sum;
    vec3 compensation;
    vec3 residue;
    uint count;
    float pilot;
    uint multipliers;
};

// The multipliers of a slot's pixel.
uint film_multipliers(uint slot) {
    return SAMPLE_MAP ? imageLoad(film_texels, int(FILM_ROWS * (slot - band_first)) + 2).w : 0u;
}

// Samples of a slot so far.
uint film_count(uint slot) {
    return imageLoad(film_texels, int(FILM_ROWS * (slot - band_first))).w;
}

// In the pilot pass the place of the sums has the cost of the samples instead (sample_map.glsl).
void film_store_cost(uint slot, uint cost) {
    film_words[4u * FILM_ROWS * (slot - band_first)] = cost;
}

FilmPixel film_empty() { return FilmPixel(vec3(0.0), vec3(0.0), vec3(0.0), 0u, 0.0, 0u); }

FilmPixel film_load(uint slot) {
    int row = int(FILM_ROWS * (slot - band_first));
    uvec4 a = imageLoad(film_texels, row);
    vec4 compensation = uintBitsToFloat(imageLoad(film_texels, row + 1));
    uvec4 c = imageLoad(film_texels, row + 2);
    vec4 residue = uintBitsToFloat(c);
    return FilmPixel(uintBitsToFloat(a.xyz), compensation.xyz, residue.xyz, a.w, compensation.w, c.w);
}

void film_store(uint slot, FilmPixel p) {
    uint row = FILM_ROWS * (slot - band_first);
    // A loop: less code to compile.
    [[dont_unroll]] for (uint i = 0u; i < FILM_ROWS; ++i) {
        uvec4 value = uvec4(floatBitsToUint(p.sum), p.count);
        if (i == 1u) value = floatBitsToUint(vec4(p.compensation, p.pilot));
        if (i == 2u) value = uvec4(floatBitsToUint(p.residue), p.multipliers);
        film_rows[row + i] = value;
    }
}

// a + b = sum + error exactly where |a| >= |b| (Dekker 1971).
void fast_two_sum(float a, float b, out float sum, out float error) {
    precise float s = a + b;
    precise float e = b - (s - a);
    sum = s;
    error = e;
}

void film_add_channel(inout float sum, inout float compensation, inout float residue, float x) {
    if (MUTATION == MUTATE_FILM) {
        sum += x;
        return;
    }
    float s, e, c, r;
    two_sum(sum, x, s, e);
    two_sum(compensation, e, c, r);
    precise float low = MUTATION == MUTATE_RESIDUE ? 0.0 : residue + r;
    // Renormalise, or the lower parts would in the end be plain sums themselves.
    float middle;
    fast_two_sum(s, c, sum, middle);
    fast_two_sum(middle, low, compensation, residue);
}

// Adds a sample. One that is not finite counts as black and is reported.
bool film_add(inout FilmPixel p, vec3 radiance) {
    bool good = MUTATION == MUTATE_FINITE || is_finite(brightness(radiance));
    vec3 x = good ? radiance : vec3(0.0);
    film_add_channel(p.sum.x, p.compensation.x, p.residue.x, x.x);
    film_add_channel(p.sum.y, p.compensation.y, p.residue.y, x.y);
    film_add_channel(p.sum.z, p.compensation.z, p.residue.z, x.z);
    p.count += 1u;
    return good;
}

#endif
