// Lambert: f = reflectance/π on both sides, sampled proportionally to the cosine.

#ifndef DIFFUSE_GLSL
#define DIFFUSE_GLSL

#include "../math.glsl"
#include "closure.glsl"

// A direction around the z axis with density cosθ/π per solid angle.
vec3 cosine_sample(vec2 u) {
    vec2 disc = sqrt(u.y) * cos_sin_2pi(u.x);
    return vec3(disc, sqrt(1.0 - u.y));
}

// The same around the unit normal n.
vec3 cosine_sample(vec3 n, vec2 u) {
    vec3 tangent, bitangent;
    basis(n, tangent, bitangent);
    vec3 local = cosine_sample(u);
    return tangent * local.x + bitangent * local.y + n * local.z;
}

float cosine_pdf(float cos_theta) { return fast_max(cos_theta, 0.0) * (1.0 / PI); }

BsdfValue diffuse_eval(Bsdf b, vec3 n, vec3 wo, vec3 wi) {
    float cos_theta = dot(n, wi);
    float pdf = cosine_pdf(cos_theta);
    if (MUTATION == MUTATE_COSINE) cos_theta = cos_theta > 0.0 ? 1.0 : cos_theta;
    return BsdfValue(b.reflectance * cosine_pdf(cos_theta), pdf);
}

BsdfSample diffuse_sample(Bsdf b, vec3 n, vec3 wo, vec2 u) {
    vec3 wi = cosine_sample(n, u);
    return BsdfSample(wi, b.reflectance, cosine_pdf(dot(n, wi)), false);
}

#endif
