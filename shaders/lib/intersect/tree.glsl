// Walking the bounding volume hierarchy: two children a node, one primitive a leaf, one 64-byte record for both
// (src/accel/record.rs). Every step fetches the same four texels and tests two boxes; lanes at a leaf test its primitive.
//
//   inner node   lo0 | child0,  hi0 | child1,  lo1 | -,  hi1 | -
//   triangle     v0 | surface,  v1 | attributes,  v2 | light,  normal | 1
//   sphere       centre | surface,  (radius, 1/radius with the normal's sign, -) | -,  - | light,  - | 2
//
// A child is a record's index; its sign bit marks a leaf. The host bounds the depth, hence the stack.

#ifndef TREE_GLSL
#define TREE_GLSL

#include "../layout.glsl"
#include "../math.glsl"
#include "triangle.glsl"
#include "sphere.glsl"

const int TREE_DEPTH = 64;          // entries of the stack, checked by the host (accel::MAX_DEPTH)
const int FINISHED = 0x7fffffff;
const int TREE_ID = 0x01000000;     // ids from here on are TREE_ID + record; those below are constant spheres

// Widens the slab test by 1 + 2γ(7): the reciprocal of a direction may be off by 2.5 ulp (Ize, JCGT 2013).
const float SLAB_MARGIN = MUTATION == MUTATE_SLAB ? 1.0 : 1.0000009;

struct TreeRay {
    vec3 origin;
    vec3 direction;
    vec3 inverse;
    Shear shear;
};

// 1/d without infinities: 0·∞ must not arise in the slab test, where NaN would be lost or win by chance; nor may boxes be
// met at infinity, which is not beyond a t_max of infinity: a ray without direction would walk all of an octant.
vec3 safe_inverse(vec3 d) {
    if (MUTATION == MUTATE_INVERSE) return 1.0 / d;
    const float tiny = 1e-30;
    vec3 clamped = vec3(abs(d.x) < tiny ? tiny : d.x, abs(d.y) < tiny ? tiny : d.y, abs(d.z) < tiny ? tiny : d.z);
    return 1.0 / clamped;
}

TreeRay tree_ray(vec3 o, vec3 d) { return TreeRay(o, d, safe_inverse(d), shear_of(d)); }

bool box_test(TreeRay r, vec3 lo, vec3 hi, float t_max, out float t_near) {
    vec3 a = (lo - r.origin) * r.inverse;
    vec3 b = (hi - r.origin) * r.inverse;
    vec3 n = vec3(lower(a.x, b.x), lower(a.y, b.y), lower(a.z, b.z));
    vec3 f = vec3(upper(a.x, b.x), upper(a.y, b.y), upper(a.z, b.z));
    t_near = upper(upper(n.x, n.y), upper(n.z, 0.0));
    // t_max too: the hit it stems from may lie in front of the box by rounding alone, and equal hits must be compared.
    return t_near <= lower(lower(lower(f.x, f.y), f.z), t_max) * SLAB_MARGIN;
}

// Tests the primitive of a leaf record; `leaving` is the full id (and side) of the primitive the ray starts on.
bool leaf_test(TreeRay r, int record, vec4 q0, vec4 q1, vec4 q2, vec4 q3, float t_max, int leaving, out float t) {
    int id = TREE_ID + record;
    bool hit;
    if (MOLLER_TRUMBORE) {
        vec3 unused;
        hit = moller_trumbore(r.origin, r.direction, q0.xyz, q1.xyz, q2.xyz, t_max, t, unused);
    } else {
        vec3 unused;
        hit = watertight(r.shear, r.origin, q0.xyz, q1.xyz, q2.xyz, t_max, t, unused);
    }
    if (MUTATION == MUTATE_TMIN) hit = hit && t > 1e-3;
    else if (MUTATION != MUTATE_SKIP) hit = hit && leaving != id;
    if (TREE_SPHERES) {
        Sphere s = Sphere(q0.xyz, q1.x, 0.0, SIDE_BOTH, FORM_EXACT);
        float h = sphere_distance(s, r.origin, 0.0, r.direction, 0.0, leaving_code(leaving, id));
        bool is_sphere = q3.w == 2.0;
        t = is_sphere ? h : t;
        hit = is_sphere ? h <= t_max && h < INFINITY : hit;
    }
    return hit;
}

struct Walk {
    int current;        // record to visit, FINISHED when done
    int top;            // entries on the stack
    float t;            // nearest hit so far, or the far end
    int id;             // -1, or TREE_ID + record
};

