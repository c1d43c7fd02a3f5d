// The bounding volume hierarchy as a whole: rays are traced to their end at once, or, by path_queue.comp and path_turns.comp, step by
// step (traversal.glsl).

#ifndef BVH_GLSL
#define BVH_GLSL

#include "../../ray.glsl"
#include "../constants.glsl"
#include "traversal.glsl"

// With PATH_STATS: records visited by this lane; and with REUSE, those of them by rays that only ask for any hit.
uint walked_steps = 0u;
uint occlusion_steps = 0u;

// The primitive with such a handle, or -1.
int bvh_primitive(int self_id) {
    int slot = self_id - TREE_ID;
    uvec4 four = texelFetch(tree_texels, 3 * int(record_count) + (slot >> 2));
    uvec2 two = (slot & 2) != 0 ? four.zw : four.xy;
    return int((slot & 1) != 0 ? two.y : two.x);
}

// Walks the tree to the end, or as far as the budget goes; then `loops` has reached LOOP_BUDGET.
Walk walk_tree(Ray ray, float t_max, uint entry, bool any_hit, uint loops, out uint steps) {
    TreeRay r = tree_ray(ray.origin, ray.direction, any_hit);
    Walk walk = walk_begin(r, t_max, entry);
    steps = 0u;
    while (walk.walks && (LOOP_BUDGET == 0u || loops + steps < LOOP_BUDGET)) {
        walk_step(walk, r, ray.self_id, any_hit, any_hit);
        steps += 1u;
    }
    if (PATH_STATS) walked_steps += steps;
    if (REUSE && any_hit) occlusion_steps += steps;
    return walk;
}

// Adds the iterations that the subgroup spent, and the one in which the loop ends: drivers bound those of the slowest
// lane, and a lane that did not enter the loop waited as long.
void count_loops(uint steps, inout uint loops) {
    if (LOOP_BUDGET > 0u) loops += subgroupMax(steps) + 1u;
}

// Nearest surface of the tree before t, if there is one.
void closest_in_bvh(Ray ray, inout float t, inout int self_id, inout uint loops) {
    uint steps = 0u;
    uint entry = tree_entry(ray.origin, ray.direction, t);
    if (entry != 0u) {
        Walk walk = walk_tree(ray, t, entry, false, loops, steps);
        t = walk.t;
        self_id = walk.id >= 0 ? walk.id : self_id;
    }
    count_loops(steps, loops);
}

// Where a ray that a constant sphere hides or not enters the tree (tree_entry); if it does not, `hidden` is known.
uint entry_unless_hidden(Ray ray, float distance, bool wanted, inout bool hidden) {
    // In all lanes: it counts for the subgroup.
    bool behind_facet = any_constant_facet(ray, distance, wanted);
    hidden = hidden || behind_facet;
    return HAS_TREE && !hidden ? tree_entry(ray.origin, ray.direction, distance) : 0u;
}

// Where a ray to a light enters the tree; if it does not, `hidden` is known.
uint shadow_entry(Ray ray, float distance, bool wanted, out bool hidden) {
    hidden = any_constant_sphere_before_light(ray, distance);
    return entry_unless_hidden(ray, distance, wanted, hidden);
}

// The same for the segment between two surfaces.
uint segment_entry(Ray ray, float distance, bool wanted, out bool hidden) {
    hidden = any_constant_sphere(ray, distance);
    return entry_unless_hidden(ray, distance, wanted, hidden);
}

// Whether the point at `distance` is hidden: what is known, or, if the ray enters the tree, what that says. For all lanes to
// call, since what the slowest walks counts for the subgroup.
bool hidden_in_scene(Ray ray, float distance, uint entry, bool known, inout uint loops) {
    bool hidden = known;
    if (HAS_TREE) {
        uint steps = 0u;
        if (entry != 0u) hidden = walk_tree(ray, distance, entry, true, loops, steps).id >= 0;
        count_loops(steps, loops);
    }
    return hidden;
}

#endif
