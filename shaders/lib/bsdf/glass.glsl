// The dielectric of the metallic-roughness model where it lets light through: the surface of a body (GLASS), or a thin wall (WALL).
//
//   f = f_s + f_ms
//   f_s   GGX microfacets that reflect the part R of light and let the part T through; of a body by Snell's law (Walter et al.,
//         "Microfacet Models for Refraction through Rough Surfaces", 2007), of a wall to the mirror image of the direction of reflection.
//         R is Fresnel's, with F0 and F90 of the material, and T = (1 − R)·tint; of a wall those of both its sides together, with all
//         reflections in between: R + (1 − R)² R tint²/(1 − R² tint²) and (1 − R)² tint/(1 − R² tint²)
//   f_ms  what they scatter more than once: (1 − E(μo)) (1 − E(μi)) nᵢ²/(π (nₒ² Mₒ + nₜ² Mₜ)), n the index on the side of wi, E the albedo
//         of f_s where tint = 1, and M the means of 1 − E on either side (Kulla and Conty 2017, for two sides: light that has lost its
//         direction leaves to both in proportion to what is lost from there)
//
// Radiance is not scaled by n² on refraction: f is that of radiance over n², and nₒ² f is the same with both directions exchanged.
// Where α is 0 the interface is smooth.

#ifndef GLASS_GLSL
#define GLASS_GLSL

#include "../math.glsl"
#include "../sampler.glsl"
#include "albedo.glsl"
#include "closure.glsl"
#include "dielectric.glsl"
#include "diffuse.glsl"
#include "ggx.glsl"
#include "glass_albedo.glsl"
#include "metallic_roughness.glsl"

// Closer to 1 an index bends light by less than what a microfacet's normal can be told from.
const float NEARLY_ONE = 1e-3;

bool is_glass(uint type) { return type == BSDF_GLASS || type == BSDF_WALL; }

// Parts of light that a microfacet reflects and lets through, under the cosine c between its normal and wo.
void glass_parts(Bsdf b, float c, out vec3 reflected, out vec3 passed, out float cos_t) {
    float f = fresnel(c, b.eta, cos_t);
    float root = (b.eta - 1.0) / (b.eta + 1.0);
    float f0 = root * root;
    vec3 strength = b.glass.f0 + (vec3(b.glass.f90) - b.glass.f0) * ((f - f0) / (1.0 - f0));
    reflected = cos_t > 0.0 ? clamp(strength, 0.0, 1.0) : vec3(1.0);
    passed = (1.0 - reflected) * b.reflectance;
    if (b.type == BSDF_WALL && MUTATION != MUTATE_WALL) {
        vec3 to_back = b.reflectance * reflected;
        vec3 within = passed * (1.0 - reflected) / max(1.0 - to_back * to_back, vec3(1e-7));
        reflected += within * to_back;
        passed = within;
    }
}

// What single scattering loses of light from wo's side, or from beyond.
float lost_by_glass(Bsdf b, float mu, bool beyond) {
    Glass g = b.glass;
    if (b.type == BSDF_WALL) {
        vec2 e = ggx_albedo(mu, g.alpha, g.row);
        return 1.0 - (e.x + e.y);
    }
    return glass_lost(mu, g.alpha, g.row, beyond ? float(GLASS_SLICES - 1u) - g.slice : g.slice);
}

// Sets what does not depend on wi. `eta` and the tint are known; `f0`, `f90`: reflectance at normal and at grazing incidence.
void set_glass(inout Bsdf b, vec3 f0, float f90, float roughness, float mu) {
    Glass g = NO_GLASS;
    g.f0 = f0;
    g.f90 = f90;
    b.glass = g;
    vec3 reflected, passed;
    float cos_t;
    glass_parts(b, fast_max(mu, 0.0), reflected, passed, cos_t);
    g.albedo = reflected + passed;
    if (roughness > MIN_ROUGHNESS && (b.type == BSDF_WALL || abs(b.eta - 1.0) > NEARLY_ONE)) {
        g.alpha = ggx_alpha(roughness);
        g.row = albedo_row(roughness);
        g.slice = glass_slice(b.eta);
        b.glass = g;
        float lost = lost_by_glass(b, mu, false);
        vec2 mean_lost;
        float eta2 = 1.0;
        if (b.type == BSDF_WALL) {
            vec2 mean = ggx_mean_albedo(g.row);
            mean_lost = vec2(1.0 - (mean.x + mean.y));
        } else {
            eta2 = b.eta * b.eta;
            mean_lost.x = glass_mean_lost(g.row, g.slice);
            mean_lost.y = glass_mean_lost(g.row, float(GLASS_SLICES - 1u) - g.slice);
        }
        float all = fast_max(mean_lost.x + eta2 * mean_lost.y, 1e-7);
        g.multiple = vec2(1.0, eta2) * (lost / all);
        g.beyond_share = clamp(eta2 * mean_lost.y / all, 0.05, 0.95);
        g.single_share = clamp(1.0 - lost, 0.05, 0.99);
        if (MUTATION == MUTATE_MULTIPLE) g.multiple = vec2(0.0);
    }
    b.glass = g;
}

