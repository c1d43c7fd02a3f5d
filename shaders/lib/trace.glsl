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
}

// With PATH_STATS: records visited by this lane; and with REUSE, those of them by rays that only ask for any hit.
uint walked_steps = 0u;
uint occlusion_steps = 0u;

// An empty tree, of a program that could do with one, tells nothing of the cost of a sample.
uint counted(uint steps) { return TREE_BOX_COUNT > 0u ? steps : 0u; }

// Walks the tree to the end, or as far as the budget goes; then `loops` has reached LOOP_BUDGET. Returns the steps.
uint walk_tree(inout Walk walk, vec3 o, vec3 d, int leaving, bool any_hit, uint loops) {
    TreeRay r = tree_ray(o, d, any_hit);
    uint steps = 0u;
    while (walk.walks && (LOOP_BUDGET == 0u || loops + steps < LOOP_BUDGET)) {
        walk_step(walk, r, leaving, any_hit, any_hit);
        steps += 1u;
    }
    if (PATH_STATS) walked_steps += steps;
    if (REUSE && any_hit) occlusion_steps += counted(steps);
    return steps;
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
        if (meets_tree(o, d, t)) {
            Walk walk = walk_begin(t);
            steps = walk_tree(walk, o, d, leaving, false, loops);
            t = walk.t;
            id = walk.id >= 0 ? walk.id : id;
        }
        count_loops(steps, loops);
    }
    return id;
}

// Whether a ray that a constant sphere hides or not must be traced through the tree; if not, `hidden` is known.
bool needs_tree(ShadowRay ray, inout bool hidden) {
    // In all lanes: it counts for the subgroup.
    bool behind_facet = FACET_COUNT > 0u && any_facet(ray.origin, ray.direction, ray.distance, ray.leaving);
    hidden = hidden || behind_facet;
    return HAS_TREE && !hidden && meets_tree(ray.origin, ray.direction, ray.distance);
}

// Whether a shadow ray must be traced through the tree; if not, `hidden` is known.
bool shadow_needs_tree(ShadowRay ray, out bool hidden) {
    hidden = spheres_occlude(ray);
    return needs_tree(ray, hidden);
}

// The same for the segment between two surfaces.
bool segment_needs_tree(ShadowRay ray, out bool hidden) {
    hidden = any_sphere(ray.origin, ray.direction, ray.distance, ray.leaving);
    return needs_tree(ray, hidden);
}

bool hidden_by_tree(ShadowRay ray, uint loops, out uint steps) {
    Walk walk = walk_begin(ray.distance);
    steps = walk_tree(walk, ray.origin, ray.direction, ray.leaving, true, loops);
    return walk.id >= 0;
}

// Whether what a ray aims at is hidden: what is known, or, if the lane must walk, what the tree says. For all lanes to
// call, since what the slowest walks counts for the subgroup.
bool hidden_in_scene(ShadowRay ray, bool walks, bool known, inout uint loops) {
    bool hidden = known;
    if (HAS_TREE) {
        uint steps = 0u;
        if (walks) hidden = hidden_by_tree(ray, loops, steps);
        count_loops(steps, loops);
    }
    return hidden;
}

#endif
