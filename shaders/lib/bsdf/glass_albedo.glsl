// Albedo of single scattering by a rough interface of glass, reflection and refraction together, from a table (assets/glass_albedo.bin):
// what is missing to 1 is what microfacets scatter more than once (glass.glsl).
//
// The table has it at equal steps of the mean of the cosine and its coordinate (albedo.glsl), of roughness, and of ±√|w|,
// w = (η − 1)/(η + 1), η the index of the far side over that of the near side: a slice for each of the last. A texel has four neighbouring values of a slice. Means over the
// hemisphere follow, at finer steps of roughness, with a texel for two such steps and two slices.

#ifndef GLASS_ALBEDO_GLSL
#define GLASS_ALBEDO_GLSL

#include "../layout.glsl"
#include "../math.glsl"
#include "albedo.glsl"

const uint GLASS_COSINES = 48u;
const uint GLASS_ROUGHNESSES = 32u;
const uint GLASS_SLICES = 65u;
const uint GLASS_MEANS = 94u;      // of a slice: three for each step of roughness

// Where an index is between the slices.
float glass_slice(float eta) {
    float w = (eta - 1.0) / (eta + 1.0);
    float root = sqrt(abs(w));
    return (w < 0.0 ? 0.5 - 0.5 * root : 0.5 + 0.5 * root) * float(GLASS_SLICES - 1u);
}

float glass_cell(int slice, float x, float y) {
    int i = floor_int(fast_min(x, float(GLASS_COSINES) - 1.5));
    int j = floor_int(fast_min(y, float(GLASS_ROUGHNESSES) - 1.5));
    int cell = (slice * int(GLASS_ROUGHNESSES) + j) * int(GLASS_COSINES) + i;
    vec4 four = uintBitsToFloat(texelFetch(texture_texels, int(glass_table.x) + cell));
    vec2 two = mix(four.xy, four.zw, y - float(j));
    return mix(two.x, two.y, x - float(i));
}

// What single scattering loses of light from a direction under the cosine mu, to an interface of that roughness and slice.
float glass_lost(float mu, float alpha, float row, float slice) {
    mu = clamp(mu, 0.0, 1.0);
    float x = (mu + sqrt(mu * (1.0 + 2.0 * alpha) / (mu + 2.0 * alpha))) * (0.5 * float(GLASS_COSINES - 1u));
    float y = row * float(GLASS_ROUGHNESSES - 1u);
    int k = floor_int(fast_min(slice, float(GLASS_SLICES) - 1.5));
    return 1.0 - mix(glass_cell(k, x, y), glass_cell(k + 1, x, y), slice - float(k));
}

// Its mean over the hemisphere, weighted with the cosine.
float glass_mean_lost(float row, float slice) {
    float y = row * float(GLASS_MEANS - 1u);
    int j = floor_int(fast_min(y, float(GLASS_MEANS) - 1.5));
    int k = floor_int(fast_min(slice, float(GLASS_SLICES) - 1.5));
    int texel = int(glass_table.x + GLASS_SLICES * GLASS_ROUGHNESSES * GLASS_COSINES) + k * int(GLASS_MEANS) + j;
    vec4 four = uintBitsToFloat(texelFetch(texture_texels, texel));
    vec2 two = mix(four.xy, four.zw, slice - float(k));
    return 1.0 - mix(two.x, two.y, y - float(j));
}

#endif