// In the frame of the normal.
BsdfValue glass_value(Bsdf b, vec3 wo, vec3 wi) {
    BsdfValue v = BsdfValue(vec3(0.0), 0.0);
    Glass g = b.glass;
    if (wo.z <= 0.0 || wi.z == 0.0 || g.alpha == 0.0) return v;
    bool crosses = wi.z < 0.0;
    bool wall = b.type == BSDF_WALL;
    bool refracts = crosses && !wall;
    float depth = abs(wi.z);
    vec3 h = wo + (refracts ? b.eta * wi : vec3(wi.xy, depth));
    h = h.z < 0.0 ? -h : h;
    float length2 = dot(h, h);
    float inverse = length2 > 0.0 ? inversesqrt(length2) : 0.0;
    float oh = dot(wo, h) * inverse;
    float ih = dot(wi, h) * inverse;
    if (oh > 0.0 && (!refracts || ih < 0.0)) {
        float eta2 = b.eta * b.eta;
        float jacobian = refracts ? -oh * ih * eta2 * inverse * inverse : 0.25;
        float d = ggx_distribution(h, g.alpha, vec2(1.0)) * 2.0 * jacobian;
        float root = ggx_root(wo, g.alpha, vec2(1.0));
        vec3 reflected, passed;
        float cos_t;
        glass_parts(b, oh, reflected, passed, cos_t);
        vec3 part = crosses ? passed : reflected;
        v.value = part * (d * depth / (wo.z * ggx_root(wi, g.alpha, vec2(1.0)) + depth * root));
        if (MUTATION == MUTATE_REFRACTION && refracts) d /= eta2;
        float bound = wall ? ggx_bound(wo, g.alpha, vec2(1.0)) : 1.0;
        float all = brightness(reflected + passed);
        v.pdf = all > 0.0 ? g.single_share * brightness(part) / all * d / (bound * wo.z + root) : 0.0;
    }
    float even = cosine_pdf(depth);
    vec3 tint = crosses || wall ? b.reflectance : vec3(1.0);
    v.value += tint * ((crosses ? g.multiple.y : g.multiple.x) * lost_by_glass(b, depth, crosses) * even);
    v.pdf += (1.0 - g.single_share) * (crosses ? g.beyond_share : 1.0 - g.beyond_share) * even;
    return v;
}

// About the normal n.
BsdfValue glass_eval(Bsdf b, vec3 n, vec3 wo, vec3 wi) {
    vec3 tangent, bitangent;
    basis(n, tangent, bitangent);
    return glass_value(b, to_frame(wo, tangent, bitangent, n), to_frame(wi, tangent, bitangent, n));
}

// Where light goes on that a microfacet of normal h, under the cosine c, lets through.
vec3 beyond_glass(Bsdf b, vec3 wo, vec3 h, float c, float cos_t) {
    return h * (c / b.eta - cos_t) - wo * (1.0 / b.eta);
}

BsdfSample smooth_glass_sample(Bsdf b, vec3 n, vec3 wo, vec2 u) {
    float signed_cos = dot(wo, n);
    float c = fast_max(signed_cos, 0.0);
    vec3 reflected, passed;
    float cos_t;
    glass_parts(b, c, reflected, passed, cos_t);
    float all = brightness(reflected + passed);
    float share = all > 0.0 ? brightness(reflected) / all : 1.0;
    bool crosses = u.x >= share;
    vec3 through = b.type == BSDF_WALL ? -wo : beyond_glass(b, wo, n, c, cos_t);
    vec3 direction = normalize(crosses ? through : (2.0 * signed_cos) * n - wo);
    return BsdfSample(direction, crosses ? passed / (1.0 - share) : reflected / fast_max(share, 1e-7), 0.0, crosses);
}

BsdfSample glass_sample(Bsdf b, vec3 n, vec3 wo, vec2 u) {
    Glass g = b.glass;
    if (g.alpha == 0.0) return smooth_glass_sample(b, n, wo, u);
    // Which way light takes at a microfacet is one more random number than there are.
    float which = unit_float(hash(floatBitsToUint(u.x) ^ hash(floatBitsToUint(u.y))));
    vec3 tangent, bitangent;
    basis(n, tangent, bitangent);
    vec3 o = to_frame(wo, tangent, bitangent, n);
    bool wall = b.type == BSDF_WALL;
    vec3 i;
    if (takes_first(g.single_share, u.x)) {
        vec3 h = ggx_normal(o, g.alpha, vec2(1.0), wall ? ggx_bound(o, g.alpha, vec2(1.0)) : 1.0, u);
        float c = fast_max(dot(o, h), 0.0);
        vec3 reflected, passed;
        float cos_t;
        glass_parts(b, c, reflected, passed, cos_t);
        bool reflects = which * brightness(reflected + passed) < brightness(reflected);
        i = mirrored(o, h);
        if (wall) {
            i.z = reflects ? i.z : -i.z;
            // A direction that is lost.
            if ((i.z > 0.0) != reflects) i.z = 0.0;
        } else {
            i = reflects ? i : beyond_glass(b, o, h, c, cos_t);
            if ((i.z > 0.0) != reflects) i.z = 0.0;
        }
    } else {
        i = cosine_sample(u);
        i.z = which < g.beyond_share ? -i.z : i.z;
    }
    BsdfValue v = glass_value(b, o, i);
    vec3 direction = normalize(tangent * i.x + bitangent * i.y + n * i.z);
    return BsdfSample(direction, v.pdf > 0.0 ? v.value / v.pdf : vec3(0.0), v.pdf, i.z < 0.0);
}

#endif
