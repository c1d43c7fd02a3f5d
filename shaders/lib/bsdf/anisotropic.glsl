// Albedo of single scattering by anisotropic GGX microfacets, as in albedo.glsl: from a table by √μ, by the square of the cosine of the
// azimuth from the tangent, by roughness and by strength (src/anisotropic_albedo.rs). A texel has two neighbouring values of √μ.

#ifndef ANISOTROPIC_GLSL
#define ANISOTROPIC_GLSL

#include "albedo.glsl"

// The cell of a place from 0 to 1, and where in it.
uint cell_of(float x, uint steps, out float t) {
    float at = clamp(x, 0.0, 1.0) * float(steps - 1u);
    int i = floor_int(fast_min(at, float(steps) - 1.5));
    t = at - float(i);
    return uint(i);
}

vec2 anisotropic_cell(uint index, float t) {
    vec4 two = uintBitsToFloat(texture_texel(int(ANISOTROPIC_ROW + index)));
    return mix(two.xy, two.zw, t);
}

// (a, b) of a direction in the frame of tangent, bitangent and normal.
vec2 anisotropic_albedo(vec3 w, float row, float strength) {
    float across = w.x * w.x + w.y * w.y;
    float t0, t1, t2, t3;
    uint i0 = cell_of(sqrt(fast_max(w.z, 0.0)), ANISOTROPIC_STEPS.x, t0);
    uint i1 = cell_of(across > 0.0 ? w.x * w.x / across : 0.5, ANISOTROPIC_STEPS.y, t1);
    uint i2 = cell_of(row, ANISOTROPIC_STEPS.z, t2);
    uint i3 = cell_of(strength, ANISOTROPIC_STEPS.w, t3);
    uint next1 = ANISOTROPIC_STEPS.x;
    uint next2 = next1 * ANISOTROPIC_STEPS.y;
    uint next3 = next2 * ANISOTROPIC_STEPS.z;
    uint first = i0 + next1 * i1 + next2 * i2 + next3 * i3;
    vec2 low = mix(mix(anisotropic_cell(first, t0), anisotropic_cell(first + next1, t0), t1),
                   mix(anisotropic_cell(first + next2, t0), anisotropic_cell(first + next2 + next1, t0), t1), t2);
    first += next3;
    vec2 high = mix(mix(anisotropic_cell(first, t0), anisotropic_cell(first + next1, t0), t1),
                    mix(anisotropic_cell(first + next2, t0), anisotropic_cell(first + next2 + next1, t0), t1), t2);
    return mix(low, high, t3);
}

// Their means over the hemisphere, weighted with the cosine.
vec2 anisotropic_mean_albedo(float row, float strength) {
    float s, t;
    uint i = cell_of(row, ANISOTROPIC_STEPS.z, s);
    uint j = cell_of(strength, ANISOTROPIC_STEPS.w, t);
    uint first = ANISOTROPIC_CELLS + i + ANISOTROPIC_STEPS.z * j;
    return mix(anisotropic_cell(first, s), anisotropic_cell(first + ANISOTROPIC_STEPS.z, s), t);
}

#endif
