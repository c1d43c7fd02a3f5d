// Boxes around a few large subtrees, held in constants: a ray that misses all of them never enters the tree.

#ifndef TREE_BOXES_GLSL
#define TREE_BOXES_GLSL

#include "slab.glsl"

layout(constant_id = 32) const float TREE_BOX_0_LX = 0.0; layout(constant_id = 33) const float TREE_BOX_0_LY = 0.0;
layout(constant_id = 34) const float TREE_BOX_0_LZ = 0.0; layout(constant_id = 35) const float TREE_BOX_0_HX = 0.0;
layout(constant_id = 36) const float TREE_BOX_0_HY = 0.0; layout(constant_id = 37) const float TREE_BOX_0_HZ = 0.0;
layout(constant_id = 38) const float TREE_BOX_1_LX = 0.0; layout(constant_id = 39) const float TREE_BOX_1_LY = 0.0;
layout(constant_id = 40) const float TREE_BOX_1_LZ = 0.0; layout(constant_id = 41) const float TREE_BOX_1_HX = 0.0;
layout(constant_id = 42) const float TREE_BOX_1_HY = 0.0; layout(constant_id = 43) const float TREE_BOX_1_HZ = 0.0;
layout(constant_id = 44) const float TREE_BOX_2_LX = 0.0; layout(constant_id = 45) const float TREE_BOX_2_LY = 0.0;
layout(constant_id = 46) const float TREE_BOX_2_LZ = 0.0; layout(constant_id = 47) const float TREE_BOX_2_HX = 0.0;
layout(constant_id = 48) const float TREE_BOX_2_HY = 0.0; layout(constant_id = 49) const float TREE_BOX_2_HZ = 0.0;
layout(constant_id = 50) const float TREE_BOX_3_LX = 0.0; layout(constant_id = 51) const float TREE_BOX_3_LY = 0.0;
layout(constant_id = 52) const float TREE_BOX_3_LZ = 0.0; layout(constant_id = 53) const float TREE_BOX_3_HX = 0.0;
layout(constant_id = 54) const float TREE_BOX_3_HY = 0.0; layout(constant_id = 55) const float TREE_BOX_3_HZ = 0.0;

#define TREE_BOX_LO(n) vec3(TREE_BOX_##n##_LX, TREE_BOX_##n##_LY, TREE_BOX_##n##_LZ)
#define TREE_BOX_HI(n) vec3(TREE_BOX_##n##_HX, TREE_BOX_##n##_HY, TREE_BOX_##n##_HZ)

// Whether the ray meets the boxes before t_max.
bool meets_boxes(vec3 o, vec3 d, float t_max) {
    if (TREE_BOX_COUNT == 0u) return true;
    vec3 inverse = safe_inverse(d);
    bool meets = meets_box(o, inverse, TREE_BOX_LO(0), TREE_BOX_HI(0), t_max);
    if (TREE_BOX_COUNT > 1u) meets = meets || meets_box(o, inverse, TREE_BOX_LO(1), TREE_BOX_HI(1), t_max);
    if (TREE_BOX_COUNT > 2u) meets = meets || meets_box(o, inverse, TREE_BOX_LO(2), TREE_BOX_HI(2), t_max);
    if (TREE_BOX_COUNT > 3u) meets = meets || meets_box(o, inverse, TREE_BOX_LO(3), TREE_BOX_HI(3), t_max);
    return meets;
}

#endif
