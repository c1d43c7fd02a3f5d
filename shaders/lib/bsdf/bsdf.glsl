// How a surface scatters light: one dispatch over the BSDFs, each of which is a file with the same functions.
//
//   eval    f(wo, wi)·|cos θi|, and the density per solid angle with which sample draws wi
//   sample  a direction wi, its weight f·|cos θi|/pdf, and its density per solid angle
//   flags   BSDF_… below
//
// wo points to where the path came from, n is the shading normal on that side. Directions and normals are unit vectors. Distributions
// of single directions (DELTA) have an eval of 0, and a sample of density 0.
//
// Conditions name a constant first, so that what a scene lacks is dropped before the driver sees it (src/gpu/prune.rs).
//
// To add a BSDF: its file, a line in each function below, its type and parameters in closure.glsl, and material.glsl where these are read.
// On the host: its record in src/render/scene/materials.rs, its type in src/render/kernel/layout.rs, its feature in
// src/render/settings/feature.rs.

#ifndef BSDF_GLSL
#define BSDF_GLSL

#include "closure.glsl"
#include "dielectric.glsl"
#include "diffuse.glsl"
#include "layered.glsl"
#include "glass.glsl"
#include "mirror.glsl"

// Scatters into single directions: light sampling cannot contribute, and paths keep their state.
const uint BSDF_DELTA = 1u;
// Lambertian, or the diffuse part of microfacets' surfaces: f for other directions follows, so that paths of several pixels can be connected
// here (reuse.glsl).
const uint BSDF_RECONNECTABLE = 2u;

uint bsdf_flags(Bsdf b) {
    if (HAS_DIFFUSE && b.type == BSDF_DIFFUSE) return BSDF_RECONNECTABLE;
    if (HAS_PARTS && b.part == PART_DIFFUSE) return BSDF_RECONNECTABLE;
    if (HAS_TRANSMISSION && is_glass(b.type)) return b.glass.alpha == 0.0 ? BSDF_DELTA : 0u;
    return (HAS_MIRROR && b.type == BSDF_MIRROR) || (HAS_DIELECTRIC && b.type == BSDF_DIELECTRIC) ? BSDF_DELTA : 0u;
}

bool is_delta(Bsdf b) { return (bsdf_flags(b) & BSDF_DELTA) != 0u; }
bool is_reconnectable(Bsdf b) { return (bsdf_flags(b) & BSDF_RECONNECTABLE) != 0u; }

// Light comes from both sides of the surface, and not in single directions.
bool scatters_through(Bsdf b) { return HAS_TRANSMISSION && is_glass(b.type) && b.glass.alpha > 0.0; }

// The part of light from wo's direction that is scattered, an estimate: what Russian roulette goes by.
vec3 bsdf_albedo(Bsdf b) {
    if (HAS_METALLIC_ROUGHNESS && b.type == BSDF_METALLIC_ROUGHNESS) return b.lobes.albedo;
    if (HAS_TRANSMISSION && is_glass(b.type)) return b.glass.albedo;
    return b.reflectance;
}

BsdfValue bsdf_eval(Bsdf b, vec3 n, vec3 wo, vec3 wi) {
    if ((HAS_DIFFUSE || HAS_PARTS) && b.type == BSDF_DIFFUSE) return diffuse_eval(b, n, wo, wi);
    if (HAS_METALLIC_ROUGHNESS && b.type == BSDF_METALLIC_ROUGHNESS) return metallic_roughness_eval(b, n, wo, wi);
    if (HAS_TRANSMISSION && is_glass(b.type)) return glass_eval(b, n, wo, wi);
    return BsdfValue(vec3(0.0), 0.0);
}

// The direction, or if it is not above the plane across `up` the one in the plane next to it, just above. For a mirror that is to bend the
// shading normal to halfway between that direction and wo (Keller et al., "The Iray light transport simulation and rendering system", 2017,
// A.3). Fresnel's equations keep the normal that is not bent: what enters glass by one and leaves it by the other would stay within.
vec3 on_side(vec3 direction, vec3 up) {
    const float above = 1e-4;
    float height = dot(direction, up);
    return height > 0.0 ? direction : normalize(direction + (above - height) * up);
}

// The normal, or if it shows a mirror's image of what lies below the surface the one that shows what lies just above, for any BSDF that
// is evaluated about it. (on_side bends directions in the same way.)
vec3 bent_normal(vec3 n, vec3 up, vec3 wo) {
    vec3 mirror = mirrored(wo, n);
    float height = dot(mirror, up);
    return height > 0.0 ? n : normalize(wo + normalize(mirror + (1e-6 - height) * up));
}

// A direction in which light is scattered. Without a BSDF (BSDF_NONE) the result means nothing.
BsdfSample bsdf_sample(Bsdf b, vec3 n, vec3 wo, vec2 u) {
    BsdfSample s = BsdfSample(n, vec3(0.0), 0.0, false);
    if (HAS_DIFFUSE) s = diffuse_sample(b, n, wo, u);
    if (HAS_MIRROR && b.type == BSDF_MIRROR) s = mirror_sample(b, n, wo, u);
    if (HAS_DIELECTRIC && b.type == BSDF_DIELECTRIC) s = dielectric_sample(b, n, wo, u);
    if (HAS_METALLIC_ROUGHNESS && b.type == BSDF_METALLIC_ROUGHNESS) s = metallic_roughness_sample(b, n, wo, u);
    if (HAS_TRANSMISSION && is_glass(b.type)) s = glass_sample(b, n, wo, u);
    return s;
}

#endif
