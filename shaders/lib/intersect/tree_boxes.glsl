// Boxes around a few large subtrees, held in constants: a ray that misses all of them never enters the tree.

#ifndef TREE_BOXES_GLSL
#define TREE_BOXES_GLSL

#include "slab.glsl"

#define TREE_BOX_CONSTANTS(n, base)                                      \
    layout(constant_id = base) const float TREE_BOX_##n##_LX = 0.0;      \
    layout(constant_id = base + 1) const float TREE_BOX_##n##_LY = 0.0;  \
    layout(constant_id = base + 2) const float TREE_BOX_##n##_LZ = 0.0;  \
    layout(constant_id = base + 3) const float TREE_BOX_##n##_HX = 0.0;  \
    layout(constant_id = base + 4) const float TREE_BOX_##n##_HY = 0.0;  \
    layout(constant_id = base + 5) const float TREE_BOX_##n##_HZ = 0.0;

TREE_BOX_CONSTANTS(0, 32)
TREE_BOX_CONSTANTS(1, 38)
TREE_BOX_CONSTANTS(2, 44)
TREE_BOX_CONSTANTS(3, 50)

#define TREE_BOX_LO(n) vec3(TREE_BOX_##n##_LX, TREE_BOX_##n##_LY, TREE_BOX_##n##_LZ)
#define TREE_BOX_HI(n) vec3(TREE_BOX_##n##_HX, TREE_BOX_##n##_HY, TREE_BOX_##n##_HZ)

// Whether the ray meets the boxes before t_max.
bool meets_boxes(vec3 o, vec3 d, float t_max) {
    if (TREE_BOX_COUNT == 0u) return true;
    vec3 inverse = safe_inverse(d);
    float margin = box_margin(o);
#define MEETS(n) meets_box(o, inverse, TREE_BOX_LO(n), TREE_BOX_HI(n), margin, t_max)
    bool meets = MEETS(0);
    if (TREE_BOX_COUNT > 1u) meets = meets || MEETS(1);
    if (TREE_BOX_COUNT > 2u) meets = meets || MEETS(2);
    if (TREE_BOX_COUNT > 3u) meets = meets || MEETS(3);
#undef MEETS
    return meets;
}

#endif
