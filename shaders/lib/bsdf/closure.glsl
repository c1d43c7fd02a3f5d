// A BSDF with its parameters at a hit, and what sampling one gives.

#ifndef CLOSURE_GLSL
#define CLOSURE_GLSL

#include "../layout.glsl"

const uint BSDF_NONE = 0u;          // scatters nothing
const uint BSDF_DIFFUSE = 1u;
const uint BSDF_MIRROR = 2u;
const uint BSDF_DIELECTRIC = 3u;
const uint BSDF_METALLIC_ROUGHNESS = 4u;
const uint BSDF_GLASS = 5u;         // of the metallic-roughness model: the surface of a body that lets light through
const uint BSDF_WALL = 6u;          // likewise: a thin wall

// Of the metallic-roughness model: what does not depend on wi.
struct Lobes {
    vec3 f0;            // of single scattering; η of a conductor, or what it reflects
    float f90;
    vec4 k;             // of a conductor; 1, or −1 if it reflects the same at all angles; 0: none
    float alpha;        // of GGX
    float row;          // in the table of albedos
    vec2 stretch;       // of α, along the tangent and the bitangent
    float anisotropy;   // 0: none
    vec3 multiple;      // of (1 − E1(μi)) cos θi/π
    vec3 diffuse;       // of (1 − Es(μi)) cos θi/π
    vec3 specular;      // Es: factors of the albedo's two parts, and of 1 − E1
    vec3 albedo;        // an estimate
    float single_share; // of directions that are sampled by the microfacets
    vec3 parts;         // with HAS_PARTS, see parts.glsl: share of the diffuse part; its d over the base colour; single_share of the other
};

const Lobes NO_LOBES = Lobes(vec3(0.0), 0.0, vec4(0.0), 1.0, 0.0, vec2(1.0), 0.0, vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), 0.0, vec3(0.0));

// A clear coat: what does not depend on wi.
struct Coat {
    float strength;     // 0: none
    float alpha;        // of GGX
    float row;          // in the table of albedos
    vec3 normal;        // its own, on the side of wo
    float multiple;     // share that is reflected after more than one scattering, of what is lost after one
    float spread;       // of (1 − E1(μi)) cos θi/π
    float albedo;       // the part that it reflects of light from wo's direction
    float share;        // of directions that are sampled by its microfacets
};

const Coat NO_COAT = Coat(0.0, 1.0, 0.0, vec3(0.0), 0.0, 0.0, 0.0, 0.0);

// Sheen: what does not depend on wi.
struct Sheen {
    vec3 color;         // 0: none
    float alpha;
    float row;          // in the tables of albedos
    float lambda;       // Λ of wo
    float bound;        // by which it is divided for wo
    float albedo;       // the part that it keeps from what is below of light from wo's direction
};

const Sheen NO_SHEEN = Sheen(vec3(0.0), 1.0, 0.0, 0.0, 1.0, 0.0);

// What is left of light by what lies over a surface.
struct Cover {
    vec3 specular;      // of what its microfacets reflect
    float diffuse;      // of what reaches its diffuse part from wi
};

const Cover NO_COVER = Cover(vec3(1.0), 1.0);

// Of BSDF_GLASS and BSDF_WALL: what does not depend on wi.
struct Glass {
    vec3 f0;            // reflectance at normal incidence
    float f90;          // and at grazing
    float alpha;        // of GGX; 0: smooth
    float row;          // in the tables of albedos
    float slice;        // likewise, for light from wo's side
    vec2 multiple;      // of (1 − E(μi)) cos θi/π: on wo's side, and beyond
    float beyond_share; // of directions that are sampled by the cosine
    float single_share; // of directions that are sampled by the microfacets
    vec3 albedo;        // an estimate
};

const Glass NO_GLASS = Glass(vec3(0.0), 1.0, 0.0, 0.0, 0.0, vec2(0.0), 0.0, 1.0, vec3(0.0));

struct Bsdf {
    uint type;
    vec3 reflectance;   // 1 of a dielectric; of glass and walls, of what crosses
    float eta;          // index of refraction beyond the surface over that on the side of wo; of a wall, of its matter
    vec3 tangent;       // where it is anisotropic
    Lobes lobes;        // of BSDF_METALLIC_ROUGHNESS
    Sheen sheen;        // over these
    Coat coat;          // over both
    Glass glass;        // of BSDF_GLASS and BSDF_WALL
    uint part;          // with HAS_PARTS: by which the path goes on
    float part_share;   // the probability of that
};

const uint PART_WHOLE = 0u;         // the surface as it is
const uint PART_DIFFUSE = 1u;
const uint PART_MICROFACETS = 2u;

// One that has nothing more to it.
Bsdf plain_bsdf(uint type, vec3 reflectance, float eta) {
    return Bsdf(type, reflectance, eta, vec3(0.0), NO_LOBES, NO_SHEEN, NO_COAT, NO_GLASS, PART_WHOLE, 1.0);
}

Bsdf diffuse_bsdf(vec3 reflectance) { return plain_bsdf(BSDF_DIFFUSE, reflectance, 1.0); }

// Of scattering from wo to wi.
struct BsdfValue {
    vec3 value;         // f·|cos θi|
    float pdf;          // density of sampling wi, per solid angle
};

struct BsdfSample {
    vec3 direction;
    vec3 weight;        // f·|cos θ|/pdf
    float pdf;          // per solid angle; 0 of a single direction
    bool crosses;       // the direction leads to the other side of the surface
};

#endif
