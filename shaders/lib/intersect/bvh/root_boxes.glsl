// Boxes around the children of the BVH's root. Which of them a ray meets is known before anything is fetched: a ray that misses all
// never enters the BVH, and another begins with these children.

#ifndef ROOT_BOXES_GLSL
#define ROOT_BOXES_GLSL

#include "slab.glsl"

vec3 root_boxes_lo[4];
vec3 root_boxes_hi[4];

// To be called when a kernel begins.
void load_root_boxes() {
#define LOAD_BOX(n)                                       \
    root_boxes_lo[n] = root_box_values[2 * n].xyz;        \
    root_boxes_hi[n] = root_box_values[2 * n + 1].xyz;
    if (ROOT_BOX_COUNT > 0u) { LOAD_BOX(0) }
    if (ROOT_BOX_COUNT > 1u) { LOAD_BOX(1) }
    if (ROOT_BOX_COUNT > 2u) { LOAD_BOX(2) }
    if (ROOT_BOX_COUNT > 3u) { LOAD_BOX(3) }
#undef LOAD_BOX
}

// A bit for each of the boxes that the ray meets before t_max.
uint boxes_hit(vec3 o, vec3 d, float t_max) {
    vec3 inverse = safe_inverse(d);
    float margin = box_margin(o);
    uint met = 0u;
#define MEETS(n) meets_box(o, inverse, root_boxes_lo[n], root_boxes_hi[n], margin, t_max) ? 1u << n : 0u
    if (ROOT_BOX_COUNT > 0u) met |= MEETS(0);
    if (ROOT_BOX_COUNT > 1u) met |= MEETS(1);
    if (ROOT_BOX_COUNT > 2u) met |= MEETS(2);
    if (ROOT_BOX_COUNT > 3u) met |= MEETS(3);
#undef MEETS
    return met;
}

#endif
