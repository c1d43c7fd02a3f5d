// Closest hit and occlusion, constant spheres and tree together, each ray walked to its end at once.

#ifndef TRACE_GLSL
#define TRACE_GLSL

#include "path.glsl"
#include "intersect/facet.glsl"

// Fetches the numbers of the scene. To be called when a kernel begins.
void load_scene() {
    load_spheres();
    load_facets();
    load_tree_boxes();
    load_point();
    load_lights();
    load_constants();
}

// With PATH_STATS: records visited by this lane; and with REUSE, those of them by rays that only ask for any hit.
uint walked_steps = 0u;
uint occlusion_steps = 0u;

// Walks the tree to the end, or as far as the budget goes; then `loops` has reached LOOP_BUDGET.
Walk walk_tree(vec3 o, vec3 d, float t_max, int leaving, uint entry, bool any_hit, uint loops, out uint steps) {
    TreeRay r = tree_ray(o, d, any_hit);
    Walk walk = walk_begin(r, t_max, entry);
    steps = 0u;
    while (walk.walks && (LOOP_BUDGET == 0u || loops + steps < LOOP_BUDGET)) {
        walk_step(walk, r, leaving, any_hit, any_hit);
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

// Nearest of the constant spheres and facets.
void closest_constant(vec3 o, vec3 d, int leaving, inout float t, inout int id) {
    closest_sphere(o, d, leaving, t, id);
    if (FACET_COUNT > 0u) closest_facet(o, d, leaving, t, id);
}

// Nearest surface along a ray: its id (TREE_GLSL) or -1, and its distance.
int closest_hit(vec3 o, vec3 d, int leaving, out float t, inout uint loops) {
    t = INFINITY;
    int id = -1;
    closest_constant(o, d, leaving, t, id);
    if (HAS_TREE) {
        uint steps = 0u;
        uint entry = tree_entry(o, d, t);
        if (entry != 0u) {
            Walk walk = walk_tree(o, d, t, leaving, entry, false, loops, steps);
            t = walk.t;
            id = walk.id >= 0 ? walk.id : id;
        }
        count_loops(steps, loops);
    }
    return id;
}

// Where a ray that a constant sphere hides or not enters the tree (tree_entry); if it does not, `hidden` is known.
uint entry_unless_hidden(ShadowRay ray, inout bool hidden) {
    // In all lanes: it counts for the subgroup.
    bool behind_facet = FACET_COUNT > 0u && any_facet(ray.origin, ray.direction, ray.distance, ray.leaving, ray.wanted);
    hidden = hidden || behind_facet;
    return HAS_TREE && !hidden ? tree_entry(ray.origin, ray.direction, ray.distance) : 0u;
}

// Where a shadow ray enters the tree; if it does not, `hidden` is known.
uint shadow_entry(ShadowRay ray, out bool hidden) {
    hidden = spheres_occlude(ray);
    return entry_unless_hidden(ray, hidden);
}

// The same for the segment between two surfaces.
uint segment_entry(ShadowRay ray, out bool hidden) {
    hidden = any_sphere(ray.origin, ray.direction, ray.distance, ray.leaving);
    return entry_unless_hidden(ray, hidden);
}

bool hidden_by_tree(ShadowRay ray, uint entry, uint loops, out uint steps) {
    return walk_tree(ray.origin, ray.direction, ray.distance, ray.leaving, entry, true, loops, steps).id >= 0;
}

// Whether what a ray aims at is hidden: what is known, or, if it enters the tree, what that says. For all lanes to
// call, since what the slowest walks counts for the subgroup.
bool hidden_in_scene(ShadowRay ray, uint entry, bool known, inout uint loops) {
    bool hidden = known;
    if (HAS_TREE) {
        uint steps = 0u;
        if (entry != 0u) hidden = hidden_by_tree(ray, entry, loops, steps);
        count_loops(steps, loops);
    }
    return hidden;
}

#endif
