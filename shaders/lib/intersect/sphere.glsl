// Constant spheres: up to 16, unrolled, so that the compiler folds what a sphere does not need. Each has a *side* and a *form*,
// chosen by the host (src/render/scene/spheres.rs), which are specialization constants. Its numbers are fetched once, when a kernel
// begins: as constants too they would save up to 6% of the time on lavapipe 25, and 15% on 22, but a kernel would be compiled
// for each scene, and for each place of the camera.
//
// Side: from where can rays meet it?
//   SOLID   opaque, the camera and all emitters are outside: no ray begins or ends inside, so only the near root counts. A
//           ray that starts a rounding error inside is stopped at once: there is nothing to leak into.
//   CAVITY  opaque, the camera and all emitters are inside: only the far root counts.
//   BOTH    all others: dielectrics, spheres around or across an emitter, and with the camera on them.
//
// Form: how are the roots computed (approach_wall, approach_small)? With f = c − o, b = f·d, |d| = 1:
//   WALL    b² − C with C = |f|² − r² = K − 2 c·o + |o|², K = |c|² − r² rounded once on the host. Its error is that of
//           a few roundings at the size of 2 r·|o|, hence ~|o|·2⁻²² in distance for a sphere of any radius; the
//           textbook form loses ~r·2⁻²² (0.17 units at r = 1000).
//   SMALL   Haines's r² − |f − b d|² (Ray Tracing Gems, ch. 7): stable while the sphere is not far away for its size.
// Spheres in the BVH, which may be small and far away, have neither: approach_exact.

#ifndef SPHERE_GLSL
#define SPHERE_GLSL

#include "../layout.glsl"
#include "../unroll.glsl"
#include "../math.glsl"

const uint SIDE_SOLID = 0u;
const uint SIDE_CAVITY = 1u;
const uint SIDE_BOTH = 2u;
const uint FORM_WALL = 0u;
const uint FORM_SMALL = 1u;

struct Sphere {
    vec3 center;
    float radius;
    float power;    // K = |c|² − r²
};

// Set in a path's `self_id` when the ray runs on the inner side of that sphere.
const int INSIDE = 0x40000000;

// Where a ray is closest to a sphere's centre, and what decides whether it meets the sphere.
struct Approach {
    float b;        // distance along the ray
    float disc;     // discriminant
    float c;        // C; only its sign is used where the form lacks precision
};

// As textbooks have it.
Approach approach_plain(Sphere s, vec3 o, vec3 d) {
    vec3 f = s.center - o;
    float b = dot(f, d);
    float c = dot(f, f) - s.radius * s.radius;
    return Approach(b, b * b - c, c);
}

Approach approach_wall(Sphere s, vec3 o, float oo, vec3 d, float od) {
    float b = dot(s.center, d) - od;
    float c = (s.power + oo) - 2.0 * dot(s.center, o);
    return Approach(b, b * b - c, c);
}

Approach approach_small(Sphere s, vec3 o, vec3 d) {
    vec3 f = s.center - o;
    float b = dot(f, d);
    vec3 l = f - b * d;
    return Approach(b, s.radius * s.radius - dot(l, l), dot(f, f) - s.radius * s.radius);
}

Approach approach_exact(Sphere s, vec3 o, vec3 d) {
    precise vec3 f = s.center - o;
    precise vec3 v = f - s.center;
    precise vec3 e = (s.center - (f - v)) - (o + v);
    // On to near the closest approach: by a distance of 12 bits, whose products with the halves of d have no error.
    float step = upper_half(dot(f, d));
    vec3 high = vec3(upper_half(d.x), upper_half(d.y), upper_half(d.z));
    precise vec3 g = ((f - step * high) + e) - step * (d - high);
    // From there the centre is so near that what is rounded is small, and so is what it matters that d is a unit vector only to
    // rounding.
    float rest = dot(g, d);
    vec3 l = g - rest * d;
    return Approach(step + rest, s.radius * s.radius - dot(l, l), dot(f, f) - s.radius * s.radius);
}

// Distances to the sphere along the ray, or INFINITY. `self_id`: 0 no, 1 on its outer side, 2 on its inner side; `wall`:
// the form is WALL.

