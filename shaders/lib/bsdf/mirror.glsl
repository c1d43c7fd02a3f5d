// Perfect mirror, on both sides.

#ifndef MIRROR_GLSL
#define MIRROR_GLSL

#include "closure.glsl"

// The mirror image of w about a unit normal on either side.
vec3 mirrored(vec3 w, vec3 n) { return 2.0 * dot(w, n) * n - w; }

BsdfSample mirror_sample(Bsdf b, vec3 n, vec3 wo, vec2 u) {
    return BsdfSample(mirrored(wo, n), b.reflectance, 0.0, false);
}

#endif
