// What rays meet: the interface of intersection. All but path_queue.comp and path_interleaved.comp, which deal out the steps of the traversal
// themselves, ask these functions alone.
//
// Constant spheres and polygons are tested first, one after the other; all else is in a bounding volume hierarchy (bvh/).

#ifndef INTERSECT_GLSL
#define INTERSECT_GLSL

#include "../layout.glsl"
#include "../ray.glsl"
#include "constants.glsl"
#include "shear.glsl"
#include "bvh/bvh.glsl"

// Fetches the numbers of what is not fetched as rays need it. To be called when a kernel begins.
void load_intersection() {
    load_spheres();
    load_polygons();
    load_root_boxes();
}

// The hit of the surface with such a handle at distance t; a miss if that is −1.
Hit hit_of(int self_id, float t) {
    Hit hit = Hit(t, self_id, 0, vec2(0.0), self_id);
    bool in_bvh = HAS_BVH && self_id >= BVH_ID;
    if (HAS_BVH && (CONSTANTS == 0u || in_bvh)) {
        int primitive = bvh_primitive(in_bvh ? self_id : BVH_ID);
        hit.primitive = in_bvh ? primitive : -1;
    }
    return hit;
}

// What a ray meets first. `loops` counts iterations against LOOP_BUDGET: if it has reached that, the hit may be wrong.
Hit intersect(Ray ray, inout uint loops) {
    float t = INFINITY;
    int self_id = -1;
    closest_constant(ray, t, self_id);
    if (HAS_BVH) closest_in_bvh(ray, t, self_id, loops);
    return hit_of(self_id, t);
}

// Whether anything lies between the start of a ray and the point at `distance`; of a ray that is not `enabled` it is not known. For all
// lanes to call: what the slowest of them takes counts for the subgroup.
bool occluded(Ray ray, float distance, bool enabled, inout uint loops) {
    bool occluded;
    uint entry = segment_root_mask(ray, distance, enabled, occluded);
    return occluded_in_scene(ray, distance, enabled ? entry : 0u, occluded, loops);
}

// The same for a ray to a light at that distance.
bool light_occluded(Ray ray, float distance, bool enabled, inout uint loops) {
    bool occluded = false;
    uint entry = 0u;
    if (enabled || LOOP_BUDGET > 0u) entry = shadow_root_mask(ray, distance, enabled, occluded);
    return occluded_in_scene(ray, distance, enabled ? entry : 0u, occluded, loops);
}

#endif
