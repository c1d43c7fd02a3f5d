// Walking the bounding volume hierarchy: up to four children a node, one primitive a leaf, and one record for both (see
// node.glsl). Every step fetches the same three texels; lanes at a leaf test its primitive, the others four boxes.

#ifndef TREE_GLSL
#define TREE_GLSL

#include "node.glsl"
#include "stack.glsl"
#include "tree_boxes.glsl"
#include "sphere.glsl"

const int TREE_ID = 0x01000000;     // ids from here on are TREE_ID + record; those below are constant spheres

// Tests the primitive of a leaf; `leaving` is the full id (and side) of the primitive the ray starts on.
bool leaf_test(TreeRay r, int record, TreeRecord q, float t_max, int leaving, out float t) {
    int id = TREE_ID + record;
    vec3 v0 = uintBitsToFloat(q.a.xyz);
    vec3 v1 = uintBitsToFloat(q.b.xyz);
    vec3 v2 = uintBitsToFloat(q.c.xyz);
    bool hit = false;
    t = INFINITY;
    vec3 unused;
    if (TREE_TRIANGLES) {
        if (MOLLER_TRUMBORE) hit = moller_trumbore(r.origin, r.direction, v0, v1, v2, t_max, t, unused);
        else hit = watertight(r.shear, r.origin, v0, v1, v2, t_max, t, unused);
    }
    if (MUTATION == MUTATE_TMIN) hit = hit && t > 1e-3;
    else if (MUTATION != MUTATE_SKIP) hit = hit && leaving != id;
    if (TREE_SPHERES) {
        Sphere s = Sphere(v0, v1.x, 0.0);
        Approach a;
        if (MUTATION == MUTATE_SPHERE) a = approach_plain(s, r.origin, r.direction);
        else a = approach_exact(s, r.origin, r.direction);
        float h = distance_to_either_side(a, false, leaving_code(leaving, id));
        bool is_sphere = !TREE_TRIANGLES || int(q.b.w) == -2;
        t = is_sphere ? h : t;
        hit = is_sphere ? h <= t_max && h < INFINITY : hit;
    }
    return hit;
}

struct Walk {
    bool walks;         // it is not over
    int current;        // record to visit
    uint group;         // what to visit after it, before what is on the stack
    Stack stack;        // what is left of the levels above
    float t;            // nearest hit so far, or the far end
    int id;             // -1, or TREE_ID + record
};

// Whether a ray must be walked through the tree.
bool meets_tree(vec3 o, vec3 d, float t_max) {
    // A ray that is not finite might walk the whole tree.
    if (MUTATION != MUTATE_GUARD && !is_finite(dot(o, o) + dot(d, d))) return false;
    return BRUTE_FORCE || meets_boxes(o, d, t_max);
}

Walk walk_idle() { return Walk(false, 0, 0u, stack_empty(), 0.0, -1); }
Walk walk_begin(float t_max) { return Walk(true, 0, 0u, stack_empty(), t_max, -1); }

// Of equal distances the lower record wins, whatever the order of the walk.
bool nearer(Walk w, int record, float t) { return t < w.t || TREE_ID + record < w.id; }

// Whether the ray passes anywhere near the triangle of a leaf: near a sphere around it. Edge functions of a triangle
// 1e-6 times the size of its distance may be nothing but rounding errors: of 1e9 such tests, some report a hit where the
// ray passes at a distance. In a tree the boxes forbid that; this shares nothing with them.
bool passes_near(TreeRay r, TreeRecord q) {
    if (TREE_SPHERES && int(q.b.w) == -2) return true;
    vec3 v0 = uintBitsToFloat(q.a.xyz) - r.origin;
    vec3 v1 = uintBitsToFloat(q.b.xyz) - r.origin;
    vec3 v2 = uintBitsToFloat(q.c.xyz) - r.origin;
    float radius = max(length(v1 - v0), length(v2 - v0));
    return length(cross(v0, r.direction)) <= (radius + 1e-4 * length(v0)) * length(r.direction);
}

// Tests the record at `w.current`, if the walk is not over and it is a leaf, and goes on to the next.
void brute_force_record(inout Walk w, TreeRay r, int leaving, bool any_hit) {
    if (!w.walks) return;
    int record = w.current;
    TreeRecord q = tree_record(record);
    float t;
    bool hit = is_leaf(q) && leaf_test(r, record, q, w.t, leaving, t) && nearer(w, record, t) && passes_near(r, q);
    w.t = hit ? t : w.t;
    w.id = hit ? TREE_ID + record : w.id;
    w.current += 1;
    if ((hit && any_hit) || w.current >= int(record_count)) w.walks = false;
}

// Sixteen records, written out: where a driver bounds the iterations of an invocation, a loop over them would soon
// reach the bound.
void brute_force_step(inout Walk w, TreeRay r, int leaving, bool any_hit) {
#define FOUR_RECORDS                              \
    brute_force_record(w, r, leaving, any_hit);   \
    brute_force_record(w, r, leaving, any_hit);   \
    brute_force_record(w, r, leaving, any_hit);   \
    brute_force_record(w, r, leaving, any_hit);
    FOUR_RECORDS
    FOUR_RECORDS
    FOUR_RECORDS
    FOUR_RECORDS
#undef FOUR_RECORDS
}

// One step, none if the walk is over. With `any_hit`, the first hit ends the walk.
//
// A CPU that executes the lanes together has little to do while it waits for a record. So where a walk goes on if the ray meets
// no child is found beside the boxes, and boxes do not wait for the primitives that other lanes test; nor does the next record,
// so that a walk that is over goes through the same motions to no effect. (Were they under a condition, every level of the stack
// would be blended once more.)
void walk_step(inout Walk w, TreeRay r, int leaving, bool any_hit) {
    if (BRUTE_FORCE) {
        brute_force_step(w, r, leaving, any_hit);
        return;
    }
    int record = w.current;
    TreeRecord q = tree_record(record);
    bool leaf = is_leaf(q);
    bool stop = false;
    uint met = children_met(r, q, w.t);
    met = w.walks && !leaf ? met : 0u;
    if (leaf && w.walks) {
        float t;
        bool hit = leaf_test(r, record, q, w.t, leaving, t) && nearer(w, record, t);
        w.t = hit ? t : w.t;
        w.id = hit ? TREE_ID + record : w.id;
        stop = hit && any_hit;
    }
    bool descend = is_left(met);
    bool others = is_left(w.group);
    uint top = stack_shift(w.stack, w.group, descend && others, w.walks && !descend && !others);
    uint otherwise = others ? w.group : top;
    bool more = is_left(otherwise);
    int child = take_member(met);
    int other = take_member(otherwise);
    other = more ? other : 0;
    w.group = descend ? met : otherwise;
    w.current = descend ? child : other;
    w.walks = w.walks && (descend || more) && !stop;
}

// The same; with PATH_STATS steps are counted.
void walk_on(inout Walk w, TreeRay r, int leaving, bool any_hit, inout uint steps) {
    if (PATH_STATS) steps += w.walks ? 1u : 0u;
    walk_step(w, r, leaving, any_hit);
}

#endif
