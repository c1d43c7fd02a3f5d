// Smooth dielectric interface: Snell's law and the unpolarised Fresnel equations.

#ifndef DIELECTRIC_GLSL
#define DIELECTRIC_GLSL

#include "../math.glsl"
#include "closure.glsl"

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

// Follows the reflected or the refracted ray; the same Fresnel value is the probability and the weight, which therefore is 1. On which
// side the index is 1 the geometric normal says (b.eta): by the shading normal, rays that graze a smooth mesh would change sides.
BsdfSample dielectric_sample(Bsdf b, vec3 n, vec3 wo, vec2 u) {
    float signed_cos = dot(wo, n);
    float cos_i = fast_max(signed_cos, 0.0);
    float cos_t;
    float f = fresnel(cos_i, b.eta, cos_t);
    bool crosses = u.x >= f;
    vec3 refracted = n * (cos_i / b.eta - cos_t) - wo * (1.0 / b.eta);
    vec3 reflected = (2.0 * signed_cos) * n - wo;
    return BsdfSample(normalize(crosses ? refracted : reflected), vec3(1.0), 0.0, crosses);
}

#endif