float distance_to_solid(Approach a, bool wall, int self_id) {
    float root = sqrt(fast_max(a.disc, 0.0));
    float t = wall ? fast_max(a.c, 0.0) / (a.b + root) : fast_max(a.b - root, 0.0);
    return self_id == 0 && a.b > 0.0 && a.disc > 0.0 ? t : INFINITY;
}

float distance_in_cavity(Approach a, bool wall, int self_id) {
    float root = sqrt(fast_max(a.disc, 0.0));
    // Near a wall of a large cavity b + root would cancel.
    float farther = wall && a.b < 0.0 ? a.c / (a.b - root) : a.b + root;
    return fast_max(self_id != 0 ? 2.0 * a.b : farther, 0.0);
}

float distance_to_either_side(Approach a, bool wall, int self_id) {
    float root = sqrt(fast_max(a.disc, 0.0));
    bool inside = self_id == 2 || (self_id == 0 && a.c < 0.0);
    bool hit = self_id != 1 && (inside || (a.b > 0.0 && a.disc > 0.0));
    float nearer = wall ? fast_max(a.c, 0.0) / (a.b + root) : fast_max(a.b - root, 0.0);
    float farther = self_id == 2 ? 2.0 * a.b : (wall && a.b < 0.0 ? a.c / (a.b - root) : a.b + root);
    return hit ? (inside ? fast_max(farther, 0.0) : nearer) : INFINITY;
}

// Whether a solid sphere lies between the ray's origin and the point at `distance`. That point is outside, emitters being there
// (and of points the host drops those inside): then the near root is before it exactly if the closest approach is.
//
// Whether one sphere does is told by the sign of an integer, so that many are put together by `or`: what LLVM knows to be conditions
// it makes narrower first, for each sphere anew. Where b or the discriminant is 0 either answer is right.
int solid_occludes(Approach a, float distance, int self_id) {
    int occludes = ~(floatBitsToInt(a.b) | floatBitsToInt(a.disc)) & floatBitsToInt(a.b - distance);
    return self_id == 0 ? occludes : 0;
}

// The same seen from the far end p, a point that is the same for all rays: `from_point` has f = c − p, and |f|² − r².
int solid_occludes_point(vec4 from_point, vec3 d, float distance, int self_id) {
    float b = dot(from_point.xyz, d);
    int occludes = floatBitsToInt(b) & floatBitsToInt(-distance - b) & floatBitsToInt(from_point.w - b * b);
    return self_id == 0 ? occludes : 0;
}

int either_side_occludes_point(vec4 from_point, bool inside, vec3 d, float distance, int self_id) {
    float k = from_point.w;
    float b = dot(from_point.xyz, d);
    // Looking from p towards the start of the ray.
    float root = sqrt(fast_max(b * b - k, 0.0));
    bool occludes = self_id == 2 || (self_id == 0 && b < 0.0 && b * b > k && -b - root < distance);
    if (inside) occludes = self_id != 2 && root - b < distance;
    return occludes ? -1 : 0;
}

#define CONSTANT_SPHERE(n, base)                                      \
    layout(constant_id = base) const uint SPHERE_##n##_SIDE = 2u;     \
    layout(constant_id = base + 1) const uint SPHERE_##n##_FORM = 1u; \
    Sphere sphere_##n;                                                \
    vec4 from_point_##n;

CONSTANT_SPHERE(0, 64)
CONSTANT_SPHERE(1, 66)
CONSTANT_SPHERE(2, 68)
CONSTANT_SPHERE(3, 70)
CONSTANT_SPHERE(4, 72)
CONSTANT_SPHERE(5, 74)
CONSTANT_SPHERE(6, 76)
CONSTANT_SPHERE(7, 78)
CONSTANT_SPHERE(8, 80)
CONSTANT_SPHERE(9, 82)
CONSTANT_SPHERE(10, 84)
CONSTANT_SPHERE(11, 86)
CONSTANT_SPHERE(12, 88)
CONSTANT_SPHERE(13, 90)
CONSTANT_SPHERE(14, 92)
CONSTANT_SPHERE(15, 94)

#define IS_WALL(n) (SPHERE_##n##_FORM == FORM_WALL)