// Boxes around a few large subtrees: a ray that misses all of them never enters the tree.
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
    TreeRay r;
    r.origin = o;
    r.inverse = safe_inverse(d);
    float unused;
    bool meets = box_test(r, TREE_BOX_LO(0), TREE_BOX_HI(0), t_max, unused);
    if (TREE_BOX_COUNT > 1u) meets = meets || box_test(r, TREE_BOX_LO(1), TREE_BOX_HI(1), t_max, unused);
    if (TREE_BOX_COUNT > 2u) meets = meets || box_test(r, TREE_BOX_LO(2), TREE_BOX_HI(2), t_max, unused);
    if (TREE_BOX_COUNT > 3u) meets = meets || box_test(r, TREE_BOX_LO(3), TREE_BOX_HI(3), t_max, unused);
    return meets;
}

// Whether a ray must be walked through the tree.
bool meets_tree(vec3 o, vec3 d, float t_max) {
    if (!HAS_TREE) return false;
    // A ray that is not finite would walk the whole tree: NaN is in every box.
    if (MUTATION != MUTATE_GUARD && !is_finite(dot(o, o) + dot(d, d))) return false;
    return BRUTE_FORCE || meets_boxes(o, d, t_max);
}

int walk_stack[TREE_DEPTH];

Walk walk_begin(float t_max) {
    walk_stack[0] = FINISHED;
    return Walk(BRUTE_FORCE ? int(LEAF_BEGIN) : 0, 1, t_max, -1);
}

// Of equal distances the lower record wins, whatever the order of the walk.
bool nearer(Walk w, int record, float t) { return t < w.t || TREE_ID + record < w.id; }

#if WITH_BRUTE_FORCE
// Tests the leaf at `w.current`, if there still is one, and goes on to the next.
void brute_force_leaf(inout Walk w, TreeRay r, int leaving, bool any_hit) {
    if (w.current == FINISHED) return;
    int record = w.current;
    vec4 q0 = texelFetch(tree_texels, 4 * record);
    vec4 q1 = texelFetch(tree_texels, 4 * record + 1);
    vec4 q2 = texelFetch(tree_texels, 4 * record + 2);
    vec4 q3 = texelFetch(tree_texels, 4 * record + 3);
    float t;
    bool hit = leaf_test(r, record, q0, q1, q2, q3, w.t, leaving, t) && nearer(w, record, t);
    w.t = hit ? t : w.t;
    w.id = hit ? TREE_ID + record : w.id;
    w.current += 1;
    if ((hit && any_hit) || w.current >= int(LEAF_END)) w.current = FINISHED;
}

// Sixteen leaves, written out: where a driver bounds the iterations of an invocation, a loop over them would soon
// reach the bound.
void brute_force_step(inout Walk w, TreeRay r, int leaving, bool any_hit) {
#define FOUR_LEAVES                             \
    brute_force_leaf(w, r, leaving, any_hit);   \
    brute_force_leaf(w, r, leaving, any_hit);   \
    brute_force_leaf(w, r, leaving, any_hit);   \
    brute_force_leaf(w, r, leaving, any_hit);
    FOUR_LEAVES
    FOUR_LEAVES
    FOUR_LEAVES
    FOUR_LEAVES
#undef FOUR_LEAVES
}
#endif

// One step. With `any_hit`, the first hit ends the walk.
void walk_step(inout Walk w, TreeRay r, int leaving, bool any_hit) {
#if WITH_BRUTE_FORCE
    if (BRUTE_FORCE) {
        brute_force_step(w, r, leaving, any_hit);
        return;
    }
#endif
    int record = w.current & 0x7fffffff;
    bool leaf = w.current < 0;
    vec4 q0 = texelFetch(tree_texels, 4 * record);
    vec4 q1 = texelFetch(tree_texels, 4 * record + 1);
    vec4 q2 = texelFetch(tree_texels, 4 * record + 2);
    vec4 q3 = texelFetch(tree_texels, 4 * record + 3);
    bool stop = false;
    if (leaf) {
        float t;
        bool hit = leaf_test(r, record, q0, q1, q2, q3, w.t, leaving, t) && nearer(w, record, t);
        w.t = hit ? t : w.t;
        w.id = hit ? TREE_ID + record : w.id;
        stop = hit && any_hit;
    }
    float t0, t1;
    bool h0 = box_test(r, q0.xyz, q1.xyz, w.t, t0) && !leaf;
    bool h1 = box_test(r, q2.xyz, q3.xyz, w.t, t1) && !leaf;
    int c0 = floatBitsToInt(q0.w);
    int c1 = floatBitsToInt(q1.w);
    bool swap = t1 < t0;
    int near_child = swap ? c1 : c0;
    int far_child = swap ? c0 : c1;
    bool both = h0 && h1;
    // Unconditional store, conditional count: a masked store costs six times as much on a CPU.
    walk_stack[w.top] = far_child;
    w.top += both ? 1 : 0;
    int next = both ? near_child : (h0 ? c0 : c1);
    bool pop = !(h0 || h1);
    w.top -= pop ? 1 : 0;
    if (pop) next = walk_stack[w.top];
    w.current = stop ? FINISHED : next;
}

#endif
