// Traversing the bounding volume hierarchy: up to four children a node, a sphere or one or two triangles a leaf, and one record for
// both (see node.glsl). Every step fetches the same three texels; lanes at a leaf test what it holds, the others four boxes.

#ifndef TRAVERSAL_GLSL
#define TRAVERSAL_GLSL

#include "../nearer.glsl"
#include "node.glsl"
#include "stack.glsl"
#include "root_boxes.glsl"
#include "../sphere.glsl"
#include "../../coverage.glsl"

const int BVH_ID = 0x01000000;     // ids from here on are BVH_ID + 2·record, or 1 more; those below are constant spheres and polygons

// The primitive with such a handle, or -1.
int bvh_primitive(int self_id) {
    int slot = self_id - BVH_ID;
    uvec4 four = bvh_texel(3 * int(record_count) + (slot >> 2));
    uvec2 two = (slot & 2) != 0 ? four.zw : four.xy;
    return int((slot & 1) != 0 ? two.y : two.x);
}

// Whether the ray passes anywhere near a triangle: near a sphere around it. Edge functions of a triangle 1e-6 times the size of its
// distance may be nothing but rounding errors: of 1e9 such tests, some report a hit where the ray passes at a distance. In a BVH
// the boxes forbid that; this shares nothing with them.
bool passes_near(BvhRay r, vec3 v0, vec3 v1, vec3 v2) {
    v0 -= r.origin;
    v1 -= r.origin;
    v2 -= r.origin;
    float radius = max(length(v1 - v0), length(v2 - v0));
    return length(cross(v0, r.direction)) <= (radius + 1e-4 * length(v0)) * length(r.direction);
}

// Tests what a leaf holds: the nearer hit, however far away, and its id. `self_id` is the full id (and side) of the primitive the ray
// starts on.
bool leaf_test(BvhRay r, int record, BvhRecord q, int self_id, out float t, out int id) {
    int first = BVH_ID + 2 * record;
    id = first;
    vec3 v0 = uintBitsToFloat(q.a.xyz);
    vec3 v1 = uintBitsToFloat(q.b.xyz);
    vec3 v2 = uintBitsToFloat(q.c.xyz);
    bool hit = false;
    t = INFINITY;
    if (BVH_TRIANGLES) {
        vec3 v3 = uintBitsToFloat(uvec3(q.a.w, q.b.w, q.c.w));
        vec3 w0 = v0;
        vec3 w1 = v1;
        if (HAS_PASSABLE) {
            w0 = uintBitsToFloat(q.a.xyz & COORDINATE_BITS);
            w1 = uintBitsToFloat(q.b.xyz & COORDINATE_BITS);
        }
        vec2 ts;
        bvec2 hits, behind;
        if (MOLLER_TRUMBORE) {
            hits.x = moller_trumbore(r.origin, r.direction, w0, w1, v2, ts.x, behind.x);
            hits.y = moller_trumbore(r.origin, r.direction, v3, v2, w1, ts.y, behind.y);
        } else {
            hits = watertight(r.shear, r.origin, w0, w1, v2, v3, ts, behind);
        }
        if (BRUTE_FORCE) hits = bvec2(hits.x && passes_near(r, w0, w1, v2), hits.y && passes_near(r, v3, v2, w1));
        if (MUTATION == MUTATE_TMIN) hits = bvec2(hits.x && ts.x > 1e-3, hits.y && ts.y > 1e-3);
        else if (MUTATION != MUTATE_SKIP) hits = bvec2(hits.x && self_id != first, hits.y && self_id != first + 1);
        if (HAS_CULLED_BACKS) {
            uvec2 culls_back = uvec2(q.a.x, q.b.x) & ~COORDINATE_BITS;
            hits = bvec2(hits.x && !(culls_back.x != 0u && behind.x), hits.y && !(culls_back.y != 0u && behind.y));
        }
        if (HAS_COVERAGE) {
            uvec2 has_alpha = uvec2(q.a.y, q.b.y) & ~COORDINATE_BITS;
            if (hits.x && has_alpha.x != 0u) hits.x = stops_ray(bvh_primitive(first), r.origin, r.direction);
            if (hits.y && has_alpha.y != 0u) hits.y = stops_ray(bvh_primitive(first + 1), r.origin, r.direction);
        }
        // Of equal distances the first.
        bool second = hits.y && !(hits.x && ts.x <= ts.y);
        hit = hits.x || hits.y;
        t = second ? ts.y : ts.x;
        id = second ? first + 1 : first;
    }
    if (BVH_SPHERES) {
        Sphere s = Sphere(v0, v1.x, 0.0);
        Approach a;
        if (MUTATION == MUTATE_SPHERE) a = approach_plain(s, r.origin, r.direction);
        else a = approach_exact(s, r.origin, r.direction);
        float h = distance_to_either_side(a, false, self_code(self_id, first));
        bool is_sphere = !BVH_TRIANGLES || int(q.b.w) == -2;
        t = is_sphere ? h : t;
        hit = is_sphere ? h < INFINITY : hit;
        id = is_sphere ? first : id;
    }
    return hit;
}

struct Traversal {
    bool running;         // it is not over
    int current;        // record to visit
    uint group;         // what to visit after it, before what is on the stack
    Stack stack;        // what is left of the levels above
    float t;            // nearest hit so far, or the far end
    int id;             // -1, or that of what is hit
};

