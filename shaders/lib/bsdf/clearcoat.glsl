// A clear coat of index 1.5 over a surface, with a normal of its own (KHR_materials_clearcoat): GGX microfacets with Schlick's Fresnel
// term, and what they scatter more than once, as in metallic_roughness.glsl.

#ifndef CLEARCOAT_GLSL
#define CLEARCOAT_GLSL

#include "../math.glsl"
#include "albedo.glsl"
#include "closure.glsl"
#include "diffuse.glsl"
#include "ggx.glsl"
#include "metallic_roughness.glsl"

const float COAT_F0 = 0.04;

// The part of light under the cosine mu that it reflects.
float coat_albedo(Coat c, float mu) {
    vec2 e = ggx_albedo(mu, c.alpha, c.row);
    return c.strength * (COAT_F0 * e.x + e.y + c.multiple * (1.0 - (e.x + e.y)));
}

// `normal` is on the side of wo.
Coat coat_of(float strength, float roughness, vec3 normal, vec3 wo) {
    Coat c = NO_COAT;
    c.strength = strength;
    c.alpha = ggx_alpha(roughness);
    c.row = albedo_row(roughness);
    c.normal = normal;
    vec2 mean = ggx_mean_albedo(c.row);
    c.multiple = multiple_scattering(vec3(COAT_F0), 1.0, mean.x + mean.y).x;
    float mu = dot(normal, wo);
    vec2 e = ggx_albedo(mu, c.alpha, c.row);
    c.spread = c.multiple * (1.0 - (e.x + e.y)) / fast_max(1.0 - (mean.x + mean.y), 1e-7);
    c.albedo = coat_albedo(c, mu);
    return c;
}

// f·cos θi of the coat alone, and the density of coat_sample, both about its normal.
void coat_eval(Coat c, vec3 wo, vec3 wi, out float value, out float pdf) {
    vec3 tangent, bitangent;
    basis(c.normal, tangent, bitangent);
    vec3 o = to_frame(wo, tangent, bitangent, c.normal);
    vec3 i = to_frame(wi, tangent, bitangent, c.normal);
    value = 0.0;
    pdf = 0.0;
    if (o.z <= 0.0 || i.z <= 0.0) return;
    float angle;
    float single = ggx_eval(o, i, c.alpha, vec2(1.0), angle);
    float angle2 = angle * angle;
    vec2 e = ggx_albedo(i.z, c.alpha, c.row);
    float fresnel = COAT_F0 + (1.0 - COAT_F0) * (angle2 * angle2 * angle);
    value = c.strength * (fresnel * single + c.spread * (1.0 - (e.x + e.y)) * cosine_pdf(i.z));
    pdf = ggx_pdf(o, i, c.alpha, vec2(1.0));
}

vec3 coat_sample(Coat c, vec3 wo, vec2 u) {
    vec3 tangent, bitangent;
    basis(c.normal, tangent, bitangent);
    vec3 i = ggx_sample(to_frame(wo, tangent, bitangent, c.normal), c.alpha, vec2(1.0), u);
    return normalize(tangent * i.x + bitangent * i.y + c.normal * i.z);
}

#endif