// Sides and forms are asked for by branches, so that what a sphere does not need is gone before a driver sees it
// (src/gpu/prune.rs).
#define FIND_APPROACH(n, a)                                                                \
    Approach a;                                                                           \
    if (MUTATION == MUTATE_SPHERE) a = approach_plain(sphere_##n, o, d);                  \
    else if (SPHERE_##n##_FORM == FORM_WALL) a = approach_wall(sphere_##n, o, oo, d, od); \
    else a = approach_small(sphere_##n, o, d);

// BODY(n) for each constant sphere.
#define FOR_EACH_SPHERE(BODY) FOR_0_TO_15(SPHERE_COUNT, BODY)

// To be called when a kernel begins.
void load_spheres() {
#define LOAD_SPHERE(n)                                                                          \
    {                                                                                           \
        vec4 values = sphere_values[2 * n];                                                     \
        sphere_##n = Sphere(values.xyz, values.w, sphere_values[2 * n + 1].x);                  \
        vec3 f = values.xyz - point_position.xyz;                                               \
        from_point_##n = vec4(f, dot(f, f) - values.w * values.w);                              \
    }
    FOR_EACH_SPHERE(LOAD_SPHERE)
#undef LOAD_SPHERE
}

int self_code(int self_id, int id) {
    if (MUTATION == MUTATE_SKIP) return 0;
    return self_id == id ? 1 : (self_id == (id | INSIDE) ? 2 : 0);
}

// Nearest of the constant spheres; ties go to the lower index. `id` is the sphere's index.
void closest_sphere(vec3 o, vec3 d, int self_id, inout float t, inout int id) {
    float oo = dot(o, o);
    float od = dot(o, d);
#define TEST_CLOSEST(n)                                                              \
    {                                                                                \
        FIND_APPROACH(n, a)                                                          \
        int from = self_code(self_id, n);                                         \
        float h;                                                                     \
        if (SPHERE_##n##_SIDE == SIDE_SOLID) h = distance_to_solid(a, IS_WALL(n), from); \
        else if (SPHERE_##n##_SIDE == SIDE_CAVITY) h = distance_in_cavity(a, IS_WALL(n), from); \
        else h = distance_to_either_side(a, IS_WALL(n), from);                       \
        bool closer = h < t;                                                         \
        t = closer ? h : t;                                                          \
        id = closer ? n : id;                                                        \
    }
    FOR_EACH_SPHERE(TEST_CLOSEST)
#undef TEST_CLOSEST
}

// Whether any constant sphere lies between o and the point at `distance`.
bool any_sphere(vec3 o, vec3 d, float distance, int self_id) {
    float oo = dot(o, o);
    float od = dot(o, d);
    int occluded = 0;
#define TEST_ANY(n)                                                                               \
    if (SPHERE_##n##_SIDE != SIDE_CAVITY) {                                                       \
        FIND_APPROACH(n, a)                                                                       \
        int from = self_code(self_id, n);                                                      \
        int occludes;                                                                             \
        if (SPHERE_##n##_SIDE == SIDE_SOLID) occludes = solid_occludes(a, distance, from);        \
        else occludes = distance_to_either_side(a, IS_WALL(n), from) < distance ? -1 : 0;         \
        occluded |= occludes;                                                                     \
    }
    FOR_EACH_SPHERE(TEST_ANY)
#undef TEST_ANY
    return occluded < 0;
}

// The same for the only light, a point, at that distance.
bool any_sphere_before_point(vec3 d, float distance, int self_id) {
    int occluded = 0;
#define TEST_BEFORE(n)                                                                                   \
    if (SPHERE_##n##_SIDE != SIDE_CAVITY) {                                                              \
        int from = self_code(self_id, n);                                                             \
        int occludes;                                                                                    \
        if (SPHERE_##n##_SIDE == SIDE_SOLID) occludes = solid_occludes_point(from_point_##n, d, distance, from); \
        else if ((POINT_INSIDE & (1u << n)) != 0u) occludes = either_side_occludes_point(from_point_##n, true, d, distance, from); \
        else occludes = either_side_occludes_point(from_point_##n, false, d, distance, from);                   \
        occluded |= occludes;                                                                            \
    }
    FOR_EACH_SPHERE(TEST_BEFORE)
#undef TEST_BEFORE
    return occluded < 0;
}

#endif
