// glTF's metallic-roughness model, reciprocal and without loss of energy:
//
//   f = f_s + f_ms + f_d
//   f_s   GGX microfacets with Schlick's Fresnel term, F0 and F90 mixed by metalness
//   f_ms  what they scatter more than once, Fms (1 − E1(μo)) (1 − E1(μi)) / (π (1 − E1mean)), of metal and of the dielectric, mixed
//         (Kulla and Conty, "Revisiting Physically Based Shading at Imageworks", 2017)
//   f_d   base/π (1 − Es(μo)) (1 − Es(μi)) / (1 − Es mean), of the dielectric: what its f_s + f_ms, of albedo Es, let through
//
// E1 is the albedo of f_s where F = 1.

#ifndef METALLIC_ROUGHNESS_GLSL
#define METALLIC_ROUGHNESS_GLSL

#include "../math.glsl"
#include "albedo.glsl"
#include "anisotropic.glsl"
#include "closure.glsl"
#include "conductor.glsl"
#include "diffuse.glsl"
#include "ggx.glsl"

// Share of light that microfacets reflect after more than one scattering, of what is lost after one.
vec3 multiple_scattering(vec3 f0, float f90, float mean_albedo) {
    vec3 fresnel_mean = f0 + (vec3(f90) - f0) * (1.0 / 21.0);
    return fresnel_mean * fresnel_mean * mean_albedo / (1.0 - fresnel_mean * (1.0 - mean_albedo));
}

// (a, b) of single scattering by microfacets, of a direction in their frame.
vec2 single_albedo(Lobes l, vec3 w) {
    if (HAS_ANISOTROPY && l.anisotropy > 0.0) return anisotropic_albedo(w, l.row, l.anisotropy);
    return ggx_albedo(w.z, l.alpha, l.row);
}

vec2 mean_single_albedo(Lobes l) {
    if (HAS_ANISOTROPY && l.anisotropy > 0.0) return anisotropic_mean_albedo(l.row, l.anisotropy);
    return ggx_mean_albedo(l.row);
}

// Lobes::parts, by the brightness of the whole, of single and of multiple scattering.
vec3 parts_of(float whole, float single, float multiple, float diffuse) {
    float microfacets = single + multiple;
    float share = whole > 0.0 ? (whole - microfacets) / whole : 0.0;
    return vec3(microfacets > 0.0 ? share : 1.0, diffuse, microfacets > 0.0 ? single / microfacets : 0.5);
}

// Alphas of KHR_materials_anisotropy: that of the roughness across the tangent, and along it one that the strength brings up to 1.
void stretch_lobes(inout Lobes l, float strength) {
    float along = mix(l.alpha, 1.0, strength * strength);
    float root = sqrt(along / l.alpha);
    l.stretch = vec2(root, 1.0 / root);
    l.alpha *= root;
    l.anisotropy = strength;
}

// What does not depend on wi; wo in the frame of tangent, bitangent and normal. `dielectric_f0`, `dielectric_f90`: of the part that is no metal.
Lobes lobes_of(vec3 base, float metallic, float roughness, vec3 dielectric_f0, float dielectric_f90, float anisotropy, vec3 wo) {
    Lobes l;
    l.alpha = ggx_alpha(roughness);
    l.row = albedo_row(roughness);
    l.k = vec4(0.0);
    l.stretch = vec2(1.0);
    l.anisotropy = 0.0;
    if (HAS_ANISOTROPY && anisotropy > 0.0) stretch_lobes(l, anisotropy);
    vec2 e = single_albedo(l, wo);
    vec2 mean = mean_single_albedo(l);
    float lost = 1.0 - (e.x + e.y);
    float mean_lost = 1.0 - (mean.x + mean.y);
    l.f0 = mix(dielectric_f0, base, metallic);
    l.f90 = mix(dielectric_f90, 1.0, metallic);
    vec3 of_dielectric = multiple_scattering(dielectric_f0, dielectric_f90, mean.x + mean.y);
    l.multiple = mix(of_dielectric, multiple_scattering(base, 1.0, mean.x + mean.y), metallic) * (lost / fast_max(mean_lost, 1e-7));
    l.specular = vec3(largest(dielectric_f0), dielectric_f90, largest(of_dielectric));
    float let_through = 1.0 - dot(l.specular, vec3(e, lost));
    float let_through_mean = fast_max(1.0 - dot(l.specular, vec3(mean, mean_lost)), 1e-7);
    l.diffuse = base * ((1.0 - metallic) * let_through / let_through_mean);
    vec3 single = l.f0 * e.x + l.f90 * e.y;
    vec3 rest = l.multiple * mean_lost + (1.0 - metallic) * base * let_through;
    l.albedo = single + rest;
    float s = brightness(single);
    float all = s + brightness(rest);
    l.single_share = all > 0.0 ? clamp(s / all, 0.05, 0.95) : 0.5;
    l.parts = vec3(0.0);
    if (HAS_PARTS) l.parts = parts_of(all, s, brightness(l.multiple) * mean_lost, (1.0 - metallic) / let_through_mean);
    if (MUTATION == MUTATE_MULTIPLE) l.multiple = vec3(0.0);
    return l;
}

