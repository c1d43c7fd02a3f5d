// The bounding volume hierarchy as a whole: rays are traced to their end at once, or, by path_queue.comp and path_interleaved.comp, step by
// step (traversal.glsl).

#ifndef BVH_GLSL
#define BVH_GLSL

#include "../../ray.glsl"
#include "../constants.glsl"
#include "traversal.glsl"
#ifdef RAY_QUERY
#include "../query_triangles.glsl"
#endif

// With PATH_STATS: records visited by this lane; and with REUSE, those of them by rays that only ask for any hit.
uint traversal_steps = 0u;
uint occlusion_steps = 0u;

// What a ray meets first.
struct Nearest {
    float t;
    int id;     // -1: nothing before the far end
};

// Traverses the BVH to the end, or as far as the budget goes; then `loops` has reached LOOP_BUDGET.
Nearest traverse_bvh(Ray ray, float t_max, uint entry, bool any_hit, uint loops, out uint steps) {
    BvhRay r = bvh_ray(ray.origin, ray.direction, any_hit);
    Traversal traversal = traversal_begin(r, t_max, entry);
    steps = 0u;
    while (traversal.running && (LOOP_BUDGET == 0u || loops + steps < LOOP_BUDGET)) {
        traversal_step(traversal, r, ray.self_id, any_hit, any_hit);
        steps += 1u;
    }
    return Nearest(traversal.t, traversal.id);
}

// Traces a ray that is finite and meets a box of the root: by a ray query, if there are any. But steps that the pilot pass takes for
// shadow rays decide how many samples pixels get: these are those of the BVH, whatever traces the image.
Nearest traverse(Ray ray, float t_max, uint entry, bool any_hit, uint loops, out uint steps) {
    Nearest nearest;
#ifdef RAY_QUERY
    if (USES_RAY_QUERY && !(REUSE && any_hit && in_mode(MODE_SCATTERED))) {
        if (QUERIES_TRIANGLES) query_triangles(ray, t_max, any_hit, loops, nearest.t, nearest.id, steps);
        else query_leaves(ray, t_max, any_hit, loops, nearest.t, nearest.id, steps);
    } else
#endif
    nearest = traverse_bvh(ray, t_max, entry, any_hit, loops, steps);
    if (PATH_STATS) traversal_steps += steps;
    if (REUSE && any_hit) occlusion_steps += steps;
    return nearest;
}

// Adds the iterations that the subgroup spent, and the one in which the loop ends: drivers bound those of the slowest
// lane, and a lane that did not enter the loop waited as long.
void count_loops(uint steps, inout uint loops) {
    if (LOOP_BUDGET > 0u) loops += subgroupMax(steps) + 1u;
}

// Nearest surface of the BVH before t, if there is one.
void closest_in_bvh(Ray ray, inout float t, inout int self_id, inout uint loops) {
    uint steps = 0u;
    uint entry = root_hit_mask(ray.origin, ray.direction, t);
    if (entry != 0u) {
        Nearest nearest = traverse(ray, t, entry, false, loops, steps);
        t = nearest.t;
        self_id = nearest.id >= 0 ? nearest.id : self_id;
    }
    count_loops(steps, loops);
}

// Where a ray that a constant sphere hides or not enters the BVH (root_hit_mask); if it does not, `occluded` is known.
uint root_mask_unless_occluded(Ray ray, float distance, bool enabled, inout bool occluded) {
    // In all lanes: it counts for the subgroup.
    bool behind_polygon = any_constant_polygon(ray, distance, enabled);
    occluded = occluded || behind_polygon;
    return HAS_BVH && !occluded ? root_hit_mask(ray.origin, ray.direction, distance) : 0u;
}

// Where a ray to a light enters the BVH; if it does not, `occluded` is known.
uint shadow_root_mask(Ray ray, float distance, bool enabled, out bool occluded) {
    occluded = any_constant_sphere_before_light(ray, distance);
    return root_mask_unless_occluded(ray, distance, enabled, occluded);
}

// The same for the segment between two surfaces.
uint segment_root_mask(Ray ray, float distance, bool enabled, out bool occluded) {
    occluded = any_constant_sphere(ray, distance);
    return root_mask_unless_occluded(ray, distance, enabled, occluded);
}

// Whether the point at `distance` is hidden: what is known, or, if the ray enters the BVH, what that says. For all lanes to
// call, since what the slowest traverses counts for the subgroup.
bool occluded_in_scene(Ray ray, float distance, uint entry, bool known, inout uint loops) {
    bool occluded = known;
    if (HAS_BVH) {
        uint steps = 0u;
        if (entry != 0u) occluded = traverse(ray, distance, entry, true, loops, steps).id >= 0;
        count_loops(steps, loops);
    }
    return occluded;
}

#endif
