// The metallic-roughness model with what lies over it: sheen, and a clear coat over both.
//
// Layers take light both on its way in and on its way out. With t(μ) = 1 − E(μ) for what a layer of albedo E lets through, and B(μ) for
// what microfacets of the base let through to its diffuse part, the parts of the base become
//
//   specular   f · tc(μo) tc(μi) / (1 − F0 min(Ec(μo), Ec(μi))) · min(ts(μo), ts(μi))
//   sheen      f · min(tc(μo), tc(μi))
//   diffuse    base/π · t(μo) B(μo) t(μi) B(μi) / (mean of t B),  t = tc ts
//
// All are reciprocal. The first includes what the coat throws back onto a smooth metal; the last makes a white base below any layers
// return all that it gets. Together they never return more than what arrives, and all of it over a white diffuse base.

#ifndef LAYERED_GLSL
#define LAYERED_GLSL

#include "../math.glsl"
#include "albedo.glsl"
#include "clearcoat.glsl"
#include "closure.glsl"
#include "diffuse.glsl"
#include "ggx.glsl"
#include "metallic_roughness.glsl"
#include "parts.glsl"
#include "sheen.glsl"

// What the microfacets of the base let through of light under one cosine, and what layers and these do.
vec2 let_through(Bsdf b, float mu) {
    // Where these are anisotropic, between tangent and bitangent.
    float across = sqrt(fast_max(0.5 - 0.5 * mu * mu, 0.0));
    vec2 e = single_albedo(b.lobes, vec3(across, across, mu));
    vec2 t = vec2(1.0 - dot(b.lobes.specular, vec3(e, 1.0 - (e.x + e.y))));
    if (HAS_SHEEN) t.y *= 1.0 - sheen_albedo(b.sheen, mu);
    if (HAS_COAT) t.y *= 1.0 - coat_albedo(b.coat, mu);
    return t;
}

// Their means over the hemisphere, weighted with the cosine: Gauss's rule for the weight 4x³ with x = √μ.
vec2 mean_let_through(Bsdf b) {
    return 0.0022468434 * let_through(b, 0.023187115) + 0.028341262 * let_through(b, 0.10975999)
           + 0.12210476 * let_through(b, 0.28346207) + 0.27377311 * let_through(b, 0.52649938)
           + 0.35320395 * let_through(b, 0.77724796) + 0.22033007 * let_through(b, 0.95412914);
}

// Takes from the base what layers keep from it. To be called when these are set.
void cover(inout Bsdf b) {
    if (b.coat.strength == 0.0 && b.sheen.albedo == 0.0) return;
    float passes = (1.0 - b.sheen.albedo) * (1.0 - b.coat.albedo);
    vec2 mean = mean_let_through(b);
    b.lobes.diffuse *= passes * mean.x / fast_max(mean.y, 1e-7);
    // The estimates, with sheen sampled by the cosine.
    vec3 below = b.lobes.albedo * passes;
    if (HAS_SHEEN) {
        vec3 of_sheen = b.sheen.color * (b.sheen.albedo * (1.0 - b.coat.albedo) / fast_max(largest(b.sheen.color), 1e-7));
        float base = brightness(below);
        below += of_sheen;
        b.lobes.single_share = fast_max(b.lobes.single_share * base / fast_max(brightness(below), 1e-7), 0.05);
    }
    b.lobes.albedo = below + vec3(b.coat.albedo);
    if (HAS_COAT && b.coat.strength > 0.0) {
        b.coat.share = clamp(3.0 * b.coat.albedo / fast_max(brightness(b.lobes.albedo), 1e-7), 0.05, 0.95);
    }
}

// o and i are the directions about the normal of the base.
BsdfValue layered_eval(Bsdf b, vec3 wo, vec3 wi, vec3 o, vec3 i) {
    Cover over = NO_COVER;
    vec3 of_layers = vec3(0.0);
    float coat_density = 0.0;
    if (HAS_SHEEN && b.sheen.albedo > 0.0) {
        of_layers = sheen_eval(b.sheen, o, i);
        over.diffuse = MUTATION == MUTATE_SHEEN ? 1.0 : 1.0 - sheen_albedo(b.sheen, i.z);
        over.specular = vec3(fast_min(1.0 - b.sheen.albedo, over.diffuse));
    }
    if (HAS_COAT && b.coat.strength > 0.0) {
        float albedo = MUTATION == MUTATE_WAY_OUT ? 0.0 : coat_albedo(b.coat, dot(b.coat.normal, wi));
        float of_coat;
        coat_eval(b.coat, wo, wi, of_coat, coat_density);
        of_layers = of_layers * (1.0 - fast_max(albedo, b.coat.albedo)) + vec3(of_coat);
        over.diffuse *= 1.0 - albedo;
        over.specular *= vec3((1.0 - b.coat.albedo) * (1.0 - albedo)) / (1.0 - b.lobes.f0 * fast_min(albedo, b.coat.albedo));
    }
    BsdfValue v = lobes_eval(b.lobes, over, o, i);
    if (HAS_COVER) v.value += of_layers;
    if (HAS_COAT) v.pdf = mix(v.pdf, coat_density, b.coat.share);
    return v;
}

void frame_of(Bsdf b, vec3 n, out vec3 tangent, out vec3 bitangent) {
    basis(n, tangent, bitangent);
    if (HAS_ANISOTROPY && b.lobes.anisotropy > 0.0) frame_about(n, b.tangent, tangent, bitangent);
}

// About the normal n.
BsdfValue metallic_roughness_eval(Bsdf b, vec3 n, vec3 wo, vec3 wi) {
    vec3 tangent, bitangent;
    frame_of(b, n, tangent, bitangent);
    if (HAS_PARTS && b.part != PART_WHOLE) return part_eval(b, to_frame(wo, tangent, bitangent, n), to_frame(wi, tangent, bitangent, n));
    return layered_eval(b, wo, wi, to_frame(wo, tangent, bitangent, n), to_frame(wi, tangent, bitangent, n));
}

BsdfSample metallic_roughness_sample(Bsdf b, vec3 n, vec3 wo, vec2 u) {
    bool of_coat = HAS_COAT && takes_first(b.coat.share, u.x);
    vec3 tangent, bitangent;
    frame_of(b, n, tangent, bitangent);
    vec3 o = to_frame(wo, tangent, bitangent, n);
    bool single = takes_first(b.lobes.single_share, u.x);
    vec3 i = single ? ggx_sample(o, b.lobes.alpha, b.lobes.stretch, u) : cosine_sample(u);
    vec3 direction = normalize(tangent * i.x + bitangent * i.y + n * i.z);
    if (HAS_COAT && of_coat) {
        direction = coat_sample(b.coat, wo, u);
        i = to_frame(direction, tangent, bitangent, n);
    }
    BsdfValue v;
    if (HAS_PARTS && b.part != PART_WHOLE) v = part_eval(b, o, i);
    else v = layered_eval(b, wo, direction, o, i);
    return BsdfSample(direction, v.pdf > 0.0 ? v.value / v.pdf : vec3(0.0), v.pdf, false);
}

#endif