// The children of the root with which a ray's traversal begins, a bit for each; 0 if there is nothing to traverse.
uint root_hit_mask(vec3 o, vec3 d, float t_max) {
    // A ray that is not finite might traverse the whole BVH.
    if (MUTATION != MUTATE_GUARD && !is_finite(dot(o, o) + dot(d, d))) return 0u;
    return BRUTE_FORCE && ROOT_BOX_COUNT > 0u ? 1u : boxes_hit(o, d, t_max);
}

Traversal traversal_idle() { return Traversal(false, 0, 0u, stack_empty(), 0.0, -1); }

// `entry`: what root_hit_mask has told.
Traversal traversal_begin(BvhRay r, float t_max, uint entry) {
    Traversal w = Traversal(entry != 0u, 0, 0u, stack_empty(), t_max, -1);
    if (!BRUTE_FORCE) {
        w.group = (1u << 7) | ((root_order >> r.octant) & 0x70u) | entry;
        w.current = take_child(w.group);
    }
    return w;
}

// Tests the record at `w.current`, if the traversal is not over and it is a leaf, and goes on to the next.
void brute_force_record(inout Traversal w, BvhRay r, int self_id, bool any_hit) {
    if (!w.running) return;
    int record = w.current;
    BvhRecord q = bvh_record(record);
    float t;
    int id;
    bool hit = is_leaf(q) && leaf_test(r, record, q, self_id, t, id) && is_nearer(t, id, w.t, w.id);
    w.t = hit ? t : w.t;
    w.id = hit ? id : w.id;
    w.current += 1;
    if ((hit && any_hit) || w.current >= int(record_count)) w.running = false;
}

// Sixteen records, written out: where a driver bounds the iterations of an invocation, a loop over them would soon
// reach the bound.
void brute_force_step(inout Traversal w, BvhRay r, int self_id, bool any_hit) {
#define FOUR_RECORDS                              \
    brute_force_record(w, r, self_id, any_hit);   \
    brute_force_record(w, r, self_id, any_hit);   \
    brute_force_record(w, r, self_id, any_hit);   \
    brute_force_record(w, r, self_id, any_hit);
    FOUR_RECORDS
    FOUR_RECORDS
    FOUR_RECORDS
    FOUR_RECORDS
#undef FOUR_RECORDS
}

// One step where lanes are threads, of which each takes its own way.
void traversal_step_alone(inout Traversal w, BvhRay r, int self_id, bool any_hit) {
    if (!w.running) return;
    int record = w.current;
    BvhRecord q = bvh_record(record);
    uint met = 0u;
    if (is_leaf(q)) {
        float t;
        int id;
        bool hit = leaf_test(r, record, q, self_id, t, id) && is_nearer(t, id, w.t, w.id);
        if (hit) {
            w.t = t;
            w.id = id;
            if (any_hit) {
                w.running = false;
                return;
            }
        }
    } else {
        met = children_hit(r, q, w.t);
    }
    if (is_left(met)) {
        if (is_left(w.group)) stack_push(w.stack, w.group);
        w.group = met;
    } else if (!is_left(w.group)) {
        w.group = stack_pop(w.stack);
    }
    w.running = is_left(w.group);
    if (w.running) w.current = take_child(w.group);
}

// One step, none if the traversal is over. With `any_hit`, the first hit ends the traversal. `unordered`: all lanes have such rays, and choose the
// next record sooner.
//
// A CPU that executes the lanes together has little to do while it waits for a record. So where a traversal goes on if the ray meets
// no child is found beside the boxes, and boxes do not wait for the primitives that other lanes test. The next record does not wait for
// these either, so that a traversal that is over goes on through the BVH, to no effect; and it is found before the stack is written, which
// takes about as long. (Were it under a condition, every level of the stack would be blended once more. One whose stack is an array
// stays where it is, and so within the array.)
void traversal_step(inout Traversal w, BvhRay r, int self_id, bool any_hit, bool unordered) {
    if (BRUTE_FORCE) {
        brute_force_step(w, r, self_id, any_hit);
        return;
    }
    if (THREADS) {
        traversal_step_alone(w, r, self_id, any_hit);
        return;
    }
    int record = w.current;
    BvhRecord q = bvh_record(record);
    bool leaf = is_leaf(q);
    bool stop = false;
    uint met = children_hit(r, q, w.t);
    bool moves = SHORT_STACK || w.running;
    met = moves && !leaf ? met : 0u;
    if (leaf && w.running) {
        float t;
        int id;
        bool hit = leaf_test(r, record, q, self_id, t, id) && (unordered ? t < w.t : is_nearer(t, id, w.t, w.id));
        if (!unordered) w.t = hit ? t : w.t;
        w.id = hit ? id : w.id;
        stop = hit && any_hit;
    }
    bool descend = is_left(met);
    bool others = is_left(w.group);
    uint otherwise = others ? w.group : stack_top(w.stack);
    bool more = is_left(otherwise);
    uint group = descend ? met : otherwise;
    int next = unordered ? take_any_child(group) : take_child(group);
    w.current = descend || more ? next : 0;
    stack_shift(w.stack, w.group, descend && others, moves && !descend && !others);
    w.group = group;
    w.running = w.running && (descend || more) && !stop;
}

// The same; with PATH_STATS steps are counted.
void traversal_advance(inout Traversal w, BvhRay r, int self_id, bool any_hit, inout uint steps) {
    if (PATH_STATS) steps += w.running ? 1u : 0u;
    traversal_step(w, r, self_id, any_hit, false);
}

#endif
