// A BSDF with its parameters at a hit, and what sampling one gives.

#ifndef CLOSURE_GLSL
#define CLOSURE_GLSL

#include "../layout.glsl"

const uint BSDF_NONE = 0u;          // scatters nothing
const uint BSDF_DIFFUSE = 1u;
const uint BSDF_MIRROR = 2u;
const uint BSDF_DIELECTRIC = 3u;

struct Bsdf {
    uint type;
    vec3 reflectance;   // 1 of a dielectric
    float eta;          // of a dielectric: index of refraction beyond the surface over that on the side of wo
};

struct BsdfSample {
    vec3 direction;
    vec3 weight;        // f·|cos θ|/pdf
    float pdf;          // per solid angle; 0 of a single direction
    bool crosses;       // the direction leads to the other side of the surface
};

#endif
