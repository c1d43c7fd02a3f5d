// The metallic-roughness model in two parts, for paths that pixels share (reuse.glsl): its diffuse part, and its microfacets. A path goes on
// by one of them, chosen at random. The diffuse part is
//
//   f_d = d/π t(μo) t(μi),  t(μ) = 1 − Es(μ)
//
// so that light that leaves it in one direction is known in all others. For anisotropic microfacets t would depend on more than the cosine;
// what lies over a surface keeps more from it: such surfaces have no parts.

#ifndef PARTS_GLSL
#define PARTS_GLSL

#include "../math.glsl"
#include "closure.glsl"
#include "metallic_roughness.glsl"

// Surfaces whose diffuse part is a smaller share of what they reflect go on as a whole.
const float LEAST_DIFFUSE_SHARE = 0.1;

bool has_parts(Bsdf b) {
    bool plain = b.lobes.parts.x >= LEAST_DIFFUSE_SHARE;
    if (HAS_COVER) plain = plain && b.coat.strength == 0.0 && b.sheen.albedo == 0.0;
    if (HAS_ANISOTROPY) plain = plain && b.lobes.anisotropy == 0.0;
    return b.type == BSDF_METALLIC_ROUGHNESS && plain;
}

// What t takes.
vec4 fading_of(Bsdf b) { return b.type == BSDF_METALLIC_ROUGHNESS ? vec4(b.lobes.specular, b.lobes.row) : vec4(0.0); }

// t, of light under the cosine mu.
float fading(vec4 of, float mu) {
    if (of.xyz == vec3(0.0)) return 1.0;
    float roughness = mix(MIN_ROUGHNESS, 1.0, of.w);
    vec2 e = ggx_albedo(mu, ggx_alpha(roughness), of.w);
    return 1.0 - dot(of.xyz, vec3(e, 1.0 - (e.x + e.y)));
}

// Chooses a part by a number in [0, 1). `from_all_sides`: the diffuse part without t(μo).
void choose_part(inout Bsdf b, float number, bool from_all_sides) {
    float share = b.lobes.parts.x;
    bool diffuse = number < share;
    b.part = diffuse ? PART_DIFFUSE : PART_MICROFACETS;
    b.part_share = MUTATION == MUTATE_PARTS ? 1.0 : (diffuse ? share : 1.0 - share);
    b.lobes.single_share = diffuse ? 0.0 : b.lobes.parts.z;
    if (from_all_sides && diffuse) b.lobes.diffuse = b.reflectance * b.lobes.parts.y;
}

// The part by which the path goes on, over its probability; in the frame of the normal.
BsdfValue part_eval(Bsdf b, vec3 wo, vec3 wi) {
    LobeValues v = lobe_values(b.lobes, NO_COVER, wo, wi);
    bool diffuse = b.part == PART_DIFFUSE;
    vec3 value = diffuse ? v.diffuse * v.cosine : v.single + v.multiple * v.cosine;
    return BsdfValue(value / b.part_share, mix(v.cosine, v.single_pdf, b.lobes.single_share));
}

#endif
