// Boxes around a few large subtrees: a ray that misses all of them never enters the tree.

#ifndef TREE_BOXES_GLSL
#define TREE_BOXES_GLSL

#include "slab.glsl"

vec3 tree_boxes_lo[4];
vec3 tree_boxes_hi[4];

// To be called when a kernel begins.
void load_tree_boxes() {
#define LOAD_BOX(n)                                       \
    tree_boxes_lo[n] = tree_box_values[2 * n].xyz;        \
    tree_boxes_hi[n] = tree_box_values[2 * n + 1].xyz;
    if (TREE_BOX_COUNT > 0u) { LOAD_BOX(0) }
    if (TREE_BOX_COUNT > 1u) { LOAD_BOX(1) }
    if (TREE_BOX_COUNT > 2u) { LOAD_BOX(2) }
    if (TREE_BOX_COUNT > 3u) { LOAD_BOX(3) }
#undef LOAD_BOX
}

// Whether the ray meets the boxes before t_max.
bool meets_boxes(vec3 o, vec3 d, float t_max) {
    if (TREE_BOX_COUNT == 0u) return true;
    vec3 inverse = safe_inverse(d);
    float margin = box_margin(o);
#define MEETS(n) meets_box(o, inverse, tree_boxes_lo[n], tree_boxes_hi[n], margin, t_max)
    bool meets = MEETS(0);
    if (TREE_BOX_COUNT > 1u) meets = meets || MEETS(1);
    if (TREE_BOX_COUNT > 2u) meets = meets || MEETS(2);
    if (TREE_BOX_COUNT > 3u) meets = meets || MEETS(3);
#undef MEETS
    return meets;
}

#endif
