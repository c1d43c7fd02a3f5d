// What becomes of a shadow ray, traced to its end at once.

#ifndef SHADOW_GLSL
#define SHADOW_GLSL

#include "../lib/trace.glsl"

bool arrives(ShadowRay ray, inout uint steps) {
    bool hidden;
    uint walked = 0u;
    uint entry = shadow_entry(ray, hidden);
    if (entry != 0u) hidden = hidden_by_tree(ray, entry, steps, walked);
    steps += walked;
    return !hidden;
}

#endif
