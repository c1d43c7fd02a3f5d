// The film: per slot, 2 vec4: sum.rgb and the sample count (as bits), then compensation.rgb and 0.
// Each sample is added to a two-float sum, whose relative error stays below 1e-13 for any count.

#ifndef FILM_GLSL
#define FILM_GLSL

#include "layout.glsl"
#include "math.glsl"

struct FilmPixel {
    vec3 sum;
    vec3 compensation;
    uint count;
};

FilmPixel film_load(uint slot) {
    vec4 a = film[2u * (slot - band_first)];
    vec4 b = film[2u * (slot - band_first) + 1u];
    return FilmPixel(a.xyz, b.xyz, floatBitsToUint(a.w));
}

void film_store(uint slot, FilmPixel p) {
    film[2u * (slot - band_first)] = vec4(p.sum, uintBitsToFloat(p.count));
    film[2u * (slot - band_first) + 1u] = vec4(p.compensation, 0.0);
}

void film_add_channel(inout float sum, inout float compensation, float x) {
    if (MUTATION == MUTATE_FILM) {
        sum += x;
        return;
    }
    precise float s;
    precise float e;
    two_sum(sum, x, s, e);
    e += compensation;
    // Renormalise (|s| >= |e|), or the compensation would in the end be a plain sum itself.
    precise float r = s + e;
    precise float c = e - (r - s);
    sum = r;
    compensation = c;
}

// Adds a sample. One that is not finite counts as black and is reported.
bool film_add(inout FilmPixel p, vec3 radiance) {
    bool good = MUTATION == MUTATE_FINITE || is_finite(radiance.x + radiance.y + radiance.z);
    vec3 x = good ? radiance : vec3(0.0);
    film_add_channel(p.sum.x, p.compensation.x, x.x);
    film_add_channel(p.sum.y, p.compensation.y, x.y);
    film_add_channel(p.sum.z, p.compensation.z, x.z);
    p.count += 1u;
    return good;
}

#endif
