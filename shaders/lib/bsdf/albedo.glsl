// Albedo of single scattering by GGX microfacets, from a table (assets/ggx_albedo.bin): with Schlick's Fresnel term it is F0·a + F90·b.
// The model is defined by the table: what single scattering loses by it, multiple scattering adds (metallic_roughness.glsl).
//
// The table has the sum a + b at equal steps of √(μ(1 + 2α)/(μ + 2α)), in which it is nearly linear however small α is, and the part
// b/(a + b) at equal steps of √μ; both at equal steps of roughness √α. A texel of each has four neighbouring values. Means over the
// hemisphere follow, at finer steps of roughness.

#ifndef ALBEDO_GLSL
#define ALBEDO_GLSL

#include "../layout.glsl"
#include "../math.glsl"

const uint ALBEDO_STEPS = 64u;          // along either axis
const uint ALBEDO_MEANS = 256u;
const uint ALBEDO_MEAN_ROW = 2u * ALBEDO_STEPS * ALBEDO_STEPS;
const uint SHEEN_ROW = ALBEDO_MEAN_ROW + ALBEDO_MEANS;      // two tables more, see sheen.glsl
const uint ANISOTROPIC_ROW = SHEEN_ROW + 2u * ALBEDO_STEPS * ALBEDO_STEPS; // see anisotropic.glsl
const uvec4 ANISOTROPIC_STEPS = uvec4(12u, 6u, 16u, 12u);
const uint ANISOTROPIC_CELLS = 12u * 6u * 16u * 12u;
const uint TEXTURE_ROWS = ANISOTROPIC_ROW + ANISOTROPIC_CELLS + 16u * 12u;   // texels before those of textures

// Smaller values are raised: the image of a mirror differs by less than 0.06 degrees.
const float MIN_ALPHA = 1e-3;
const float MIN_ROUGHNESS = 0.031622777;

float ggx_alpha(float roughness) { return fast_max(roughness * roughness, MIN_ALPHA); }

// Where a roughness is between the lowest and 1.
float albedo_row(float roughness) {
    return (clamp(roughness, MIN_ROUGHNESS, 1.0) - MIN_ROUGHNESS) * (1.0 / (1.0 - MIN_ROUGHNESS));
}

float albedo_cell(uint table, float x, float y) {
    int i = floor_int(fast_min(x, float(ALBEDO_STEPS) - 1.5));
    int j = floor_int(fast_min(y, float(ALBEDO_STEPS) - 1.5));
    vec4 four = uintBitsToFloat(texture_texel(int(table + uint(j) * ALBEDO_STEPS + uint(i))));
    vec2 two = mix(four.xy, four.zw, y - float(j));
    return mix(two.x, two.y, x - float(i));
}

// (a, b) of a direction under the cosine mu.
vec2 ggx_albedo(float mu, float alpha, float row) {
    mu = clamp(mu, 0.0, 1.0);
    float steps = float(ALBEDO_STEPS - 1u);
    float y = row * steps;
    float all = albedo_cell(0u, sqrt(mu * (1.0 + 2.0 * alpha) / (mu + 2.0 * alpha)) * steps, y);
    float part = albedo_cell(ALBEDO_STEPS * ALBEDO_STEPS, sqrt(mu) * steps, y);
    return vec2(all - all * part, all * part);
}

// Their means over the hemisphere, weighted with the cosine.
vec2 ggx_mean_albedo(float row) {
    float y = row * float(ALBEDO_MEANS - 1u);
    int j = floor_int(fast_min(y, float(ALBEDO_MEANS) - 1.5));
    vec4 two = uintBitsToFloat(texture_texel(int(ALBEDO_MEAN_ROW) + j));
    return mix(two.xy, two.zw, y - float(j));
}

#endif
