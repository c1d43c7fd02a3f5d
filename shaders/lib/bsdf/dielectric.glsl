// Smooth dielectric interface: Snell's law and the unpolarised Fresnel equations.

#ifndef DIELECTRIC_GLSL
#define DIELECTRIC_GLSL

#include "../math.glsl"
#include "mirror.glsl"

// Fraction of the power that is reflected. `cos_i` >= 0, `eta` = index of the far side over that of the near side.
// `cos_t` is the cosine of the refracted ray, 0 under total reflection.
float fresnel(float cos_i, float eta, out float cos_t) {
    // sin²θt = (1 − cos²θi)/η², arranged as cos²θt = (η² − 1 + cos²θi)/η²: no cancellation near grazing or at η = 1.
    // At the critical angle it does cancel, and its root would magnify the rounding of the squares: they are exact here.
    float eta2, eta2_low, cos2, cos2_low;
    two_product(eta, eta, eta2, eta2_low);
    two_product(cos_i, cos_i, cos2, cos2_low);
    float excess, excess_low, sum, sum_low;
    two_sum(eta2, -1.0, excess, excess_low);
    two_sum(excess, cos2, sum, sum_low);
    float k = sum + ((sum_low + excess_low) + (eta2_low + cos2_low));
    if (MUTATION == MUTATE_FRESNEL) k = (eta2 - 1.0) + cos2;
    float root = sqrt(k > 0.0 ? k : 0.0);
    cos_t = root / eta;
    float parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    float perpendicular = (cos_i - root) / (cos_i + root);
    float f = 0.5 * (parallel * parallel + perpendicular * perpendicular);
    if (MUTATION == MUTATE_FRESNEL) return f;
    // Grazing and total reflection exactly; equal indices are invisible at any angle.
    f = k > 0.0 && cos_i > 0.0 ? f : 1.0;
    return eta == 1.0 ? 0.0 : (f < 1.0 ? f : 1.0);
}

// Follows the reflected or the refracted ray; the same Fresnel value is the probability and the weight, which
// therefore is 1. n is the shading normal on the side that d comes from; whether that is the side of index 1 (`front`)
// is the geometric normal's to say, or rays that graze a smooth mesh would change sides. `crossed`: the ray goes on to
// the other side.
vec3 dielectric_sample(vec3 d, vec3 n, bool front, float ior, float u, out bool crossed) {
    float signed_cos = -dot(d, n);
    float cos_i = upper(signed_cos, 0.0);
    float eta = (front != (MUTATION == MUTATE_IOR)) ? ior : 1.0 / ior;
    float cos_t;
    float f = fresnel(cos_i, eta, cos_t);
    crossed = u >= f;
    vec3 refracted = d * (1.0 / eta) + n * (cos_i / eta - cos_t);
    vec3 reflected = d + (2.0 * signed_cos) * n;
    return normalize(crossed ? refracted : reflected);
}

#endif
