// Ray queries (VK_KHR_ray_query): the device's own acceleration structure, over boxes around the leaves of the BVH, proposes leaves that a
// ray may meet; what they hold is tested as in a traversal. So hits have the same bits, whatever the device does in between, if it
// proposes each leaf whose box the ray meets. It may propose others, and a leaf twice. (query_triangles.glsl leaves triangles to the device.)
//
// Boxes are as wide as traversals make them for a ray that starts as far away as any (src/render/scene/query_geometry.rs).

#ifndef QUERY_GLSL
#define QUERY_GLSL

#include "bvh/traversal.glsl"

// By how much a committed distance is above that of the hit, so that what is as far away is proposed too: a lower id may win.
const float ABOVE = 1.0 + 1.0 / 1048576.0;
const float LEAST_ABOVE = 1e-30;

// All instances have this mask (src/gpu/acceleration_structure.rs).
const uint MASK = MUTATION == MUTATE_QUERY_MASK ? 2u : 1u;

// The handle of what the device calls by a number. They are numbered depth first, which suits builders that divide them in this order.
int query_handle(int number) {
    int first = 3 * int(record_count) + int((record_count + 1u) >> 1);
    uvec4 four = bvh_texel(first + (number >> 2));
    return BVH_ID + int(four[number & 3]);
}

int record_of(int handle) { return (handle - BVH_ID) >> 1; }

// A direction for boxes alone: no reciprocal of a component is infinite.
vec3 without_zeros(vec3 d) {
    const float tiny = 1e-30;
    return vec3(abs(d.x) < tiny ? tiny : d.x, abs(d.y) < tiny ? tiny : d.y, abs(d.z) < tiny ? tiny : d.z);
}

// What `traverse` finds (bvh/bvh.glsl), of a ray that is finite. A step is a leaf.
void query_leaves(Ray ray, float t_max, bool any_hit, uint loops, out float nearest, out int nearest_id, out uint steps) {
    BvhRay r = bvh_ray(ray.origin, ray.direction, any_hit);
    nearest = t_max;
    nearest_id = -1;
    steps = 0u;
    float committed = t_max;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, acceleration_structure, gl_RayFlagsNoneEXT, MASK, ray.origin, 0.0, without_zeros(ray.direction), t_max);
    while ((LOOP_BUDGET == 0u || loops + steps < LOOP_BUDGET) && rayQueryProceedEXT(query)) {
        steps += 1u;
        int record = record_of(query_handle(rayQueryGetIntersectionPrimitiveIndexEXT(query, false)));
        float t;
        int id;
        bool hit = leaf_test(r, record, bvh_record(record), ray.self_id, t, id);
        if (!hit || !(MUTATION == MUTATE_QUERY_TIES ? t < nearest : is_nearer(t, id, nearest, nearest_id))) continue;
        nearest = t;
        nearest_id = id;
        if (any_hit) break;
        float above = max(t * ABOVE, LEAST_ABOVE);
        if (above < committed) {
            committed = above;
            rayQueryGenerateIntersectionEXT(query, above);
        }
    }
    if (MUTATION == MUTATE_QUERY_DISTANCE && !any_hit && nearest_id >= 0) nearest = committed;
}

#endif
