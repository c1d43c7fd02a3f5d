// Closest hit and occlusion, constant spheres and tree together, each ray walked to its end at once.

#ifndef TRACE_GLSL
#define TRACE_GLSL

#include "path.glsl"
#include "intersect/facet.glsl"

// Walks the tree to the end; `loops` grows by the iterations that the whole subgroup spends (drivers bound those).
void walk_tree(inout Walk walk, vec3 o, vec3 d, int leaving, bool any_hit, inout uint loops) {
    TreeRay r = tree_ray(o, d);
    uint steps = 0u;
    while (walk.current != FINISHED && (LOOP_BUDGET == 0u || loops + steps < LOOP_BUDGET)) {
        walk_step(walk, r, leaving, any_hit);
        steps += 1u;
    }
    if (LOOP_BUDGET > 0u) loops += subgroupMax(steps);
}

// Nearest of what is held in constants.
void closest_constant(vec3 o, vec3 d, int leaving, inout float t, inout int id) {
    closest_sphere(o, d, leaving, t, id);
    if (FACET_COUNT > 0u) closest_facet(o, d, leaving, t, id);
}

// Nearest surface along a ray: its id (TREE_GLSL) or -1, and its distance.
int closest_hit(vec3 o, vec3 d, int leaving, out float t, inout uint loops) {
    t = INFINITY;
    int id = -1;
    closest_constant(o, d, leaving, t, id);
#if WITH_TREE
    if (meets_tree(o, d, t)) {
        Walk walk = walk_begin(t);
        walk_tree(walk, o, d, leaving, false, loops);
        t = walk.t;
        id = walk.id >= 0 ? walk.id : id;
    }
#endif
    return id;
}

// Whether a shadow ray must be traced through the tree; if not, `hidden` is already known.
bool shadow_needs_tree(ShadowRay ray, out bool hidden) {
    hidden = spheres_occlude(ray);
    if (FACET_COUNT > 0u) hidden = hidden || any_facet(ray.origin, ray.direction, ray.distance, ray.leaving);
#if WITH_TREE
    return !hidden && meets_tree(ray.origin, ray.direction, ray.distance);
#else
    return false;
#endif
}

bool hidden_by_tree(ShadowRay ray, inout uint loops) {
    Walk walk = walk_begin(ray.distance);
    walk_tree(walk, ray.origin, ray.direction, ray.leaving, true, loops);
    return walk.id >= 0;
}

#endif
