// Sheen of cloth and dust (Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", 2017), as KHR_materials_sheen has it, in the
// frame of the normal. Where it would reflect more than what arrives it is divided by its albedo, of either direction: two tables have
// the albedo before and after that (src/sheen_albedo.rs).

#ifndef SHEEN_GLSL
#define SHEEN_GLSL

#include "../math.glsl"
#include "albedo.glsl"
#include "closure.glsl"

const float MIN_SHEEN_ROUGHNESS = 0.07;

// Albedos before and after the division.
vec2 sheen_albedos(Sheen s, float mu) {
    float last = float(ALBEDO_STEPS - 1u);
    vec2 at = vec2(sqrt(clamp(mu, 0.0, 1.0)), s.row) * last;
    return vec2(albedo_cell(SHEEN_ROW, at.x, at.y), albedo_cell(SHEEN_ROW + ALBEDO_STEPS * ALBEDO_STEPS, at.x, at.y));
}

// The part of light under the cosine mu that it keeps from what is below.
float sheen_albedo(Sheen s, float mu) { return largest(s.color) * sheen_albedos(s, mu).y; }

// Their curve for the logarithm of Λ.
float sheen_fit(float x, float t) {
    float power = exp_accurate(mix(0.19823, 0.16801, t) * log_accurate(fast_max(x, 1e-7)));
    return mix(21.5473, 25.3245, t) / (1.0 + mix(3.82987, 3.32435, t) * power) + mix(-1.97760, -1.27393, t) * x + mix(-4.32054, -4.85967, t);
}

float sheen_lambda(float mu, float alpha) {
    float t = (1.0 - alpha) * (1.0 - alpha);
    bool grazes = mu < 0.5;
    float fit = sheen_fit(grazes ? mu : 1.0 - mu, t);
    return exp_accurate(grazes ? fit : 2.0 * sheen_fit(0.5, t) - fit);
}

Sheen sheen_of(vec3 color, float roughness, float mu) {
    Sheen s = NO_SHEEN;
    s.color = color;
    roughness = clamp(roughness, MIN_SHEEN_ROUGHNESS, 1.0);
    s.alpha = roughness * roughness;
    s.row = (roughness - MIN_SHEEN_ROUGHNESS) * (1.0 / (1.0 - MIN_SHEEN_ROUGHNESS));
    s.lambda = sheen_lambda(clamp(mu, 0.0, 1.0), s.alpha);
    vec2 albedos = sheen_albedos(s, mu);
    s.bound = fast_max(albedos.x, 1.0);
    s.albedo = largest(color) * albedos.y;
    return s;
}

// f·cos θi.
vec3 sheen_eval(Sheen s, vec3 wo, vec3 wi) {
    if (wo.z <= 0.0 || wi.z <= 0.0) return vec3(0.0);
    vec3 h = wo + wi;
    float sine2 = fast_max((h.x * h.x + h.y * h.y) / dot(h, h), 1e-30);
    float inverse = 1.0 / s.alpha;
    float distribution = (2.0 + inverse) * (0.5 / PI) * exp_accurate(0.5 * inverse * log_accurate(sine2));
    float bound = s.bound * fast_max(sheen_albedos(s, wi.z).x, 1.0);
    return s.color * (distribution / ((1.0 + s.lambda + sheen_lambda(wi.z, s.alpha)) * 4.0 * wo.z * bound));
}

#endif
