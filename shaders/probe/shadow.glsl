// What becomes of a shadow ray, traced to its end at once.

#ifndef SHADOW_GLSL
#define SHADOW_GLSL

#include "../lib/trace.glsl"

bool arrives(ShadowRay ray, inout uint steps) {
    bool hidden;
    uint walked = 0u;
    if (shadow_needs_tree(ray, hidden)) hidden = hidden_by_tree(ray, steps, walked);
    steps += walked;
    return !hidden;
}

#endif