// The same of a conductor: `f0` and `k` as Lobes has them, and the mean of Fresnel's term, weighted with the cosine.
Lobes conductor_lobes(vec3 f0, vec4 k, vec3 mean_fresnel, float roughness, float mu) {
    Lobes l = NO_LOBES;
    l.f0 = f0;
    l.k = k;
    l.alpha = ggx_alpha(roughness);
    l.row = albedo_row(roughness);
    vec2 e = ggx_albedo(mu, l.alpha, l.row);
    vec2 mean = ggx_mean_albedo(l.row);
    float mean_lost = 1.0 - (mean.x + mean.y);
    vec3 again = mean_fresnel * mean_fresnel * (1.0 - mean_lost) / (1.0 - mean_fresnel * mean_lost);
    l.multiple = again * ((1.0 - (e.x + e.y)) / fast_max(mean_lost, 1e-7));
    l.albedo = mean_fresnel;
    l.single_share = clamp(e.x + e.y, 0.05, 0.95);
    if (MUTATION == MUTATE_MULTIPLE) l.multiple = vec3(0.0);
    return l;
}

// Of scattering from wo to wi.
struct LobeValues {
    vec3 single;        // f·cos
    vec3 multiple;      // likewise, over cosine
    vec3 diffuse;       // likewise
    float cosine;       // cos/π: density of sampling by the cosine
    float single_pdf;   // by the microfacets
};

// In the frame of the normal; what lies over it takes its part of the values.
LobeValues lobe_values(Lobes l, Cover over, vec3 wo, vec3 wi) {
    if (wo.z <= 0.0 || wi.z <= 0.0) return LobeValues(vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0);
    float angle;
    float single = ggx_eval(wo, wi, l.alpha, l.stretch, angle);
    float angle2 = angle * angle;
    vec3 fresnel = l.f0 + (vec3(l.f90) - l.f0) * (angle2 * angle2 * angle);
    if (HAS_CONDUCTOR && l.k.w != 0.0) fresnel = l.k.w > 0.0 ? conductor_fresnel(1.0 - angle, l.f0, l.k.xyz) : l.f0;
    vec2 e = single_albedo(l, wi);
    float lost = 1.0 - (e.x + e.y);
    float let_through = MUTATION == MUTATE_COUPLING ? 1.0 : 1.0 - dot(l.specular, vec3(e, lost));
    vec3 multiple = l.multiple;
    if (HAS_COVER) {
        fresnel *= over.specular;
        multiple *= over.specular;
        let_through *= over.diffuse;
    }
    float of_single = MUTATION == MUTATE_VISIBLE_NORMALS ? ggx_distribution(wo + wi, l.alpha, l.stretch) / (2.0 * (wo.z + ggx_root(wo, l.alpha, l.stretch)))
                                                         : ggx_pdf(wo, wi, l.alpha, l.stretch);
    return LobeValues(fresnel * single, multiple * lost, l.diffuse * let_through, cosine_pdf(wi.z), of_single);
}

BsdfValue lobes_eval(Lobes l, Cover over, vec3 wo, vec3 wi) {
    LobeValues v = lobe_values(l, over, wo, wi);
    return BsdfValue(v.single + (v.multiple + v.diffuse) * v.cosine, mix(v.cosine, v.single_pdf, l.single_share));
}

// Tangent and bitangent about the normal n, the first as close to `along` as can be.
void frame_about(vec3 n, vec3 along, out vec3 tangent, out vec3 bitangent) {
    basis(n, tangent, bitangent);
    along -= n * dot(n, along);
    tangent = dot(along, along) > 1e-8 ? normalize(along) : tangent;
    bitangent = cross(n, tangent);
}

vec3 to_frame(vec3 w, vec3 tangent, vec3 bitangent, vec3 n) { return vec3(dot(w, tangent), dot(w, bitangent), dot(w, n)); }

#endif
